"""Messages of `/imu` (imu_driver/Vectornav) of a ROS bag as a table: insenv reads no bags.

Time stamps of the headers, rates [rad/s], accelerations [m/s^2].
"""

import struct

import numpy as np
from ros_bag import messages

BAG = "raw/LAB3/src/Data/nitin.bag"
OUT = "nitin.csv"


#: Behind the header of a message: a quaternion, then vectors of three, rates and accelerations.
rows = np.array([(stamp, *struct.unpack_from("<10d", body)[4:]) for stamp, body in messages(BAG, "/imu")])
rows[:, 0] -= rows[0, 0]
names = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt(OUT, rows, delimiter=",", header=names, comments="", fmt="%.9g")
