r"""The numbers that a unit at rest reads: piled on one of them, or the same again and again.

Noise that is rounded reads neighbouring numbers about as often as each other, and those that are rounded twice in
turns. Of c rows that read one number, and m that read the fullest other one, or at an end the fullest of the next two,

    P(C >= c),    C ~ Binomial(c + m, k / (1 + k)),

is the chance of a number that is read no more than k times as often. What piles up at an end is clipped; elsewhere it
is a dead band, a threshold of a program, or rows that nobody read. A bias and noise that are read through it are not
those of the instrument.

A unit that is read more often than it measures reads a number again. Rows of noise that blurs its rounding do so with
the sum of squares of the shares of all numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc

from insenv.core.recording import Floats, Recording
from insenv.core.series.stretches import stretches

#: Times as often as others that a number may be read, how many these are at an end, from which on there are more and
#: more, and the probability from which on it is a pile.
PILED, AT_END, SAID = 3.0, 2, 1e-9
#: Fewest numbers that are read, share of the rows on one that is a pile, and stretches in which it is read.
DISTINCT, SHARE, APART = 12, 0.02, 12
#: Share of the rows on one number from which on it may be a coarse step; share of the fullest other number that those
#: have which tell how far steps are apart, and how many steps off they begin at a dead band.
MOSTLY, USUAL, GAP = 0.3, 0.1, 2.0
#: Fewest rows, and share of them that repeat the row before, beyond times what rounding makes.
FEWEST, REPEATS, BY_CHANCE = 200, 0.1, 3.0
#: Share of the changes that come after one and the same number of rows where a unit is read at a multiple of its rate.
REGULAR = 0.9


@dataclass(frozen=True)
class Pile:
    """A number that too many rows read: their share, how many times as many as read another, and where it is.

    ``end`` is "smallest" or "largest" where nothing beyond it is read; else empty.
    """

    value: float
    share: float
    times: float
    end: str


def piles(recordings: Sequence[Recording], target: str) -> tuple[str, ...]:
    """Sentences on numbers that the rows of a unit at rest pile up on."""
    said = []
    for run, recording in enumerate(recordings):
        found = pile(_values(recording, target))
        if found is None:
            continue
        where = f" of run {run + 1}" if len(recordings) > 1 else ""
        number = f"exactly {found.value:.5g} {recording.channels[target].unit}"
        why = (
            f"the {found.end} number that is read: it is clipped there, and bias and noise are not what they seem"
            if found.end
            else "a dead band, a threshold of a program or rows that were not read hide what is smaller"
        )
        said.append(
            f"{found.share:.0%} of the rows{where} read {number}, {found.times:.2g} times as many as read another one "
            f"nearby: {why}"
        )
    return tuple(said)


def pile(values: Floats) -> Pile | None:
    """The number that rows pile up on most, of ``values``, shape (n,); None where they do not."""
    numbers, count = np.unique(values, return_counts=True)
    if len(numbers) < DISTINCT:
        return None
    held = len(values) / (1 + np.count_nonzero(np.diff(values)))
    largest = np.partition(count, -2)[-2:]
    beside = np.where(count == largest[1], largest[0], largest[1])
    beside[[0, -1]] = count[1 : 1 + AT_END].max(), count[-1 - AT_END : -1].max()
    rows, usual = count / held, np.maximum(beside / held, 1.0)
    log_p = np.log(np.maximum(betainc(rows, usual + 1, PILED / (1 + PILED)), 1e-300)) + np.log(len(numbers))
    able = (count > SHARE * len(values)) & (log_p < np.log(SAID))
    for at in sorted(np.flatnonzero(able).tolist(), key=lambda k: (log_p[k], -count[k])):
        if len(stretches(values == numbers[at])) >= APART and not _is_a_step(numbers, count, at):
            end = "smallest" if at == 0 else "largest" if at == len(numbers) - 1 else ""
            times = float(count[at] / max(beside[at], 1))
            return Pile(float(numbers[at]), float(count[at]) / len(values), times, end)
    return None


def _is_a_step(numbers: Floats, count: NDArray[np.int64], at: int) -> bool:
    """Whether most rows read a number because the noise is less than a step: the next ones are a step away."""
    if count[at] <= MOSTLY * count.sum():
        return False
    others = np.delete(np.arange(len(numbers)), at)
    usual = numbers[others[count[others] >= USUAL * count[others].max()]]
    # Of a step that is written in two lengths every second spacing is next to nothing.
    return len(usual) < 2 or bool(np.abs(usual - numbers[at]).min() <= GAP * np.quantile(np.diff(usual), 0.75))


def repeated(recordings: Sequence[Recording], targets: Sequence[str]) -> tuple[str, ...]:
    """Remarks on channels whose rows repeat the row before, all that do so alike in one."""
    said: dict[tuple[str, int], list[str]] = {}
    for recording in recordings:
        where = f"{recording.label}: " if len(recordings) > 1 else ""
        for target in targets:
            found = _repeats(_values(recording, target))
            if found is not None:
                share, every = found
                said.setdefault((where, every), []).append(target if every else f"{target} in {share:.0%} of the rows")
    return tuple(
        f"{where}{', '.join(names)}: each repeats the row before exactly, for the unit "
        + ("is read more often than it measures" if not every else f"measures anew every {every} rows alone")
        for (where, every), names in said.items()
    )


def _repeats(values: Floats) -> tuple[float, int] | None:
    """Share of the rows that repeat the one before, and after how many rows there is a new one; 0 where that varies."""
    if len(values) < FEWEST or (share := float(np.mean(np.diff(values) == 0))) < REPEATS:
        return None
    _, count = np.unique(values, return_counts=True)
    chance = float(np.sum((count / len(values)) ** 2))
    if share < REPEATS + BY_CHANCE * chance or pile(values) is not None:
        return None
    after, often = np.unique(np.diff(np.flatnonzero(np.diff(values))), return_counts=True)
    usual = int(after[often.argmax()])
    return share, usual if usual > 1 and often.max() > REGULAR * often.sum() else 0


def _values(recording: Recording, target: str) -> Floats:
    """Readings of the rows in use."""
    values = recording.channels[target].values
    return values if recording.unused is None else values[~recording.unused]
