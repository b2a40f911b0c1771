"""Two parts of the log by the time since switch-on: from a minute to half an hour, and the cold end."""

import numpy as np

PARTS = {"freezer": (60, 1800), "cold": (540, 1800)}

log = np.genfromtxt("raw/temperature_offset_calibration/temp-calibration.csv", delimiter=",", skip_header=1)
log[:, 0] /= 1e3
head = "time,gx,gy,gz,ax,ay,az,temperature"
for name, (start, end) in PARTS.items():
    part = log[(log[:, 0] >= start) & (log[:, 0] < end)][:, [0, *range(5, 12)]]
    np.savetxt(f"{name}.csv", part, delimiter=",", header=head, comments="", fmt="%.8g")
