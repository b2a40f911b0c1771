"""Rates of an Xsens MTw on a person beside the angles that its own orientation turns through, 100 rows a second.

The angle about a body axis is the sum of its part of the rotations between rows. Columns of the matrix follow each
other in the file.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

FILE = "raw/OpenSim/Tests/shared/IMUData/Xsens/MT_012005D6_031-000_00B421AF.txt"

with open(FILE) as file:
    cells = [line.rstrip("\n").split("\t") for line in file]
rows = [cell for cell in cells if cell[0].isdigit()]
gyro = np.array([[float(c) for c in row[17:20]] for row in rows])
matrix = np.array([[float(c) for c in row[23:32]] for row in rows]).reshape(-1, 3, 3).transpose(0, 2, 1)
attitude = Rotation.from_matrix(matrix)
angle = body_angles(attitude)
names = "gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("xsens.csv", np.column_stack([gyro, angle]), delimiter=",", header=names, comments="", fmt="%.15g")
