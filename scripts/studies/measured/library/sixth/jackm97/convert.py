"""Two logs of one drive, each counted from its first row: the heading of the robot's pose at the gyro's rows."""

import numpy as np

gyro = np.loadtxt("raw/gyro.txt", usecols=(0, 2))
pose = np.loadtxt("raw/wean_sensors/wean/wean_wide_interesting.localpose.log", usecols=(0, 7))
time, pose_time = gyro[:, 0] - gyro[0, 0], pose[:, 0] - pose[0, 0]
yaw = np.interp(time, pose_time, np.unwrap(pose[:, 1]))
rows = np.column_stack([time, gyro[:, 1], yaw])[time <= pose_time[-1]]
np.savetxt("wean.csv", rows, delimiter=",", header="time,rate,yaw", comments="", fmt="%.15g")
