"""Rates beside the angles that the reference turned about its own axes, a file for each run; the simulated pair."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for number, folder in ((1, "Collected_Data"), (2, "Collected_Data_2")):
    for run in (1, 2, 3):
        angles = [np.load(f"raw/{folder}/{name}List_{run}.npy") for name in ("yaw", "pitch", "roll")]
        attitude = Rotation.from_euler("ZYX", np.column_stack(angles), degrees=True)
        table = np.hstack((np.load(f"raw/{folder}/G_List_{run}.npy"), body_angles(attitude)))
        table[:, 5] *= -1.0  # the unit's z points the other way
        names = "gx,gy,gz,angle_x,angle_y,angle_z"
        np.savetxt(f"set{number}_{run}.csv", table, fmt="%.9f", delimiter=",", header=names, comments="")
table = np.hstack((np.load("raw/imu_sim_data/gyr_rads.npy"), np.load("raw/imu_sim_data/truth_deg.npy")))
np.savetxt("simulated.csv", table, fmt="%.9f", delimiter=",", header="gx,gy,gz,roll,pitch,yaw", comments="")
