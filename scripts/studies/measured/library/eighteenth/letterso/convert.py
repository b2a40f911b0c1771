"""The rows before the walk."""

with open("raw/data/imu_data.csv", encoding="utf-8") as rows, open("standing.csv", "w", encoding="utf-8") as out:
    out.write("ax,ay,az,gx,gy,gz\n")
    out.writelines(row for _, row in zip(range(1400), rows, strict=False))
