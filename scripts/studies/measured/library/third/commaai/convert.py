"""The camera's attitude as angles about the phone's axes, at the gyro's times: turns between frames, summed up."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation


def array(name: str) -> np.ndarray:
    (file,) = Path("raw").glob(f"Example_1/*/40/{name}")
    with file.open("rb") as opened:
        return np.load(opened)


time, gyro = array("processed_log/IMU/gyro/t"), array("processed_log/IMU/gyro/value")
frames = array("global_pose/frame_times")
turn = Rotation.from_quat(np.roll(array("global_pose/frame_orientations"), -1, axis=1))
angle = np.cumsum(np.vstack([np.zeros(3), (turn[:-1].inv() * turn[1:]).as_rotvec()]), axis=0)
there = (time >= frames[0]) & (time <= frames[-1])
angles = [np.interp(time[there], frames, a) for a in angle.T]
table = np.column_stack([time[there] - frames[0], gyro[there], *angles])
head = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("drive.csv", table, delimiter=",", header=head, comments="", fmt="%.12g")
