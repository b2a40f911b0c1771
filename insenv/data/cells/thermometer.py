"""Readings of a thermometer that are none: words of its own start, and values that stand while it goes on.

**Words.** A row, or up to `FAILED` of them, is off the median of the rows about it by more than `FAR` robust deviations
of all rows from theirs, and by more than `LEAST` kelvins: 85 degC of a thermometer that has just been switched on, 0 of
one that did not answer. The rows beside it tell what it was.

**Standing.** One number stands for `LONG` times as many rows as usual and the reading then leaps by more than `LEAPS`
times any other change: in between it was not renewed. Nobody knows the temperature there, and what follows it would be
found in what a lag, a hysteresis or a step do: the rows of all instruments are left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import GAP, Floats, Recording
from insenv.core.series.robust import robust_deviation
from insenv.core.series.rounding import rounding
from insenv.core.series.stretches import stretches
from insenv.core.units import ZERO_CELSIUS

Mask = NDArray[np.bool_]

#: Rows whose median is the temperature about a row, most rows that one failure lasts, robust deviations and kelvins by
#: which it is off, and largest share of the rows that are failures.
AROUND, FAILED, FAR, LEAST, MOST = 9, 3, 20.0, 2.0, 0.01
#: Fewest rows that a value stands for, in themselves and in those that are usual; times any other change that it leaps.
STANDS, LONG, LEAPS = 20, 8.0, 5.0
#: Fewest rows of a run that is looked at, and fewest changes of the temperature in it.
FEWEST, CHANGES = 100, 20


def with_sound_temperature(recording: Recording) -> Recording:
    """The recording with failures of its thermometer bridged and said, and the rows at which it stands left out."""
    channel = recording.channels.get("temperature")
    if channel is None or channel.source == "set" or len(recording) < FEWEST:
        return recording
    values, notes, left_out = channel.values, recording.notes, dict(recording.left_out)
    words = _words(values)
    if words.any():
        first = int(np.argmax(words))
        notes = (
            *notes,
            f"temperature: {int(words.sum())} rows are no readings, first {_shown(values[first])} in row "
            f"{first} between {_shown(values[first - 1 if first else first + FAILED])}: left out",
        )
        values = _bridged(values, words)
    standing = _standing(recording, values)
    for a, b in stretches(standing):
        notes = (
            *notes,
            f"temperature stands at {_shown(values[a])} for {b - a} rows and then leaps by "
            f"{values[min(b, len(values) - 1)] - values[b - 1]:.3g} K: rows {a} to {b - 1} are left out",
        )
    if standing.any():
        instruments = (name for name in recording.channels if name.partition("_")[0] in ("gyro", "accel"))
        left_out |= {name: standing | left_out.get(name, False) for name in instruments}
        values = _bridged(values, standing)
    if values is channel.values:
        return recording
    channels = {**recording.channels, "temperature": replace(channel, values=values)}
    return replace(recording, channels=channels, notes=notes, left_out=left_out)


def _words(values: Floats) -> Mask:
    """Rows that are far off those about them, shape (n,); none where they are many, or last."""
    from scipy.ndimage import median_filter  # slow to import

    off = values - median_filter(values, AROUND, mode="nearest")
    usual = max(robust_deviation(off), rounding(values))
    far = np.abs(off) > max(FAR * usual, LEAST)
    lasts = any(b - a > FAILED for a, b in stretches(far))
    return far if not lasts and far.mean() <= MOST else np.zeros(len(values), bool)


def _standing(recording: Recording, values: Floats) -> Mask:
    """Rows in which one number stands until the reading leaps, shape (n,)."""
    changes = np.diff(values)
    at = np.flatnonzero(changes)
    found = np.zeros(len(values), bool)
    if len(at) < CHANGES:
        return found
    lengths = np.diff(at)
    long = lengths >= max(STANDS, LONG * float(np.median(lengths)))
    others = np.abs(changes[at])
    gaps = np.diff(recording.t)[at] > GAP * recording.dt
    for start, stop in zip(at[:-1][long] + 1, at[1:][long] + 1, strict=True):
        leap = abs(float(changes[stop - 1]))
        rest = others[(at != stop - 1) & ~gaps]
        if not gaps[np.searchsorted(at, stop - 1)] and leap > LEAPS * float(rest.max()):
            found[start:stop] = True
    return found


def _bridged(values: Floats, gone: Mask) -> Floats:
    """Values with a line in the place of those that are ``gone``."""
    rows = np.flatnonzero(~gone)
    return np.interp(np.arange(len(values)), rows, values[rows])


def _shown(kelvins: float) -> str:
    return f"{kelvins - ZERO_CELSIUS:.4g} degC"
