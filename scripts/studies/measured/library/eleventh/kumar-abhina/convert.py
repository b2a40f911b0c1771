"""The unit at rest out of a bag (quaternion, rates, accelerations without covariances), and moved by hand.

By hand: rates beside the angles that its own attitude ($VNYMR: yaw, pitch, roll) turned about its own axes.
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import messages
from scipy.spatial.transform import Rotation
from turned import body_angles
from vectornav import of_a_table, save

rest = np.array(
    [(stamp, *struct.unpack_from("<10d", body)) for stamp, body in messages("raw/LAB3/Data/Abhinav.bag", "/imu")]
)
save("rest.csv", "t,gx,gy,gz,ax,ay,az", rest[:, [0, 5, 6, 7, 8, 9, 10]], digits=9)
rows = np.array(of_a_table(Path("raw/LAB3/Data/imu_mov-imu.csv")))
angles = body_angles(Rotation.from_euler("ZYX", rows[:, 1:4], degrees=True))
table = np.column_stack((rows[:, 0] - rows[0, 0], rows[:, 10:13], angles))
np.savetxt("hand.csv", table, fmt="%.9f", delimiter=",", header="t,gx,gy,gz,angle_x,angle_y,angle_z", comments="")
