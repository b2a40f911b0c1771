"""Uncalibrated rates of a phone with the calibrated ones, read off straight lines at the same times."""

import io
from zipfile import ZipFile

import numpy as np

FILES = {
    "walk": "raw/Walk/Walk_1-2024-05-29_19-30-34.zip",
    "run": "raw/Run/Run_1-2024-05-29_19-07-17.zip",
    "squat": "raw/Squatting/Squatting-2024-05-29_20-05-47.zip",
}
for name, file in FILES.items():
    with ZipFile(file) as packed:
        plain, calibrated = (
            np.genfromtxt(io.BytesIO(packed.read(f"{kind}.csv")), delimiter=",", skip_header=1)[:, 1:]
            for kind in ("GyroscopeUncalibrated", "Gyroscope")
        )
    plain = plain[(plain[:, 0] > calibrated[0, 0]) & (plain[:, 0] < calibrated[-1, 0])]
    rates = [np.interp(plain[:, 0], calibrated[:, 0], calibrated[:, k]) for k in (1, 2, 3)]
    out = np.column_stack([plain, *rates])
    np.savetxt(f"{name}.csv", out, delimiter=",", fmt="%.7f", header="time,gz,gy,gx,cz,cy,cx", comments="")
