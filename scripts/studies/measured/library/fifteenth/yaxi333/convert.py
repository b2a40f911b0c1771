"""Rates of a phone beside the angles that its own attitude (w, x, y, z) turned about its axes; the rates at rest."""

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation
from turned import body_angles

for run in (1, 2):
    record = loadmat(f"raw/meas0519-{run}.mat", squeeze_me=True, struct_as_record=False)["meas"]
    there, seen = np.isfinite(record.gyr).all(axis=0), np.isfinite(record.orient).all(axis=0)
    angles = body_angles(Rotation.from_quat(record.orient[[1, 2, 3, 0]][:, seen].T))
    time = record.t[there]
    at = [np.interp(time, record.t[seen], angle) for angle in angles.T]
    inside = (time > record.t[seen][0]) & (time < record.t[seen][-1])
    rows = np.column_stack([time, record.gyr[:, there].T, *at])[inside]
    head = "t,gx,gy,gz,angle_x,angle_y,angle_z"
    np.savetxt(f"turned_{run}.csv", rows, fmt="%.9f", delimiter=",", header=head, comments="")
record = loadmat("raw/meas_Flat_VeryLong.mat", squeeze_me=True, struct_as_record=False)["meas"]
rows = np.vstack([record.t, record.gyr]).T
np.savetxt("flat.csv", rows, fmt="%.9f", delimiter=",", header="t,gx,gy,gz", comments="")
