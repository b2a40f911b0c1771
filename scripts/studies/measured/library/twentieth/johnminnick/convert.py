"""Matrices that are written into scripts of MATLAB, as tables."""

from pathlib import Path

import numpy as np

FILES = {
    "tumble": "Accel_XYZ_Sychronous_data.m",
    "gyro": "matlab/Lab3/doubledown_gyro.m",
    "gyro_bias": "matlab/Lab3/sundaydrinkinandcoding.m",
}
for name, file in FILES.items():
    text = (Path("raw") / file).read_text()
    lines = text[text.index("[") + 1 : text.index("]")].replace(";", " ").splitlines()
    table = np.array([[float(x) for x in line.split()] for line in lines if line.strip()])
    np.savetxt(f"{name}.txt", table, fmt="%.9g")
