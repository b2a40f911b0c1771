"""A robot with a navX unit: its gyro beside what the wheels say, and beside the heading of the unit's own filter.

The wheels have a radius of 35 mm and stand 230 mm apart (plot_fwd_kinematics.py), 2578.33 ticks a turn, which wrap at
65536. The heading counts clockwise; the first rows, before it was set to zero, are left out.
"""

from pathlib import Path

import numpy as np

HERE = Path("raw/recorded_sensor_data")
RADIUS, TRACK, TICKS, WRAP = 0.035, 0.230, 2578.33, 65536


def turned(ticks):
    """Turn of a wheel in rad since the first row."""
    steps = (np.diff(ticks) + WRAP / 2) % WRAP - WRAP / 2
    return np.r_[0.0, np.cumsum(steps)] * 2 * np.pi / TICKS


rows = np.genfromtxt(HERE / "turtlebot_original/interpolated_data.csv", delimiter=",", names=True)[2:]
rate = (rows["right"] - rows["left"]) * RADIUS / TRACK
table = np.column_stack([rows["time"] - rows["time"][0], rate, rows["gyroz"]])
np.savetxt("first.csv", table, delimiter=",", header="time_s,wheels_rad_s,gyro_z_dps", comments="", fmt="%.8g")

rows = np.genfromtxt(HERE / "turtlebot_12_07_18-44-00/turtlebot_data.csv", delimiter=",", names=True)
angle = (turned(rows["right_encoder_ticks"]) - turned(rows["left_encoder_ticks"])) * RADIUS / TRACK
table = np.column_stack([rows["laptop_time"] - rows["laptop_time"][0], angle, rows["gyro_z"]])
np.savetxt("drive.csv", table, delimiter=",", header="time_s,wheels_rad,gyro_z_dps", comments="", fmt="%.8g")

for trial in (4, 9):
    (file,) = (HERE / f"turtlebot_mocap_3_17/trial_{trial}").glob("rio-data-*.csv")
    rows = np.genfromtxt(file, delimiter=",", names=True)[6:]
    time = (rows["navx_time"] - rows["navx_time"][0]) / 1000
    new = np.r_[True, np.diff(time) > 0]
    table = np.column_stack([time, -rows["yaw"], rows["raw_gyro_z"], rows["temp"]])[new]
    head = "time_s,heading_deg,gyro_z_dps,temperature_degC"
    np.savetxt(f"trial_{trial}.csv", table, delimiter=",", header=head, comments="", fmt="%.8g")
