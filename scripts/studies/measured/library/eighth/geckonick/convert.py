"""What an MPU-6050 turned from second to second beside the marks to which it was turned by hand, six runs.

The owner's tables hold the mark and the angle that the unit has summed up, a row a second. The seventh table holds no
marks.
"""

import numpy as np

RUNS = ("20221215_1744", "20221216_2352", "20221217_0013", "20221217_0038", "20221219_0218", "20221219_1615")

for k, run in enumerate(RUNS, start=1):
    table = np.loadtxt(f"raw/logs/mpu6050/gyroscope/z_expected/log_{run}.csv", delimiter=",", skiprows=1)
    mark, angle = table[1:, 0], np.diff(table[:, 1])
    np.savetxt(
        f"run{k}.csv", np.column_stack((angle, mark)), fmt="%.6f", delimiter=",", header="turned,mark", comments=""
    )
