"""A unit moved by hand, as its maker's tool writes it: decimal commas, times of the chip; what it has turned."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for file, name in (("data_20240921_001.txt", "first"), ("data_20240921_002.txt", "second")):
    rows = []
    for line in (Path("raw") / file).read_text(encoding="utf-8-sig", errors="replace").splitlines()[1:]:
        cells = line.replace(",", ".").split("\t")
        hours, minutes, seconds = (float(x) for x in cells[2].split()[1].split(":"))
        rows.append([3600 * hours + 60 * minutes + seconds, *(float(x) for x in cells[3:12])])
    table = np.array(rows)
    table[:, 0] -= table[0, 0]
    attitude = Rotation.from_euler("ZYX", table[:, [9, 8, 7]], degrees=True)
    table = np.column_stack([table[:, :7], body_angles(attitude)])
    header = "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
