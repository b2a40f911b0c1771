"""Rates of a phone beside the angles that its own attitude turned about its axes, by the sensors' stamps."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

kinds = {"GYRO": [], "AHRS": []}
with open("raw/logfile_2020_03_19_09_31_56.txt", encoding="utf-8", errors="replace") as lines:
    for line in lines:
        word, *numbers = line.strip().split(";")
        if word in kinds:
            kinds[word].append([float(number) for number in numbers])
gyro, attitude = np.array(kinds["GYRO"]), np.array(kinds["AHRS"])
_, first = np.unique(attitude[:, 1], return_index=True)
attitude = attitude[first]
vector = attitude[:, 5:8]
scalar = np.sqrt(np.maximum(1.0 - (vector**2).sum(axis=1), 0.0))
angles = body_angles(Rotation.from_quat(np.column_stack([vector, scalar])))
_, first = np.unique(gyro[:, 1], return_index=True)
gyro = gyro[first]
inside = (gyro[:, 1] > attitude[0, 1]) & (gyro[:, 1] < attitude[-1, 1])
at = [np.interp(gyro[inside, 1], attitude[:, 1], angle) for angle in angles.T]
rows = np.column_stack([gyro[inside, 1] - attitude[0, 1], gyro[inside, 2:5], *at])
np.savetxt("turned.csv", rows, fmt="%.9f", delimiter=",", header="t,gx,gy,gz,angle_x,angle_y,angle_z", comments="")
