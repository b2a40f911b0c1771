"""A phone's calibrated rates beside its uncalibrated ones at the same times."""

import numpy as np

for name in ("Standing", "Squats"):
    gyro = np.genfromtxt(f"raw/{name}/Gyroscope.csv", delimiter=",", skip_header=1)
    other = np.genfromtxt(f"raw/uncalibrated{name}/GyroscopeUncalibrated.csv", delimiter=",", skip_header=1)
    time, ref = (gyro[:, 0] - gyro[0, 0]) * 1e-9, (other[:, 0] - gyro[0, 0]) * 1e-9
    inside = (time > ref[0]) & (time < ref[-1])
    at = [np.interp(time[inside], ref, other[:, k]) for k in (4, 3, 2)]
    rows = np.column_stack([time[inside], gyro[inside][:, [4, 3, 2]], *at])
    np.savetxt(f"{name.lower()}.csv", rows, fmt="%.9f", delimiter=",", header="t,gx,gy,gz,rx,ry,rz", comments="")
