"""A wheel in the log of an FRC robot's characterization, for the converters of the measured library.

A row of a phase holds time [s], battery and voltages, then distance [m] of the left and of the right wheel in columns
5 and 6 and their speeds [m/s] in columns 7 and 8; `unitsPerRotation` is the length of a wheel's turn [m].
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

DISTANCE = {"left": 5, "right": 6}


def write_wheel(log: str, phase: str, side: str, to: str) -> None:
    """Write time [s], angle [rad] and rate [rad/s] of one wheel in one phase as a table."""
    found = json.loads(Path(log).read_text(encoding="utf-8"))
    rows = np.array(found[phase], dtype=float)
    column = DISTANCE[side]
    wheel = rows[:, [column, column + 2]] * 2 * np.pi / float(found["unitsPerRotation"])
    table = np.column_stack([rows[:, 0], wheel])
    np.savetxt(to, table, delimiter=",", header="time_s,angle,rate", comments="", fmt="%.9g")
