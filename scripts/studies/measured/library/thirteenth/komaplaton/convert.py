"""The rows in which a sensor was read; in the others its values are NaN."""

import numpy as np
from scipy.io import loadmat

log = loadmat("raw/Sensorfusion smartphone/meas.mat", squeeze_me=True, struct_as_record=False)["meas"]
for name, values in (("gyro", log.gyr), ("accel", log.acc)):
    table = np.column_stack((log.t, values.T))
    table = table[np.isfinite(table).all(axis=1)]
    np.savetxt(f"{name}.csv", table, fmt="%.9g", delimiter=",", header="t,x,y,z", comments="")
