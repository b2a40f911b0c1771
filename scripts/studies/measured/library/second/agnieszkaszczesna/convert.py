"""Vicon's attitudes as the angle about the unit's own z axis: turns from row to row in its own axes, summed up."""

import numpy as np
from scipy.spatial.transform import Rotation

TRIALS = {f"tstick_{k}": f"TStick/TStick_Test04_Trial{k}" for k in (1, 2, 3)}
TRIALS["pendulum"] = "Pendulum/Pendulum_Test02a_Trial1_Segment_1"

for name, file in TRIALS.items():
    log = np.genfromtxt(f"raw/{file}.csv", delimiter=";", skip_header=2)
    turn = Rotation.from_quat(np.roll(log[:, 1:5], -1, axis=1))
    angle = np.concatenate([[0.0], np.cumsum((turn[:-1].inv() * turn[1:]).as_rotvec()[:, 2])])
    table = np.column_stack([log[:, 0], log[:, 10], angle])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time,gyro_z,angle", comments="", fmt="%.12g")
