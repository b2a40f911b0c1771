"""A nine-axis unit turned by hand: its gyro beside the rate that its own angles tell, the first 3.4 s.

Angles are turns about z, y and x in this order; the rate is that of the turn from the row before to the row after.
Stamps of whole milliseconds come in pairs: the even clock between first and last is taken.
"""

from pathlib import Path

import numpy as np

lines = Path("raw/imu_data.txt").read_text(encoding="utf-8-sig").splitlines()
rows = [line.split("\t") for line in lines if line.startswith("0x50")]
values = np.array([row[2:11] for row in rows], float)
clock = np.array([row[1].strip().split(":") for row in rows], float) @ [3600, 60, 1]  # s
time = np.linspace(0, clock[-1] - clock[0], len(rows))
x, y, z = np.radians(values[:, 6:9]).T
cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
turn = np.array(
    [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
).transpose(2, 0, 1)
step = np.einsum("nji,njk->nik", turn[:-2], turn[2:])
axis = (
    np.column_stack([step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]]) / 2
)
angle = np.arccos(np.clip((np.trace(step, axis1=1, axis2=2) - 1) / 2, -1, 1))
rate = np.degrees(axis * np.where(angle > 1e-6, angle / np.sin(np.maximum(angle, 1e-9)), 1)[:, None])
rate /= (time[2:] - time[:-2])[:, None]
table = np.column_stack([time[1:-1], rate, values[1:-1, 3:6]])[:341]
head = "time_s,rate_x,rate_y,rate_z,gyro_x,gyro_y,gyro_z"
np.savetxt("hand.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
