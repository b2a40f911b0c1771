"""An ankle's rate, as the gyros on both sides of the joint read it, beside the joint's encoder.

The z axes of shank and foot point along the joint: their difference is its rate.
"""

import csv

import numpy as np

with open("raw/preprocessed_data/df_clean_test_12feature_cross_subject.csv", encoding="utf-8") as lines:
    rows = list(csv.DictReader(lines))
columns = ("Time", "MPU1_Gyro_Z", "MPU2_Gyro_Z", "angle")
time, shank, foot, angle = (np.array([float(row[name]) for row in rows]) for name in columns)
np.savetxt(
    "ankle.csv",
    np.column_stack((time, shank - foot, angle)),
    fmt=("%.0f", "%.2f", "%.2f"),
    delimiter=",",
    header="time,rate,angle",
    comments="",
)
