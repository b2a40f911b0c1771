"""Rates beside the angles that the phone's own attitude turned about its own axes; both files have the same rows."""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles


def columns(name, wanted):
    with (Path("raw/data/RocknRollerCoaster-2024-09-25_02-30-18") / name).open(encoding="utf-8") as lines:
        return np.array([[float(row[k]) for k in wanted] for row in csv.DictReader(lines)])


rates = columns("Gyroscope.csv", ("seconds_elapsed", "x", "y", "z"))
attitude = Rotation.from_quat(columns("Orientation.csv", ("qx", "qy", "qz", "qw")))
turned = body_angles(attitude)
names = "t,gx,gy,gz,angle_x,angle_y,angle_z"
np.savetxt("coaster.csv", np.hstack((rates, turned)), fmt="%.9f", delimiter=",", header=names, comments="")
