"""Rates of a simulated car beside the angles that its attitude (roll, pitch, yaw) turned about its axes.

The pickle is read without running its classes.
"""

import pickle

import numpy as np
from scipy.spatial.transform import Rotation


def body_angles(x, y, z, w):
    """What a body turned about each of its own axes, summed up from row to row."""
    a = np.column_stack([w, x, y, z])
    a /= np.linalg.norm(a, axis=1)[:, None]
    p, q = a[:-1] * [1, -1, -1, -1], a[1:]
    real = p[:, 0] * q[:, 0] - (p[:, 1:] * q[:, 1:]).sum(1)
    turn = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    turn *= np.sign(real)[:, None]
    size = np.linalg.norm(turn, axis=1)
    share = np.where(size > 1e-12, 2 * np.arctan2(size, np.abs(real)) / np.maximum(size, 1e-12), 2.0)
    return np.vstack([np.zeros(3), np.cumsum(turn * share[:, None], axis=0)])


class Plain:
    """What stands for a class of its author: the state as it was written."""

    def __setstate__(self, state):
        self.__dict__.update(state)


class Safe(pickle.Unpickler):
    """Arrays and plain objects alone."""

    def find_class(self, module, name):
        """NumPy's arrays, and a plain stand-in for each class of the author."""
        if name in ("_reconstruct", "scalar") and module.startswith("numpy"):
            return getattr(np._core.multiarray, name)
        if module == "numpy" and name in ("ndarray", "dtype"):
            return getattr(np, name)
        if module == "_codecs" and name == "encode":
            return lambda text, coding: text.encode(coding)
        if module == "copyreg" and name == "_reconstructor":
            return lambda kind, base, state: kind.__new__(kind)
        if module == "builtins" and name == "object":
            return object
        if module.split(".")[0] in ("data", "rotations", "utils", "__main__"):
            return Plain
        raise pickle.UnpicklingError(f"{module}.{name}")


with open("raw/data/pt1_data.pkl", "rb") as opened:
    held = Safe(opened, encoding="latin1").load()
rates, truth = held["imu_w"], held["gt"].__dict__
time = np.asarray(rates.t)[: len(rates.data)]
angles = body_angles(*Rotation.from_euler("ZYX", truth["_r_init"][:, ::-1]).as_quat().T)
beside = [np.interp(time, np.asarray(truth["_t"]), a) for a in angles.T]
np.savetxt(
    "turned.csv",
    np.column_stack([time - time[0], rates.data, *beside]),
    fmt="%.9g",
    delimiter=",",
    header="t,gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
