"""Rates about x and y of a Crazyflie in flight beside its own roll and pitch, 36 s at 100 Hz.

Angles and rates are logged in blocks of their own: the rates are read at the times of the angles.
"""

import json
from pathlib import Path

import numpy as np

held = json.loads(Path("raw/analysis/results/custom_flight.json").read_text())
for name, angle, rate in (("about_x", "phi", "w_x"), ("about_y", "theta", "w_y")):
    a, w = held[f"ae483log.{angle}"], held[f"ae483log.{rate}"]
    time = np.array(a["time"]) / 1000.0
    gyro = np.interp(time, np.array(w["time"]) / 1000.0, w["data"])
    table = np.column_stack([time - time[0], np.degrees(a["data"]), gyro])
    table = table[table[:, 0] < 35.8]  # it falls then
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
