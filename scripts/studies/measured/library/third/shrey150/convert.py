"""Accelerations of the rows that are whole: as they were logged, and with counts above 32767 made negative.

One row in ten has nine counts, of accelerometer, gyro and magnetometer; the others lack the last three.
"""

from pathlib import Path

import numpy as np

lines = Path("raw/data/calibration.csv").read_text(encoding="utf-8").split()
rows = [line.rstrip(",").split(",") for line in lines]
counts = np.array([row[:3] for row in rows if len(row) == 9], dtype=float)
signed = (counts + 32768) % 65536 - 32768
for name, table in {"counts": signed, "counts_unsigned": counts}.items():
    np.savetxt(f"{name}.csv", table, delimiter=",", header="x,y,z", comments="", fmt="%d")
