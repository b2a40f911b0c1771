"""A hand-held unit's gyros beside the angles about its axes by motion capture, at the unit's times.

The owner's calibration turns the gyros into the axes of the cameras' body and tells how far the clocks are apart, of
which the hundredth of a second is taken.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

RAW = "raw/resource/estimator_test_data"
INTO_BODY = Rotation.from_quat([0.579779597, -0.415983546, 0.445214733, -0.540922499])
APART = 1034771.51

unit, seen = np.loadtxt(f"{RAW}/imu_data.txt", delimiter=","), np.loadtxt(f"{RAW}/mocap_data.txt")
attitude = Rotation.from_quat(seen[:, 4:8])
angle = body_angles(attitude)
time = unit[:, 0] * 1e-9 - APART
inside = (time >= seen[0, 0]) & (time <= seen[-1, 0])
rates = INTO_BODY.apply(unit[inside, 1:4])
angles = [np.interp(time[inside], seen[:, 0], angle[:, k]) for k in range(3)]
np.savez("hand.npz", t=time[inside] - time[inside][0], rate=rates, angle=np.column_stack(angles))
