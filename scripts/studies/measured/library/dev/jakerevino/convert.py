"""The rows of an hour's log that hold three numbers: six are broken."""

from pathlib import Path

rows = Path("raw/Lab3/Gyro1hr_data.csv").read_text(encoding="utf-8").split()
whole = [row for row in rows if all(row.split(","))]
Path("clean.csv").write_text("\n".join(("gyro_x,gyro_y,gyro_z", *whole)) + "\n", encoding="utf-8")
