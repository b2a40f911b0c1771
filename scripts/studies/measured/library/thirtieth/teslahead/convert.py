"""The readings that a MATLAB script holds as a matrix, as a table with names."""

import re
from pathlib import Path

(script,) = Path("raw").rglob("IMU_Accelerometer_Calibration.m")
matrix = re.search(r"\nC\s*=\s*\[([^\]]*)\]", script.read_text(encoding="utf-8"))[1]
rows = [row.split() for row in matrix.replace(";", "\n").splitlines() if row.strip()]
lines = ["accel_x,accel_y,accel_z", *(",".join(row) for row in rows)]
Path("attitudes.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
