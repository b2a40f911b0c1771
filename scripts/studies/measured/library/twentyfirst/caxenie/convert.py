"""A flown quadrotor's gyros beside motion capture, each on the clock of its instrument, brought to the host's.

The capture's axes: the gyro about x turns about -z, about y about x, about z about -y.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

HERE = Path("raw/analysis/quad_data_analyzer/px4-logs/tf2")
capture = np.array([[float(x) for x in line.split()[:17]] for line in (HERE / "drone.log").read_text().splitlines()])
unit = np.loadtxt(HERE / "highres_imu.log")
first = capture[0, 0]
seen = (np.polyval(np.polyfit(capture[:, 1], capture[:, 0], 1), capture[:, 1]) - first) / 1e6
time = (np.polyval(np.polyfit(unit[:, 1], unit[:, 0], 1), unit[:, 1]) - first) / 1e6
turned = body_angles(Rotation.from_quat(capture[:, 13:17]))[:, [2, 0, 1]] * [-1.0, 1.0, -1.0]
inside = (time >= seen[0]) & (time <= seen[-1])
angle = [np.interp(time[inside], seen, turned[:, k]) for k in range(3)]
table = np.column_stack([time[inside], unit[inside, 5:8], *angle])
header = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("flown.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
