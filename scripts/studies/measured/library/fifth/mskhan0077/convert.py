"""An autopilot's rate about z beside the heading that it sends; each message stands in the file many times."""

import csv

import numpy as np
from scipy.spatial.transform import Rotation

with open("raw/data/imu_1.csv", newline="") as file:
    found = {int(row["field.header.stamp"]): row for row in csv.DictReader(file)}
stamps = sorted(found)
quaternion = [[float(found[stamp][f"field.orientation.{k}"]) for k in "xyzw"] for stamp in stamps]
heading = np.unwrap(Rotation.from_quat(quaternion).as_euler("ZYX")[:, 0])
rate = [float(found[stamp]["field.angular_velocity.z"]) for stamp in stamps]
time = 1e-9 * (np.array(stamps) - stamps[0])
rows = np.column_stack([time, rate, heading])
np.savetxt("boat1.csv", rows, delimiter=",", header="time,gyro_z,heading", comments="", fmt="%.15g")
