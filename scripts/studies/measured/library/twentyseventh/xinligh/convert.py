"""One-axis table at ten commanded rates: each file of numbers as a table with names, the commanded rate beside it."""

from pathlib import Path

for rate in (10, -10, 30, -30, 60, -60, 90, -90, 120, -120):
    rows = [line.split() for line in Path(f"raw/Software/{rate:+d}.dat").read_text(encoding="ascii").splitlines()]
    with Path(f"rate_{rate:+d}.csv").open("w", encoding="utf-8") as out:
        out.write("time,gyro_x,gyro_y,gyro_z,temperature,commanded\n")
        out.writelines(f"{int(row[1]) / 100:.2f},{','.join(row[2:6])},{rate}\n" for row in rows if len(row) > 5)
