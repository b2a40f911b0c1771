"""The numbers that rests read: an accelerometer that clips below gravity, or a gyro that a program holds at nought.

In a rest that is clipped most rows are exactly the largest, or the smallest, number that the channel reads anywhere,
where other rests scatter over many numbers. Six faces fit such an axis with a scale factor that is too small, and leave
nothing.

A gyro that reads one number in most rows of all rests, and none of those next to it, has a dead band: its bias is not
what it reads there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from insenv.core.recording import Floats, Recording
from insenv.identify.positions.model import AXES
from insenv.identify.positions.rests import Rest

#: Share of the rows of a rest on one number from which on it may be clipped, how many times the usual share, and how
#: large that may be: readings of few numbers tell nothing.
SHARE, TIMES, USUAL = 0.25, 3.0, 0.2
#: Share of the rows at rest on one number, how many steps off others begin, and fewest of these.
SILENT, STEPS, FEWEST = 0.5, 3.0, 50


def clipped(recordings: Sequence[Recording], rests: Sequence[Rest]) -> tuple[str, ...]:
    """A reason for each axis that clips, with the number and the rests."""
    said = []
    for axis in AXES:
        name = f"accel_{axis}"
        modes = [_mode(recordings[rest.run].channels[name].values[rest.rows]) for rest in rests]
        numbers, shares = np.array([number for number, _ in modes]), np.array([share for _, share in modes])
        usual = float(np.median(shares))
        if usual > USUAL:
            continue
        for end, what in ((np.max, "largest"), (np.min, "smallest")):
            value = float(end([end(r.channels[name].values) for r in recordings]))
            there = (numbers == value) & (shares > max(SHARE, TIMES * usual))
            if there.any():
                count = len({rest.number for rest, one in zip(rests, there, strict=True) if one})
                said.append(
                    f"{name} reads exactly {value:.5g} m/s^2, the {what} number that it reads at all, in "
                    f"{shares[there].max():.0%} of the rows of {'a rest' if count == 1 else f'{count} rests'}: it is "
                    "clipped there, and its scale factor and bias are not what they seem"
                )
    return tuple(said)


def silenced(recordings: Sequence[Recording], rests: Sequence[Rest], target: str) -> tuple[str, ...]:
    """A reason where a gyro reads one number at rest, and what it reads elsewhere begins some steps off."""
    at_rest = np.concatenate([recordings[rest.run].channels[target].values[rest.rows] for rest in rests])
    number, share = _mode(at_rest)
    numbers = np.unique(np.concatenate([r.channels[target].values for r in recordings]))
    others = numbers[numbers != number]
    if share < SILENT or len(others) < FEWEST:
        return ()
    step = float(np.median(np.sort(np.diff(others))[: len(others) // 2]))
    gap = float(np.abs(others - number).min())
    if gap <= STEPS * step:
        return ()
    return (
        f"{target} reads exactly {number:.5g} rad/s in {share:.0%} of the rows at rest, and nothing within {gap:.2g} "
        "rad/s of it: a dead band or a program that sets slow rates so, which hides its bias and its noise",
    )


def _mode(values: Floats) -> tuple[float, float]:
    """The number that is read most often, and by which share of the rows."""
    numbers, count = np.unique(values, return_counts=True)
    return float(numbers[count.argmax()]), float(count.max()) / len(values)
