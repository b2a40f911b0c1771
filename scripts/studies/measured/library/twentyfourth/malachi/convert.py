"""A phone that is turned: gyros without the phone's correction beside what its own attitude turned about their axes."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

HERE = Path("raw/7IMUReal/SensorLoggerData")
RUNS = {
    "yaw_roll_pitch": "YawRollPitch",
    "pitch_roll": "PitchRoll",
    "full_pitch": "FullPitch",
    "full_yaw": "FullYaw",
}
for name, folder in RUNS.items():
    gyro, seen = (
        np.genfromtxt(HERE / folder / f"{file}.csv", delimiter=",", names=True)
        for file in ("GyroscopeUncalibrated", "Orientation")
    )
    time, stamps = gyro["seconds_elapsed"], seen["seconds_elapsed"]
    turned = body_angles(Rotation.from_quat(np.column_stack([seen[part] for part in ("qx", "qy", "qz", "qw")])))
    rows = (time >= stamps[0]) & (time <= stamps[-1])
    angles = [np.interp(time[rows], stamps, turned[:, k]) for k in range(3)]
    table = np.column_stack([time[rows], *(gyro[axis][rows] for axis in "xyz"), *angles])
    header = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
