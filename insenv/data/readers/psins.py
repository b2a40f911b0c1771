"""Log of the PSINS toolbox (``.imu``): comments, three header lines of six numbers, then rows of increments.

    1  pitch roll yaw [deg]  vE vN vU [m/s]                        (not used: its author calls it inaccurate)
    2  latitude longitude [deg]  height [m]  t0 [s]  interval [ms]  g [m/s^2]
    3  gyro scale factors [arcsec]  accelerometer scale factors [ug s]

``g`` is what this file's ``ug`` is a millionth of; it is not the local gravity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Site
from insenv.data.manifest.spec import PSINS_CHANNELS
from insenv.data.readers import text
from insenv.data.readers.rows import Body, read_rows
from insenv.data.readers.table import Column, Table, find_column

_COMMENT = "%"


def read_psins(path: Path, columns: Sequence[Column]) -> Table:
    """Raw increments with the units that the header states, time and site.

    Raises
    ------
    InputError
        If the header is not as above, or a row is not of six numbers.
    """
    lines = text.decoded(path, path.read_bytes()).split("\n")
    first, header = _header(path, lines)
    _, (latitude, _, height, start, interval, g), scales = header
    if not (interval > 0 and g > 0 and abs(latitude) <= 90):
        raise InputError(
            f"{path}: the header says {interval} ms, latitude {latitude} deg and g {g} m/s^2; "
            "wanted an interval and a g above zero and a latitude from -90 to 90"
        )
    body = Body(path, "\n".join(lines[first:]).encode(), first + 1, None, list(PSINS_CHANNELS))
    table = read_rows(body, columns)
    units = [f"{s!r} arcsec" for s in scales[:3]] + [f"{s * g * 1e-6!r} m/s" for s in scales[3:]]
    t: Floats = start + np.arange(1.0, len(table) + 1) * (interval * 1e-3)  # an increment ends at its row's time
    return Table(
        values=table.values,
        labels=table.labels,
        units={c.channel: units[find_column(path, PSINS_CHANNELS, c)] for c in columns},
        place=table.place,
        quantity="increment",
        t=t,
        site=Site(latitude=math.radians(latitude), altitude=height),
    )


def _header(path: Path, lines: list[str]) -> tuple[int, list[list[float]]]:
    """Index of the first line after the header, and the header's three rows of six numbers."""
    header: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.lstrip().startswith(_COMMENT):
            continue
        try:
            header.append([float(cell) for cell in line.split()])
        except ValueError:
            header.append([])
        if len(header[-1]) != 6 or not all(map(math.isfinite, header[-1])):
            raise InputError(
                f"{path}: line {number}: header line {len(header)} of 3 of a PSINS log; wanted six numbers"
            )
        if len(header) == 3:
            return number, header
    raise InputError(f"{path}: has {len(header)} of the 3 header lines of a PSINS log; wanted them before the rows")
