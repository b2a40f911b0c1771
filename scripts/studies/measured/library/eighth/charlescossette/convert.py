"""A tag's gyros and accelerometers at rest (the first minute), and its gyros in the hand beside its own quaternion.

What the quaternion turned from row to row about the tag's own axes is summed up; rows without a quaternion are left
out.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

REST, HAND = 60.0, 86.0

folder = "raw/calibrationData/2020_07_15"
lines = Path(folder, "2020_07_15_trial2_mmagent2_imu_calibration_remote.csv").read_text().splitlines()[2:]
stamps = np.array([int(line.partition(",")[0]) for line in lines])
rows = np.array([line.split(",")[1:14] for line in lines], float)
time = (stamps - stamps[0]) / 1e9
rest = np.column_stack((time, rows[:, :6]))[time < REST]
np.savetxt("rest.csv", rest, fmt=["%.9f", *["%g"] * 6], delimiter=",", header="t,ax,ay,az,gx,gy,gz", comments="")
hand = (time >= HAND) & (np.abs(np.linalg.norm(rows[:, 9:13], axis=1) - 1) < 0.01)
attitude = Rotation.from_quat(rows[hand][:, [10, 11, 12, 9]])
angles = body_angles(attitude).T
names = ("gx", "gy", "gz", "angle_x", "angle_y", "angle_z")
np.savez("hand.npz", t=time[hand], **dict(zip(names, [*rows[hand, 3:6].T, *angles], strict=True)))
