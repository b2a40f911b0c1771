"""The points of a rate table from the owner's database: a row is a commanded rate, beside a gyro's mean over 10 s.

A run holds eleven rates from the least to the greatest, thirteen seconds apart. The readings are volts; runs or
points in which a gyro or its converter stands at its rail are left out. Volts are turned by nominal scale and zero.
And ten seconds at 1 kHz in which the table is sent from rest to 50 deg/s: two gyros beside a third.
"""

import pickle
import sqlite3
from pathlib import Path

import numpy as np

#: File, name and number of the sensor in the database, greatest rates of its runs, nominal volts per deg/s and at zero,
#: and the rail [V]
SENSORS = (
    ("vg910_1", "VG910", "1", (50, 100, 200), -0.057, 0.0, 10.7),
    ("vg910_2", "VG910", "2", (50, 100, 200), 0.0243, 0.0, 10.7),
    ("crh02", "CRH02", "0", (100, 200), -0.01, 0.0, 2.38),
    ("crs03", "CRS03", "0", (100, 200), -0.02, 2.5, 2.35),
    ("tg19a", "TG19A", "0", (50, 100), 0.0344, 0.0, 3.2),
)
SECONDS = 13.0
with sqlite3.connect("raw/database/database.db") as base:
    for file, name, number, runs, scale, zero, rail in SENSORS:
        for greatest in runs:
            (blob,) = base.execute(
                "select data from static_results where name=? and sensor_id=? and rate_max=?", (name, number, greatest)
            ).fetchone()
            points = np.array([[float(value) for value in point[:2]] for point in pickle.loads(blob)])
            rows = [
                (k * SECONDS, rate, (volts - zero) / scale)
                for k, (rate, volts) in enumerate(points)
                if abs(volts - zero) < rail
            ]
            head = "time_s,rate_dps,gyro_dps"
            np.savetxt(Path(f"{file}_{greatest}.csv"), rows, delimiter=",", header=head, comments="", fmt="%.8g")

    step = []
    for name, number, scale in (("TG19A", "0", 0.0344), ("TG100", "2", -0.0048), ("VG910", "2", 0.0243)):
        (blob,) = base.execute(
            "select data from bandwidth_result where name=? and sensor_id=?", (name, number)
        ).fetchone()
        step.append(np.array(pickle.loads(blob)) / scale)
    head = "tg19a_dps,tg100_2_dps,vg910_2_dps"
    np.savetxt("step.csv", np.column_stack(step), delimiter=",", header=head, comments="", fmt="%.8g")
