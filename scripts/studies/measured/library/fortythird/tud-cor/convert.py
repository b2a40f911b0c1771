"""The gyros of an AR.Drone 2 in flight beside motion capture, 73 s at 200 Hz, both with the times of the one computer.

The angles are summed up from the attitude of the motion capture (120 Hz) and taken at the times of the gyros.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

book = loadmat(Path("raw/matlab/getExpData10_29_25.mat"), squeeze_me=True, struct_as_record=False)["topicsOut"]
camera, unit = book.optitrack, book.ardroneImu
start = unit.stampTime[0]
pose = Rotation.from_quat(camera.orient.T)
turned = (pose[:-1].inv() * pose[1:]).as_rotvec(degrees=True)
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
seen = camera.stampTime - start
time = unit.stampTime - start
keep = np.concatenate(([True], np.diff(time) > 0)) & (time < seen[-1])
for axis, name in enumerate("xyz"):
    table = np.column_stack([time[keep], np.interp(time[keep], seen, angles[:, axis]), unit.vAng[axis][keep]])
    np.savetxt(f"about_{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
