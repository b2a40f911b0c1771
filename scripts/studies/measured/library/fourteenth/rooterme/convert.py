"""The log's stamps (day_hhmmss and microseconds) as seconds; a reading that came again is left out."""

import numpy as np

with open("raw/allrange.txt", encoding="utf-8") as file:
    rows = [line.split() for line in file if len(line.split()) == 13]
stamp = [row[0].split("_")[1] for row in rows]
time = [int(s[:2]) * 3600 + int(s[2:4]) * 60 + int(s[4:6]) + int(s[6:]) / 1e6 for s in stamp]
out = np.column_stack([np.array(time) - time[0], np.array([row[1:10] for row in rows], dtype=float)])
out = out[np.r_[True, np.diff(out[:, 0]) > 0]]
np.savetxt("log.csv", out, delimiter=",", fmt="%.6f", header="time,roll,pitch,yaw,gx,gy,gz,ax,ay,az", comments="")
