"""Rates beside the angles that each unit's own attitude (w, x, y, z) turned about its own axes."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for name, unit in (("walking_y", "00B4D7FE"), ("walking_z", "00B42961")):
    log = f"raw/imu_data/t2_treadmill_walking_001-000_{unit}.txt"
    rows = np.genfromtxt(log, delimiter="\t", skip_header=5)
    attitude = Rotation.from_quat(rows[:, [12, 13, 14, 11]])
    turned = body_angles(attitude)
    table = np.hstack((rows[:, 5:8], turned))
    np.savetxt(f"{name}.csv", table, fmt="%.9f", delimiter=",", header="gx,gy,gz,angle_x,angle_y,angle_z", comments="")
