"""Optical attitude as angles about the unit's own axes: rotations from row to row in the axes of the body, summed up.

The optical frame is the unit's within a few degrees. Rows without optical attitude stay empty; the angle goes on after
them by the rotation across the gap. Of the trial with a phone: what is before the unit is moved (45.7 s).
"""

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

for name, file in {
    "slow04": "04_undisturbed_slow_rotation_with_breaks_A",
    "slow05": "05_undisturbed_slow_rotation_with_breaks_B",
}.items():
    trial = loadmat(f"raw/data_mat/{file}.mat")
    quaternion = trial["opt_quat"]
    seen = np.flatnonzero(np.isfinite(quaternion).all(axis=1))
    turn = Rotation.from_quat(np.roll(quaternion[seen], -1, axis=1))
    angle = np.full((len(quaternion), 3), np.nan)
    angle[seen] = np.cumsum(np.vstack([np.zeros(3), (turn[:-1].inv() * turn[1:]).as_rotvec()]), axis=0)
    time = np.arange(len(quaternion)) / trial["sampling_rate"].item()
    np.savez_compressed(f"{name}.npz", time=time, gyro=trial["imu_gyr"], angle=angle)

trial = loadmat("raw/data_mat/27_disturbed_phone_vibration_B.mat")
still = slice(0, int(44.9 * trial["sampling_rate"].item()))
time = np.arange(still.stop) / trial["sampling_rate"].item()
np.savez_compressed("phone.npz", time=time, gyro=trial["imu_gyr"][still], accel=trial["imu_acc"][still])
