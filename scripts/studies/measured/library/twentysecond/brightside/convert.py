"""A body on a corner that falls: the angle that its gyro was summed to, made a rate, beside a potentiometer."""

import numpy as np
import openpyxl

book = openpyxl.load_workbook("raw/Test/IMU_test/IMU_Test SensorFusion/IMU_filter_tests.xlsx", data_only=True)
rows = [row[6:10] for row in book["IMU_filter_tests"].iter_rows(min_row=2, values_only=True)]
table = np.array([row for row in rows if all(isinstance(x, int | float) for x in row)], float)
time, pot, summed = table[:, 0] / 1e3, table[:, 1], table[:, 3]
rate = np.append(0.0, np.diff(summed) / np.diff(time))
columns = np.column_stack([time, rate, pot])[1:]
np.savetxt("swung.csv", columns, delimiter=",", header="time,gyro,angle", comments="", fmt="%.8g")
