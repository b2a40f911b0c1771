"""Two sheets of a workbook as one table: the yaw rate of the IMU (30 rows a second) and that of the wheels (50).

insenv reads the first sheet of a workbook only; the rows are counted from 0 in either.
"""

import re
import zipfile
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

SPACE = {"m": "http://schemas.openxmlformats.org/spreadsheetml/2006/main"}


def sheet(number: int, column: str) -> NDArray[np.float64]:
    """Numbers of a column below its heading, down to the first empty cell."""
    with zipfile.ZipFile("raw/data/Random.xlsx") as book:
        root = ElementTree.fromstring(book.read(f"xl/worksheets/sheet{number}.xml"))
    cells = {c.get("r", ""): c.findtext("m:v", "", SPACE) for c in root.iterfind(".//m:c", SPACE)}
    rows = {int(re.sub("[A-Z]", "", r)): v for r, v in cells.items() if re.sub("[0-9]", "", r) == column}
    last = next(k for k in range(2, max(rows) + 2) if not rows.get(k))
    return np.array([float(rows[k]) for k in range(2, last)])


imu, wheel = sheet(2, "F"), sheet(3, "F")
time, known = np.arange(imu.size) / 30.0, np.arange(wheel.size) / 50.0
table = np.column_stack([time, imu, np.interp(time, known, wheel)])[time <= known[-1]]
np.savetxt("random.csv", table, delimiter=",", header="time,imu,wheel", comments="", fmt="%.15g")
