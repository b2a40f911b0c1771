"""Units on a person who stands and bends on force plates: the turn of each in its own quaternions, at its gyro's rows.

The rate is over two rows, from the one before to the one after.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_rates

rows = np.genfromtxt("raw/tests/files/full_dataset_RAW.csv", delimiter=",", names=True)
time = (rows["timestamp"] - rows["timestamp"][0]) / 1000


for unit, name in (("Thigh_Right", "thigh"), ("UpperTrunk_Right", "trunk")):
    attitude = Rotation.from_quat(np.column_stack([rows[f"IMU_{unit}_q{k}"] for k in "xyzw"]))
    gyro = np.column_stack([rows[f"IMU_{unit}_w{k}"] for k in "xyz"])[1:-1]
    head = "time_s,turn_x,turn_y,turn_z,gyro_x,gyro_y,gyro_z"
    table = np.column_stack([time[1:-1], body_rates(attitude, time), gyro])
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
