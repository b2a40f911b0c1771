"""Lines that a serial monitor stamped: gyro about the bearing [deg/s] and yaw [deg], the last two numbers of a line."""

import re
from pathlib import Path

import numpy as np

FILES = {"long": "20210720_184456", "held": "20210720_191643"}
ROW = re.compile(r"(\d+):(\d+):([\d.]+) (-?[\d.]+(?:;-?[\d.]+)+)$")
for name, stem in FILES.items():
    lines = next(Path("raw").rglob(f"serial_{stem}.txt")).read_text(encoding="utf-8", errors="replace").splitlines()
    found = [match for match in map(ROW.match, map(str.strip, lines)) if match]
    stamps = np.array([3600.0 * int(m[1]) + 60.0 * int(m[2]) + float(m[3]) for m in found])
    numbers = np.array([[float(cell) for cell in m[4].split(";")[-2:]] for m in found])
    later = np.concatenate(([True], np.diff(stamps) > 0.0))
    table = np.column_stack([stamps - stamps[0], numbers])[later]
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time,gyro_z,yaw", comments="", fmt="%.9g")
