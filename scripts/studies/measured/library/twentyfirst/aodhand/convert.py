"""Two gyros of a cube that swings on its edge, beside a potentiometer on the edge: counts of hundredths of a second.

The potentiometer's counts are turned into angles as the owners do it; its sign is that of the gyros.
"""

from pathlib import Path

import numpy as np

HERE = Path("raw/figures/original/Matlab")
rows = np.loadtxt(HERE / "DataFilter/compFilterData1.csv", delimiter=",")
table = np.column_stack([rows[:, 0] * 0.01, rows[:, 5], rows[:, 1]])
np.savetxt("filter.csv", table, delimiter=",", header="time,gyro,angle", comments="", fmt="%.9g")
for run in (1, 2, 3):
    rows = np.loadtxt(HERE / f"IMUtest/sensorstestwSimon{run}.csv", delimiter=",")
    angle = (rows[:, 1] - 640.5645) * 1.5769 / (1411.3 - 2.3893)
    table = np.column_stack([rows[:, 0] * 0.01, rows[:, 6:8], angle])
    np.savetxt(f"swing{run}.csv", table, delimiter=",", header="time,gyro_1,gyro_2,angle", comments="", fmt="%.9g")
