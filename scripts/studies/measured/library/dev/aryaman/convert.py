"""The inertial rows of a car's log while it stands: 10.7 s."""

import csv
from pathlib import Path

STANDS = 10.7  # [s]

columns = [f"{what}_{axis}" for what in ("angular_velocity", "linear_acceleration") for axis in "xyz"]
with Path("raw/analysis/data_going_in_circles.csv").open(encoding="utf-8") as file:
    rows = [row for row in csv.DictReader(file) if row["timestamp_sec_imu"]]
begin = int(float(rows[0]["timestamp_sec_imu"]))
lines = ["time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"]
times = [float(row["timestamp_sec_imu"]) - begin + float(row["timestamp_nanosec_imu"]) * 1e-9 for row in rows]
for time, row in zip(times, rows, strict=True):
    if time < times[0] + STANDS:
        lines.append(",".join((f"{time:.6f}", *(row[name] for name in columns))))
Path("rest.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
