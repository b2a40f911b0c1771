"""A stand of stepper motors: counts of each gyro at +30 and -30 deg/s, and of the accelerometers face by face."""

import csv
from pathlib import Path

gyros = list(csv.DictReader((Path("raw/data") / "imu_gyro_data.csv").open(encoding="utf-8")))
for axis in "xyz":
    with Path(f"rate_{axis}.csv").open("w", encoding="utf-8") as out:
        out.write("raw,w\n")
        for way, sign in (("p", 1), ("n", -1)):
            out.writelines(f"{r['gyro_raw']},{sign * float(r['w'])}\n" for r in gyros if r["id"] == f"g{axis}{way}")
faces = list(csv.DictReader((Path("raw/data") / "imu_accel_data.csv").open(encoding="utf-8")))
names = list(dict.fromkeys(row["id"] for row in faces))
with Path("faces.csv").open("w", encoding="utf-8") as out:
    out.write("ax,ay,az,face\n")
    out.writelines(f"{r['ax']},{r['ay']},{r['az']},{names.index(r['id']) + 1}\n" for r in faces)
