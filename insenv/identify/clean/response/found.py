"""Whether an output has a gain of its own, and a lag beside the table's reading: what the recordings are to say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats, Recording
from insenv.core.series.stretches import stretches as in_a_row
from insenv.data.cells.follow import correlation
from insenv.data.reference import order
from insenv.identify.clean.ramps import ends_of_dwells
from insenv.identify.clean.response.fit import FARTHEST, LONGEST, fitted, slope_of
from insenv.identify.clean.response.forms import follow, likelier, with_response
from insenv.identify.clean.response.stretches import CHANGING, FEWEST, Stretch, stretches
from insenv.identify.fit.problem import Model

#: Departure of a gain from one up to which it is a small error, as any other.
SMALL = 0.005
#: Departure from which a scale factor that was not declared is none: no effect's.
INCREDIBLE = 0.5
#: Standard deviations from which on a gain or a lag is told.
TOLD = 4.0
#: Share of what a lag changes beyond which it is no longer a straight line in the lag, as a `timing_skew` is.
BENT = 0.2
#: Rows within which a command jumps, which no table does, and the share of its largest change that is none.
JUMP, STANDS = 2, 1e-6
#: Share of all its changes that jumps may have.
OF_JUMPS = 0.1
#: Share of the largest correlation, squared, from which a peak is as good.
AS_GOOD = 0.9
#: Rows by which a lag is always looked for: what is read once a second may be seconds late.
ROWS = 10
#: The correlation, squared, from which on the reading follows the input, and by how much it must be larger at the lag
#: of two clocks that were never set by each other.
FOLLOWS, FAR_BETTER = 0.25, 4.0


def responding(
    recordings: tuple[Recording, ...],
    spans: tuple[slice, ...],
    target: str,
    model: Model,
    rows: tuple[NDArray[np.bool_], ...] = (),
    forms: bool = True,
) -> tuple[Recording, ...]:
    """The recordings with the gain of ``target``, and its lag where the table's reading is noisy, or far too late.

    Parameters
    ----------
    recordings : tuple of Recording
    spans : tuple of slice
        Rows that are looked at in each, contiguous and fitted.
    target : str
    model : Model
        Declared terms.
    rows : tuple of ndarray of bool
        All rows that may be fitted: where gaps leave no long stretch, they are looked at.
    forms : bool
        Whether a lag may be other than a delay; beside a hold that is told later (`with_held`).
    """
    if not target.startswith("gyro"):
        return recordings
    parts = [_at_rates(s, recordings[s.run], target) for s in stretches(recordings, spans, target, rows)]
    if sum(float(s.known.sum()) for s in parts) < 0.75 * FEWEST:
        return recordings
    noisy = {s.run for s in parts if (table := recordings[s.run].table) is not None and not table.still}
    read = {s.run: _coarse(s) for s in parts if _measured(recordings[s.run]) or _ramps(s)}
    own = noisy | {s.run for s in parts if _bent(s, read.get(s.run, 0.0))}
    own |= _smoothed(parts, recordings, read)
    gain, sd, _ = fitted(parts, {s.run: 0.0 for s in parts}, lag_of=set())
    if not own and not _other(gain, sd, model):
        return recordings
    lags = {s.run: read[s.run] if s.run in own else 0.0 for s in parts}
    found = likelier(parts, lags, own) if forms else follow(parts, lags, own, None, filtered=False)
    gain = found.gain if _other(found.gain, found.sd, model) else 1.0
    return with_response(recordings, target, gain, found)


def _at_rates(one: Stretch, recording: Recording, target: str) -> Stretch:
    """Of a run whose command jumps the ends of its dwells alone: a table is late, now and then by most of a dwell."""
    rows = ends_of_dwells(recording, target)
    if rows is None:
        return one
    cells = one.exposure.cell_of_row[rows]
    cells = cells[(cells >= one.start) & (cells < one.stop)] - one.start
    at_rate = np.zeros(one.stop - one.start, bool)
    at_rate[cells] = True
    used = at_rate if one.used is None else at_rate & one.used
    u = one.exposure.u[one.start : one.stop][used & (one.known > 0)]
    # The ends of dwells at one rate tell no gain from a bias.
    return replace(one, used=used) if len(u) and np.ptp(u) > CHANGING * np.abs(u).max() else one


def _smoothed(parts: list[Stretch], recordings: tuple[Recording, ...], read: dict[int, float]) -> set[int]:
    """Runs whose reference is a rate that was measured, and late by rows as one that was smoothed is, if it was.

    What is left of a mean over a window beside a mere delay lies at the ends of ramps, each at its own rates.
    """
    late = {
        s.run: read[s.run] for s in parts if _smooth_rate(recordings[s.run]) and read[s.run] <= -s.exposure.motion.dt
    }
    if not late:
        return set()
    lags = {s.run: late.get(s.run, 0.0) for s in parts}
    found = likelier(parts, lags, set(late))
    return set(late) if found.filtered or found.window else set()


def _smooth_rate(recording: Recording) -> bool:
    """Whether the reference is a rate that was measured."""
    return order(recording)[:1] == ("table_rate",) and _measured(recording)


def _other(gain: float, sd: float, model: Model) -> bool:
    """Whether a gain is told and no small error."""
    declared = any(term.effect.part == "gain" for term in model)
    return abs(gain - 1) > max(SMALL if declared else INCREDIBLE, TOLD * sd) and abs(gain) > TOLD * sd


def _coarse(one: Stretch) -> float:
    """The lag at which reading and input correlate most [s].

    Of a table that swings evenly every half swing does nearly as well, every other one with the gain turned round: of
    peaks as good as the best the one nearest to no lag is taken. Two clocks may be further apart than any one is late:
    where next to nothing is alike within `LONGEST`, lags up to `FARTHEST` are asked, and one counts that is.
    """
    longest = max(LONGEST, ROWS * one.exposure.motion.dt)
    lag, alike = _most_alike(one, longest)
    if alike < FOLLOWS:
        far, then = _most_alike(one, max(FARTHEST, longest))
        if then > max(FOLLOWS, FAR_BETTER * alike):
            return far
    return lag


def _most_alike(one: Stretch, longest: float) -> tuple[float, float]:
    """The lag of at most ``longest`` at which reading and input correlate most [s], and the correlation squared."""
    dt = one.exposure.motion.dt
    most = min(int(longest / dt), len(one.y) // 4)
    both, power = correlation(one.input(0.0), one.y, one.known, most)
    alike = both**2 / np.maximum(power, 1e-300)
    best = int(np.argmax(alike))
    peaks = 1 + np.flatnonzero((alike[1:-1] >= alike[:-2]) & (alike[1:-1] >= alike[2:]))
    good = np.append([k for k in peaks[alike[peaks] > AS_GOOD * alike[best]] if _apart(alike, int(k), best)], best)
    at = int(good[np.argmin(np.abs(good - most))])
    return (at - most) * dt, float(alike[at])


def _apart(alike: Floats, one: int, best: int) -> bool:
    """Whether a valley lies between two peaks: a lost row makes small ones on the slope of a large one."""
    return float(alike[min(one, best) : max(one, best) + 1].min()) < AS_GOOD * float(alike[one])


def _measured(recording: Recording) -> bool:
    """Whether the table's motion was measured: a command that jumps is none, for the table is late by its ramps."""
    return any(recording.channels[name].source == "encoder" for name in order(recording)[:1])


def _ramps(one: Stretch) -> bool:
    """Whether a command goes from rate to rate as a table does, row by row: then it is the motion.

    A jump now and then makes it none of jumps.
    """
    changes = np.abs(np.diff(one.exposure.u[one.start : one.stop]))
    jumps = [slice(a, b) for a, b in in_a_row(changes > STANDS * changes.max(initial=0.0)) if b - a <= JUMP]
    return float(sum(changes[one].sum() for one in jumps)) <= OF_JUMPS * float(changes.sum())


def _bent(one: Stretch, lag: float) -> bool:
    """Whether a lag is too long for the straight line through it that a `timing_skew` is."""
    now, then = one.input(0.0), one.input(lag)
    line = now + slope_of(one, 0.0, None) * lag
    changed = float(np.linalg.norm((then - now) * one.known))
    return abs(lag) > 0 and float(np.linalg.norm((then - line) * one.known)) > BENT * changed > 0
