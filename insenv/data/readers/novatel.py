"""Text logs of NovAtel receivers: RAWIMU and RAWIMUS records, long or short header; the raw counts of the triads.

    %RAWIMUSA,week,seconds;week,seconds,status,z accel,-(y accel),x accel,z gyro,-(y gyro),x gyro*checksum
    #RAWIMUA,port,sequence,...;the same

Each record holds the increments of one sampling period, z first and y with its sign reversed. Weight of a count: by
the maker's table for the instrument, in the manifest's units. Time: seconds of the week, over its end.
Source: NovAtel, OEM7 Commands and Logs Reference Manual, logs RAWIMU and RAWIMUS.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.data.readers.table import Column, Table, find_column

_RECORD = re.compile(rb"^[#%](RAWIMUS?X?A),[^;\r\n]*;([^*\r\n]*)\*?", re.MULTILINE)
NAMES = ("time", "accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z")
WEEK = 604_800.0


def read_novatel(path: Path, columns: Sequence[Column]) -> Table:
    """Raw counts of a log: columns ``time`` [s], ``gyro_x`` to ``gyro_z``, ``accel_x`` to ``accel_z``.

    Raises
    ------
    InputError
        If there is no such record, or one is not of nine numbers.
    """
    content = path.read_bytes()
    found = [(match.start(), match[1], match[2].split(b",")) for match in _RECORD.finditer(content)]
    if not found:
        raise InputError(f"{path}: has no RAWIMUSA or RAWIMUA record; wanted the text log of a NovAtel receiver")
    rows = np.empty((len(found), 7))
    for i, (start, name, cells) in enumerate(found):
        # The extended records have a byte of information and a type before the week.
        values = cells[2:] if name.endswith(b"XA") else cells
        try:
            week, seconds, _, z, y, x, wz, wy, wx = values
            rows[i] = (
                float(week) * WEEK + float(seconds),
                float(x),
                -float(y),
                float(z),
                float(wx),
                -float(wy),
                float(wz),
            )
        except ValueError:
            line = content.count(b"\n", 0, start) + 1
            wanted = "wanted week, seconds, status and six counts"
            raise InputError(
                f"{path}: line {line}: a {name.decode()} record of {len(cells)} values; {wanted}"
            ) from None
    rows[:, 0] -= WEEK * np.floor(rows[0, 0] / WEEK)
    at = {c.channel: find_column(path, NAMES, c) for c in columns}
    if labels := [c for c in columns if c.label]:
        raise InputError(f"{path}: {labels[0]} is no label; a NovAtel log has none")
    values_of: dict[str, Floats] = {channel: rows[:, i].copy() for channel, i in at.items()}
    units = {c.channel: "s" for c in columns if c.channel == "time"}
    return Table(values_of, units=units, place="record {}".format, quantity="increment")
