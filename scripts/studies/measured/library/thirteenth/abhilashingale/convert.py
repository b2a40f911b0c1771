"""Rates of the unit beside the angles that its own attitude turned about its own axes; stamps are milliseconds."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

log = "raw/data/BAUD_500k_I2C_FREQ_400kHZ_UPDATE_FREQ_200Hz_BNO086.csv"
rows = np.genfromtxt(log, delimiter=",", skip_header=1)
rows = rows[np.isfinite(rows).all(axis=1)]
rows = rows[np.abs(rows[:, 1:5]).sum(axis=1) > 0]
table = np.column_stack(
    ((rows[:, 0] - rows[0, 0]) * 1e-3, rows[:, 8:11], body_angles(Rotation.from_quat(rows[:, 1:5])))
)
np.savetxt("turned.csv", table, fmt="%.9f", delimiter=",", header="t,gx,gy,gz,angle_x,angle_y,angle_z", comments="")
