"""About which of its axes a unit turns on a table, where nobody said so.

Of the gyros of a unit one reads the table's rate, with a gain near one, and those across the table's axis next to none:

    g_i = <w_i, W> / <W, W>,      one |g_i| within `ALONG` of 1, all others below `ACROSS`

with the rates less their means. Then `[mounting] table_axis` follows from the letters of the axes. Without it each gyro
would be taken for one along the table's axis, of a gain of next to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from insenv.core.recording import Mounting, Recording
from insenv.data.exposure import UP, expose, has_table

#: How far the gain of the gyro along the table's axis may be from one, and what the others read at most.
ALONG, ACROSS = 0.1, 0.1
GYROS = ("gyro_x", "gyro_y", "gyro_z")


def about_its_axis(
    recordings: tuple[Recording, ...], targets: Sequence[str]
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """The recordings with the table's axis where a target is across it and nobody said so; what is said of it."""
    if any(r.mounting.table_axis or r.mounting.tilt != Mounting.tilt or not has_table(r) for r in recordings):
        return recordings, ()
    names = [name for name in GYROS if all(name in r.channels for r in recordings)]
    asked = [name for name in targets if name in names]
    if len(names) < 2 or not asked:
        return recordings, ()
    gains = {name: np.array([_gain(r, name) for r in recordings]) for name in names}
    along = [name for name, gain in gains.items() if np.all(np.abs(np.abs(gain) - 1) < ALONG)]
    across = [name for name, gain in gains.items() if np.all(np.abs(gain) < ACROSS)]
    if len(along) != 1 or len(along) + len(across) < len(names) or not set(asked) & set(across):
        return recordings, ()
    letter = recordings[0].mounting.axes["xyz".index(along[0][-1])]
    signs = set(np.sign(gains[along[0]]).tolist())
    if letter not in UP or len(signs) != 1 or any(r.mounting.axes != recordings[0].mounting.axes for r in recordings):
        return recordings, ()
    axis = "U" if signs.pop() == UP[letter] else "D"
    said = (
        f"{along[0]} reads the rate of the table and {' and '.join(across)} next to nothing: the unit turns about its "
        f'{along[0][-1]} axis, taken as mounting.table_axis = "{axis}"'
    )
    return tuple(replace(r, mounting=replace(r.mounting, table_axis=axis)) for r in recordings), (said,)


def _gain(recording: Recording, name: str) -> float:
    """What a gyro reads of the table's rate; NaN where the table stands or no cell holds a row."""
    exposure = expose(recording, name)
    there = exposure.count > 0
    rate, read = exposure.motion.rate[there], exposure.y[there]
    rate = rate - rate.mean() if len(rate) else rate
    size = float(rate @ rate)
    return float((read - read.mean()) @ rate) / size if size else np.nan
