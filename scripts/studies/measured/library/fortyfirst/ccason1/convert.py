"""Two rests of a balloon's payload before its launch, in the cold and in the sun, ten rows a second in bursts.

The clock tells whole seconds; the rows of a second are set evenly into it. Rows without a place (22 fields).
"""

from pathlib import Path

import numpy as np

DAY = "2022-01-28 "
rows = []
with Path("raw/data/1-28-2022_telemetry_log.csv").open(encoding="utf-8", errors="replace") as lines:
    for line in lines:
        row = line.strip().split(",")
        if line.startswith(DAY) and len(row) == 22 and "n/a" not in row:
            clock = [int(x) for x in row[0][len(DAY) :].split(":")]
            rows.append([clock[0] * 3600 + clock[1] * 60 + clock[2], float(row[2])] + [float(x) for x in row[7:13]])
held = np.array(rows)
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,temp"
for name, first, last in (("cold", 24420, 24900), ("sun", 27910, 29070)):
    part = held[(held[:, 0] > first) & (held[:, 0] < last)]
    seconds, start, many = np.unique(part[:, 0], return_index=True, return_counts=True)
    inside = np.concatenate([np.arange(n) / n for n in many])
    table = np.column_stack([part[:, 0] - first + inside, part[:, 2:], part[:, 1]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
