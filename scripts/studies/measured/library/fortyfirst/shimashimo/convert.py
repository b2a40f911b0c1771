"""A WitMotion unit on a table: its gyros beside the rates of the angles that it tells itself.

Rows come in pairs or more for each time of the personal computer, so the time is that of the unit's rate: rows evenly
spread between the first and the last. About z the unit lies level and the yaw's rate is that about its axis.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/final_dashboard_code/matlab/Archive/WitMotion Data")
LOGS = {"ring": "2/ahrs.txt", "loops": "100 data rate/kotak.txt"}


def read(log: str) -> np.ndarray:
    rows = []
    for line in (RAW / log).read_text(encoding="latin-1").splitlines():
        words = line.split()
        if len(words) >= 15 and words[0].startswith("0x"):
            hours, minutes, seconds = (float(x) for x in words[1].split(":"))
            rows.append([hours * 3600 + minutes * 60 + seconds, *(float(x) for x in words[2:12])])
    return np.array(rows)


for name, log in LOGS.items():
    held = read(log)
    time = np.linspace(0, held[-1, 0] - held[0, 0], len(held))
    yaw = np.degrees(np.unwrap(np.radians(held[:, 9])))
    table = np.column_stack([time, yaw, held[:, 6]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,yaw_deg,gyro_z", comments="", fmt="%.9g")
