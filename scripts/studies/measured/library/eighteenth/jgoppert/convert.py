"""Logs of PX4 kept as pickled tables of an old pandas, one row a second.

They are read without running any class but NumPy's arrays.
"""

import datetime
import pickle
from pathlib import Path

import numpy as np


class Plain:
    """What stands for a class of pandas: its state as it was written."""

    def __init__(self, *given):
        self.given, self.state = given, None

    def __setstate__(self, state):
        self.state = state


def index(_, given):
    return Plain(given)


class Safe(pickle.Unpickler):
    """Arrays, and stand-ins for the classes of pandas."""

    def find_class(self, module, name):
        """NumPy's arrays, and a plain stand-in for each class of pandas."""
        if name == "_reconstruct" and module.startswith("numpy"):
            return np._core.multiarray._reconstruct
        if module == "numpy" and name in ("ndarray", "dtype"):
            return getattr(np, name)
        if module == "_codecs" and name == "encode":
            return lambda text, coding: text.encode(coding)
        if module == "datetime" and name == "timedelta":
            return datetime.timedelta
        if module == "builtins" and name == "slice":
            return slice
        if module.startswith("pandas"):
            return index if name == "_new_Index" else Plain
        raise pickle.UnpicklingError(f"{module}.{name}")


def columns(file):
    with open(file, "rb") as opened:
        frame = Safe(opened, encoding="latin1").load()
    held = frame.state.get("_data", frame.state)
    _, blocks, items = held.state[:3]
    return {
        n: np.asarray(row)
        for block, item in zip(blocks, items, strict=True)
        for row, n in zip(block, item.given[0]["data"], strict=True)
    }


for out, name, sensor, rows in (
    ("warm", "01-18-17-gyro-bias2-sensor_gyro_0", "gyro_0", slice(0, 3700)),
    ("hours4", "01-18-17-gyro-bias-sensor_gyro_0", "gyro_0", slice(400, 6330)),
    ("hours5", "19_19_32-sensor_gyro_0", "gyro_0", slice(0, 19180)),
    ("accel0", "19_19_32-sensor_accel_0", "accel_0", slice(0, 19180)),
    ("accel1", "19_19_32-sensor_accel_1", "accel_1", slice(0, 19180)),
):
    table = columns(Path("raw/logs") / f"{name}.pkl")
    time = table["timestamp"] * 1e-6
    values = [table[f"t_sensor_{sensor}__f_{k}"] for k in ("x", "y", "z", "temperature")]
    kept = np.column_stack([time - time[0], *values])[rows]
    np.savetxt(f"{out}.csv", kept, fmt="%.9g", delimiter=",", header="t,x,y,z,temperature", comments="")
