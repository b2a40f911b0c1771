"""Raw gyros of two telephones beside the ones that they correct, and the second's beside its own orientation.

The references are brought to the gyro's times by straight lines. The angle about a body axis is the sum of its part of
the rotations between rows.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from turned import body_angles


def table(path: str, *columns: int) -> NDArray[np.float64]:
    """Seconds and columns of a file."""
    return np.loadtxt(f"raw/{path}.csv", delimiter=",", skiprows=1, usecols=(1, *columns))


def save(path: str, gyro: NDArray[np.float64], reference: NDArray[np.float64], word: str) -> None:
    """The gyro's rows within the reference's times, with the reference at them."""
    rows = gyro[(gyro[:, 0] >= reference[0, 0]) & (gyro[:, 0] <= reference[-1, 0])]
    read = [np.interp(rows[:, 0], reference[:, 0], reference[:, k]) for k in (1, 2, 3)]
    names = "time,gyro_x,gyro_y,gyro_z," + ",".join(f"{word}_{axis}" for axis in "xyz")
    np.savetxt(path, np.column_stack([rows, *read]), delimiter=",", header=names, comments="", fmt="%.15g")


for name, folder in (("iphone", "data"), ("android", "data2")):
    corrected = table(f"{folder}/Gyroscope", 4, 3, 2)
    save(f"{name}.csv", table(f"{folder}/GyroscopeUncalibrated", 4, 3, 2), corrected, "corrected")

sent = table("data2/Orientation", 4, 3, 2, 5)
attitude = Rotation.from_quat(sent[:, 1:])
angle = body_angles(attitude)
save("orientation.csv", corrected, np.column_stack([sent[:, 0], angle]), "angle")
