"""Rows that are left out systematically: all of one rate, one direction, one temperature.

Rows lost here and there are an accident of the logging. Where most of a dwell is lost, the instrument has said nothing
of it, and a model that fits the rest is no statement about it: that is a finding, with its cause. One event while the
rate moves on is none: what is lost at one rate is a dwell, or more than one visit.

What is lost where the table, on its way, points the same way again and again is its encoder's: a mark, a count too
many. Of n events k pairs are within an angle of each other; with no cause in the angle, k is of Poisson about the share
of all pairs of rows on the way that are.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.special import pdtrc

from insenv.core.recording import Floats, Recording
from insenv.core.series.stretches import stretches
from insenv.data.cells.table import table_rate_of_rows
from insenv.data.exposure import table_share
from insenv.identify.findings import RejectedRows

#: Classes of the table's rate over its range to either side; of the temperature.
RATES, TEMPERATURES = 40, 10
#: Share of a class that is lost, and share of all rows that a class has at least.
LOST, LEAST = 0.5, 0.01
#: Fewest rows of a class: of one in three nothing is systematic.
SEVERAL = 3
#: Share of the largest rate below which a dwell that stands still is a dead band.
DEAD = 0.25
#: How near two events are at one angle [rad], pairs of them that tell it, and the probability below which they do.
SAME_ANGLE, PAIRS, CHANCE = float(np.deg2rad(5)), 3, 1e-4
#: Rows within which two stretches are one event, and before and after it, in which the table keeps its rate to a share
#: of the largest; share of that from which on it is on its way.
ONE_EVENT, KEPT, ON_ITS_WAY = 20, 0.1, 0.05
#: What an experimenter calls it.
WORDS = {"stuck": "equal values", "outlier": "outliers", "saturation": "clipped"}


def lost_rates(
    recordings: tuple[Recording, ...], target: str, rejected: tuple[RejectedRows, ...], cause: str
) -> tuple[float, ...]:
    """Middle of each rate of the table [rad/s] of which most rows are left out for ``cause``."""
    rates = [table_rate_of_rows(r, target) for r in recordings]
    known = [(run, rate) for run, rate in enumerate(rates) if rate is not None]
    if not known:
        return ()
    u = np.concatenate([rate * table_share(recordings[run], target) for run, rate in known])
    mask = np.concatenate([_mask(len(rate), run, rejected, cause) for run, rate in known])
    most = float(np.abs(u).max(initial=0.0))
    if not most:
        return ()
    return tuple(_classes(u, np.rint(u / most * RATES).astype(int), mask))


def lost_temperatures(
    recordings: tuple[Recording, ...], target: str, rejected: tuple[RejectedRows, ...], cause: str
) -> tuple[float, ...]:
    """Middle of each temperature [K] at which most rows are left out for ``cause``."""
    if not all("temperature" in r.channels for r in recordings):
        return ()
    kelvins = np.concatenate([r.channels["temperature"].values for r in recordings])
    mask = np.concatenate([_mask(len(r), run, rejected, cause) for run, r in enumerate(recordings)])
    span = float(np.ptp(kelvins))
    if not span:
        return ()
    return tuple(_classes(kelvins, np.rint((kelvins - kelvins.min()) / span * TEMPERATURES).astype(int), mask))


def at_one_angle(recordings: tuple[Recording, ...], rejected: tuple[RejectedRows, ...]) -> bool:
    """Whether outliers come where the table, which keeps its rate, points the same way again."""
    near, expected = 0, 0.0
    for run, recording in enumerate(recordings):
        if "table_angle" not in recording.channels or len(recording) < 3 * ONE_EVENT:
            continue
        angle = recording.channels["table_angle"].values
        rate: Floats = (angle[ONE_EVENT:] - angle[:-ONE_EVENT]) / ONE_EVENT
        at: Floats = angle[_events(_mask(len(angle), run, rejected, "outlier"), rate)]
        turns = np.subtract.outer(at, at)[np.triu_indices(len(at), 1)] / (2 * np.pi)
        near += int(np.sum(np.abs(turns - np.rint(turns)) < SAME_ANGLE / (2 * np.pi)))
        moving = np.abs(rate) > ON_ITS_WAY * np.abs(rate).max(initial=0.0)
        sector = np.floor(np.mod(angle[: len(rate)][moving], 2 * np.pi) / (2 * SAME_ANGLE))
        share = np.bincount(sector.astype(int)) / max(sector.size, 1)
        expected += len(turns) * float(share @ share)
    return near >= PAIRS and float(pdtrc(near - 1, expected)) < CHANCE


def _events(lost: NDArray[np.bool_], rate: Floats) -> list[int]:
    """Middle rows of what is lost while the table keeps its rate; stretches that are near each other are one event.

    Rows are left out as far on either side as a filter or a mean makes one of them: both ways the middle is the same.
    """
    parts = stretches(lost)
    first = [a for k, (a, _) in enumerate(parts) if k == 0 or a - parts[k - 1][1] > ONE_EVENT]
    last = [b for k, (_, b) in enumerate(parts) if k == len(parts) - 1 or parts[k + 1][0] - b > ONE_EVENT]
    most = float(np.abs(rate).max(initial=0.0))
    known = [(a, b) for a, b in zip(first, last, strict=True) if a >= ONE_EVENT and b < len(rate)]
    moving = [(a, b) for a, b in known if abs(rate[b]) > ON_ITS_WAY * most]
    return [(a + b) // 2 for a, b in moving if abs(rate[a - ONE_EVENT] - rate[b]) < KEPT * most]


def sentences(recordings: tuple[Recording, ...], target: str, rejected: tuple[RejectedRows, ...]) -> tuple[str, ...]:
    """Sentences about what is lost systematically for another cause than a rail, which is named by itself."""
    found = []
    for cause in ("stuck", "outlier"):
        rates = lost_rates(recordings, target, rejected, cause)
        if rates:
            known = [r for r in (table_rate_of_rows(r, target) for r in recordings) if r is not None]
            most = max(float(np.abs(r).max()) for r in known)
            dead = cause == "stuck" and max(map(abs, rates)) < DEAD * most
            where = f"{listed(rates, np.degrees)} deg/s"
            what = "a dead band" if dead else "the readings stand still" if cause == "stuck" else "the readings leap"
            found.append(
                f"most rows at {where} are left out as {WORDS[cause]}: {what}, and nothing is known of that rate"
            )
        kelvins = lost_temperatures(recordings, target, rejected, cause)
        if kelvins and not rates:
            where = f"{listed(kelvins, lambda k: k - 273.15)} degC"
            found.append(f"most rows at {where} are left out as {WORDS[cause]}: nothing is known of that temperature")
    if at_one_angle(recordings, rejected):
        found.append(
            "rows are left out as outliers where the table, on its way, points the same way again and again: a mark of "
            "its encoder, or a count, is wrong there"
        )
    return tuple(found)


def listed(values: tuple[float, ...], shown) -> str:  # type: ignore[no-untyped-def]
    """Values in the unit that ``shown`` makes of them: "-35 and 35"."""
    words = [f"{float(shown(v)):.3g}" for v in values]
    return ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else words[0]


def _mask(n: int, run: int, rejected: tuple[RejectedRows, ...], cause: str) -> NDArray[np.bool_]:
    mask = np.zeros(n, bool)
    for one in rejected:
        if one.run == run and one.cause == cause:
            mask[one.start : one.stop] = True
    return mask


def _classes(values: Floats, index: NDArray[np.int64], mask: NDArray[np.bool_]) -> Iterator[float]:
    """Median of each class of which most is lost, unless most of all is."""
    if mask.mean() > LOST:
        return
    lost = stretches(mask)
    for one in np.unique(index[mask]):
        own = index == one
        if own.sum() < max(LEAST * len(own), SEVERAL) or mask[own].mean() <= LOST:
            continue
        visits = [own[a:b].mean() for a, b in lost if own[a:b].any()]
        if len(visits) > 1 or max(visits) > LOST:
            yield float(np.median(values[own & mask]))
