"""MATLAB's timetables of a phone as tables: rates and accelerations at the accelerometer's times.

A timetable is an object of MATLAB, which SciPy keeps as bytes: these are a file of their own without a header, in which
each table follows the times of its rows in milliseconds. The angular rate is the one of the smallest numbers, the
acceleration the one as large as gravity. Hands are on the phone after 280 s of the rest.
"""

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab._mio5 import MatFile5Reader

NAMES = {"z_up_310": "z_up", "z_down": "z_down", "all_faces": "faces_edges", "gyro_dynamic": "dynamic"}
NAMES |= {f"{axis.upper()}_{way}": f"{axis}_{way}" for axis in "xy" for way in ("up", "down")}


def tables(file: Path) -> Iterator[np.ndarray]:
    data = loadmat(file)["__function_workspace__"].tobytes()
    reader = MatFile5Reader(BytesIO(b"MATLAB 5.0 MAT-file".ljust(116) + bytes(8) + data[:4] + data[8:]))
    reader.initialize_read()
    reader.read_file_header()
    cells = reader.read_var_array(reader.read_var_header()[0], process=False)
    while cells.size == 1:
        cells = cells.item() if isinstance(cells.item(), np.ndarray) else cells[cells.dtype.names[-1]]
    time = np.empty(0)
    for cell in cells.ravel():
        if cell.dtype.names and "data" in cell.dtype.names:
            columns = cell["data"].item().ravel()
            if len(columns) == 3 and columns[0].size:
                yield np.column_stack([time / 1e3, *(c.ravel() for c in columns)])
        elif cell.dtype == float and cell.ndim == 2 and cell.shape[1] == 1 and cell.size:
            time = cell.ravel()


for file in Path("raw").rglob("*rec*.mat"):
    name = next((new for old, new in NAMES.items() if old in file.stem), None)
    if name is None:
        continue
    found = sorted(tables(file), key=lambda t: np.median(np.linalg.norm(t[:, 1:], axis=1)))
    gyro, accel = found[0], found[1]
    gyro = gyro[np.concatenate([[True], np.diff(gyro[:, 0]) > 0])]
    rates = [np.interp(accel[:, 0], gyro[:, 0], gyro[:, k]) for k in (1, 2, 3)]
    table = np.column_stack([accel[:, 0] - accel[0, 0], *rates, accel[:, 1:]])
    head = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.7g")
    if name == "x_up":
        np.savetxt("x_up_rest.csv", table[:28000], delimiter=",", header=head, comments="", fmt="%.7g")
