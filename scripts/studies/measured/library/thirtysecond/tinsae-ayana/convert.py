"""The six faces of each set in one table, in the order in which they were taken; the unit counts tenths of a ms."""

import numpy as np

FACES = ("x_down", "x_up", "y_down", "y_up", "z_down", "z_up")
for number in ("one", "two"):
    faces = [np.genfromtxt(f"raw/Calibration_Data/{face}_{number}.csv", skip_header=1) for face in FACES]
    start = min(face[0, 1] for face in faces)
    with open(f"faces_{number}.csv", "w") as file:
        file.write("time_s,face,accel_x,accel_y,accel_z\n")
        for name, face in sorted(zip(FACES, faces, strict=True), key=lambda pair: pair[1][0, 1]):
            for row in face:
                file.write(f"{(row[1] - start) / 1e4:.4f},{name},{row[2]:.6f},{row[3]:.6f},{row[4]:.6f}\n")
