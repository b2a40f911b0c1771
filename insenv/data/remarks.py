"""Sanity of recordings: at rest ``|mean f|`` is gravity and ``|mean w|`` is the Earth's rate and a bias.

A remark is no error: the data may be right and the unit in the manifest wrong, or the other way round;
whoever reads a report must know.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import EARTH_RATE
from insenv.core.recording import GAP, Floats, Recording
from insenv.core.units import STANDARD_GRAVITY

#: Share by which the mean specific force at rest may differ from gravity: bias of a cheap triad.
_FORCE_SHARE = 0.05
#: Mean rate at rest in units of the Earth's: 1e4 is 42 deg/s, above a cheap gyro's bias; 1e-2 is 0.15 deg/h.
_RATE_RANGE = (1e-2, 1e4)
#: Scatter of a specific force that counts as rest [m/s^2].
_REST_SCATTER = 1.0
#: Scatter of the steps, as a share of the period, that is worth a remark.
_JITTER = 0.05
_Rows = NDArray[np.bool_] | slice
_DIRECTIONS = {"R": (0, 1), "L": (0, -1), "F": (1, 1), "B": (1, -1), "U": (2, 1), "D": (2, -1)}


def remarks(recordings: Sequence[Recording], used: Sequence[NDArray[np.bool_]] = ()) -> tuple[str, ...]:
    """Sentences about what looks odd: gaps, jitter, and means at rest that suggest a wrong unit or sign.

    Of the rows that are ``used``, shape (rows,) of each recording, the means are; without, of all.
    """
    found = []
    chosen: Sequence[_Rows] = used or [slice(None)] * len(recordings)
    for recording, rows in zip(recordings, chosen, strict=True):
        found += [f"{recording.label}: {text}" for text in recording.notes]
        checks = (_gaps(recording), _jitter(recording), _force(recording, rows), _rate(recording, rows))
        found += [f"{recording.label}: {text}" for text in checks if text]
    return tuple(found)


def _gaps(recording: Recording) -> str:
    steps = np.diff(recording.t)
    gaps = steps[steps > GAP * recording.dt]
    if not len(gaps):
        return ""
    lost = float(np.sum(gaps - recording.dt))
    noun = "gap" if len(gaps) == 1 else "gaps"
    return f"{len(gaps)} {noun} in time, {lost:.6g} s in all, longest {gaps.max() - recording.dt:.6g} s"


def _jitter(recording: Recording) -> str:
    if recording.notes:
        return ""  # said by what read it
    steps = np.diff(recording.t)
    spread = float(np.std(steps[steps <= GAP * recording.dt])) / recording.dt
    return f"time stamps jitter by {100 * spread:.1f} % of the period (one sigma)" if spread > _JITTER else ""


def _triad(recording: Recording, prefix: str, rows: _Rows) -> Floats | None:
    """Samples of a whole triad in some rows, shape (3, n)."""
    names = [f"{prefix}_{axis}" for axis in "xyz"]
    if not all(name in recording.channels for name in names):
        return None
    return np.stack([recording.channels[name].values[rows] for name in names])


def _at_rest(recording: Recording, rows: _Rows) -> bool:
    """Whether nothing tells of motion: no table, and a specific force that does not turn."""
    force = _triad(recording, "accel", rows)
    table = {"table_angle", "table_rate"} & recording.channels.keys()
    if table or force is None:
        return not table
    scatter, size = float(force.std(axis=1).max()), float(np.linalg.norm(force.mean(axis=1)))
    return scatter < _REST_SCATTER * max(1.0, size / STANDARD_GRAVITY)


def _force(recording: Recording, rows: _Rows) -> str:
    force = _triad(recording, "accel", rows)
    if force is None or not _at_rest(recording, rows):
        return ""
    mean = force.mean(axis=1)
    size, gravity = float(np.linalg.norm(mean)), recording.site.gravity or STANDARD_GRAVITY
    if abs(size / gravity - 1) > _FORCE_SHARE:
        found = f"{size:.4g} m/s^2, {size / gravity:.3g} times gravity"
        return f"mean specific force at rest is {found}: check unit and quantity of accel_x, y, z"
    up = _up(recording.mounting.axes) @ mean
    if up < -0.5 * gravity:
        axes = recording.mounting.axes
        return f"specific force points down ({up:.4g} m/s^2 along up of {axes}): check mounting.axes and signs"
    return ""


def _up(axes: str) -> Floats:
    """Unit vector of "up" in a triad whose axes point as the letters say."""
    return np.array([float(_DIRECTIONS[a][1]) if _DIRECTIONS[a][0] == 2 else 0.0 for a in axes])


def _rate(recording: Recording, rows: _Rows) -> str:
    rate = _triad(recording, "gyro", rows)
    if rate is None or not _at_rest(recording, rows):
        return ""
    size = float(np.linalg.norm(rate.mean(axis=1)))
    low, high = (limit * EARTH_RATE for limit in _RATE_RANGE)
    if low <= size <= high:
        return ""
    ratio = f"{size / EARTH_RATE:.2g} times the Earth's rate"
    return f"mean rate at rest is {size:.3g} rad/s, {ratio}: check unit and quantity of gyro_x, y, z"
