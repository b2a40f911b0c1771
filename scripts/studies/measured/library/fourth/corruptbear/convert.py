"""Gyros of a BNO055 beside what its own fusion turned about their axes; of rows with one stamp the first is kept."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

LOG = "raw/example_data/doremi_padded_simple_130_ble_imu_data_250429_200238_unit_converted.csv"
log = np.genfromtxt(LOG, delimiter=",", names=True)
log = log[np.concatenate(([True], np.diff(log["timestamp"]) > 0.0))]
attitude = Rotation.from_quat(np.column_stack([log[f"quat_{q}"] for q in "xyzw"]))
turned = body_angles(attitude)
np.savetxt(
    "wrist.csv",
    np.column_stack((log["timestamp"], log["gyro_x"], log["gyro_z"], turned[:, 0], turned[:, 2])),
    delimiter=",",
    header="time,gyro_x,gyro_z,angle_x,angle_z",
    comments="",
    fmt="%.12g",
)
