"""Rate about z of a wheeled robot beside the yaw of its own attitude, by the host's stamps, a file for each run."""

import numpy as np

for run, day in enumerate(("20260715", "20260720"), 1):
    folder = "raw/data/raw/run1/log_" + day
    gyro = np.genfromtxt(folder + "_imu_data.csv.csv", delimiter=",", skip_header=1)
    attitude = np.genfromtxt(folder + "_attitude_data.csv.csv", delimiter=",", skip_header=1)
    yaw = np.unwrap(np.radians(attitude[:, 1]))
    inside = (gyro[:, 0] > attitude[0, 0]) & (gyro[:, 0] < attitude[-1, 0])
    time = gyro[inside, 0]
    rows = np.column_stack([time - time[0], gyro[inside, 6], np.interp(time, attitude[:, 0], yaw)])
    np.savetxt(f"run{run}.csv", rows, fmt="%.9f", delimiter=",", header="t,gz,yaw", comments="")
