"""The phone's raw gyro with its accelerometer read off at the gyro's times: the two are logged apart."""

import numpy as np

for name, folder in {"warm_up": "calib_gyr_Nexus5_d3", "attitudes": "calib_acc_Nexus5_d3"}.items():
    gyro, accel = (np.loadtxt(f"raw/datasets/android/{folder}/{kind}.txt") for kind in ("gyroscope", "accelerometer"))
    gyro = gyro[(gyro[:, 0] >= accel[0, 0]) & (gyro[:, 0] <= accel[-1, 0])]
    force = [np.interp(gyro[:, 0], accel[:, 0], accel[:, k]) for k in (1, 2, 3)]
    head = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
    table = np.column_stack([gyro[:, :4], *force])
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
