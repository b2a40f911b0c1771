"""Rate about x of a Crazyflie in flight beside the rate of the roll angle that it logs itself, 22 s at about 98 Hz."""

import json
from pathlib import Path

import numpy as np

held = json.loads(Path("raw/final_testing1_1gram.json").read_text())
roll, rate = held["ae483log.phi"], held["ae483log.w_x"]
assert roll["time"] == rate["time"]
table = np.column_stack([np.array(roll["time"]) / 1000, np.degrees(roll["data"]), rate["data"]])
table = table[(table[:, 0] > table[0, 0] + 3) & (table[:, 0] < table[0, 0] + 25)]
table[:, 0] -= table[0, 0]
np.savetxt("about_x.csv", table, delimiter=",", header="time_s,roll_deg,gyro", comments="", fmt="%.9g")
