"""Gyros on an indexed turntable in the open: means of 200 samples at rest, at an azimuth and half a turn from it.

No times are given: a position takes about 7 s. Azimuths are summed as the motor turned them.
"""

import csv
from pathlib import Path

import numpy as np

HEADER = "azimuth_deg,gyro_x_dps,gyro_y_dps,temperature_C,accel_x_g,accel_y_g"
for file in sorted(Path("raw").glob("Project_Jaroslav/*/T1*/*/*_data.csv")):
    with file.open(encoding="utf-8") as opened:
        cycles = [row for row in csv.reader(opened, delimiter=";")][1:]
    rows = []
    for cycle in cycles:
        turned = float(cycle[3])
        first, second = ([float(x) for x in cycle[k : k + 5]] for k in (6, 11))
        rows += [[turned, *first], [turned + 180.0, *second]]
    np.savetxt(f"{file.parent.name}.csv", rows, delimiter=",", header=HEADER, comments="", fmt="%.9g")
