"""A car's VN-100 while it drives in circles: its gyro about z and its own yaw, row by row as it sent them."""

import csv
from io import StringIO
from pathlib import Path

lines = ["yaw_deg,gyro_z"]
for row in csv.DictReader(StringIO(Path("raw/LAB4/src/Data/Data_Going_in_Circles/imu.csv").read_text())):
    told = row["Raw"].split("VNYMR,")[-1].split(",")
    lines.append(f"{float(told[0])},{row['imu.angular_velocity.z']}")
Path("circles.csv").write_text("\n".join(lines) + "\n")
