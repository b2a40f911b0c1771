"""Gyro z of an ICM-20948 turned left and right by hand beside its own heading, which counts clockwise, 20 s at 23 Hz.

The heading is that of a filter of gyro and magnetometer; its sense is turned round here.
"""

from pathlib import Path

import numpy as np
import openpyxl

book = openpyxl.load_workbook(Path("raw/IMU_Testing_Reference_Data.xlsx"), read_only=True, data_only=True)
rows = []
for row in book["Test 5 - Metric"].iter_rows(values_only=True):
    if isinstance(row[0], (int, float)) and isinstance(row[4], (int, float)) and row[12] is not None:
        rows.append([float(row[1]), float(row[4]), float(row[12])])
held = np.array(rows)
heading = -np.degrees(np.unwrap(np.radians(held[:, 1])))
table = np.column_stack([held[:, 0], heading, held[:, 2]])
np.savetxt("turned.csv", table, delimiter=",", header="time_s,heading_deg,gyro_deg_s", comments="", fmt="%.9g")
