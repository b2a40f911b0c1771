"""Two Xsens units on a board, tables of MATLAB: gyros of B at its own times, those of A brought to them.

A table is an object whose columns stand in the file's workspace of functions, which SciPy reads with its private
reader alone. Times are the units' UTC. A is turned by 45 degrees against B about z in the second run.
"""

from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.io.matlab._mio5 import MatFile5Reader

#: Where the table's columns and their names stand among the cells of the object.
COLUMNS, NAMES = 2, 7


def table(path: str) -> dict[str, NDArray[np.float64]]:
    """Columns by their names."""
    space = loadmat(path)["__function_workspace__"].tobytes()
    reader = MatFile5Reader(BytesIO(b" " * 124 + space[:4] + space[8:]))
    reader.initialize_read()
    reader.mat_stream.seek(128)
    header, _ = reader.read_var_header()
    cells = reader.read_var_array(header, process=False)["MCOS"][0, 0][0]["arr"].ravel()
    pairs = zip(cells[NAMES].ravel(), cells[COLUMNS].ravel(), strict=True)
    return {str(name.item()): column.ravel().astype(float) for name, column in pairs}


def time(unit: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Seconds of the day."""
    whole = 3600.0 * unit["UTC_Hour"] + 60.0 * unit["UTC_Minute"] + unit["UTC_Second"]
    return np.asarray(whole + 1e-9 * unit["UTC_Nano"])


for run in ("30_1", "45_2", "90_2"):
    a, b = (table(f"raw/logs/{unit}_{run}.mat") for unit in "ab")
    known, at = time(a), time(b)
    inside = (at >= known[0]) & (at <= known[-1])
    at = at[inside]
    x, y, z = (np.interp(at, known, a[f"Gyr_{axis}"]) for axis in "XYZ")
    gyro = [b[f"Gyr_{axis}"][inside] for axis in "XZ"]
    rows = np.column_stack([at - at[0], *gyro, np.sqrt(0.5) * (x + y), z])
    names = "time,gyro_x,gyro_z,other_x,other_z"
    np.savetxt(f"board{run}.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
