"""One reading (a mean of many) for each attitude: written four times, a second apart, with the attitude's number."""

import numpy as np

rows = np.genfromtxt("raw/mpu6050_board1_cal_data.txt", delimiter=",")
rows = np.repeat(np.column_stack((rows, np.arange(len(rows)))), 4, axis=0)
np.savetxt("attitudes.csv", rows, fmt="%.7g", delimiter=",", header="ax,ay,az,attitude", comments="")
