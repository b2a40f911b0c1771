"""An output that is renewed less often than it is read, looked for in the samples themselves.

    y - u = c (held(u) - u) - s du/dt + declared + noise

In means that are longer than the hold time a held output is late by half of it, and nothing more; in the samples it is
a sawtooth that follows the acceleration. So it is looked for beside a skew s, in differences from sample to sample,
which leave of everything slow next to nothing. Found, it is subtracted before lines are looked for: its sawtooth has
many. u is what the instrument makes of its input, gain and lag (`insenv.identify.clean.response`): a share of it that
is held is a share of that. The hold time is one for all runs, the phase is each run's own: a logger is started anew.

Readings that repeat in all rows but every k-th show a hold without any of this (`insenv.identify.clean.repeats`).

A hold is a law of the logger: each half of each run that could show it has it, with the same hold time and share. What
a late, coarse or interpolated reference leaves is a sawtooth for a while, with another time in the next.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from insenv.core.motion import Motion
from insenv.core.recording import Floats, Recording
from insenv.data.exposure import Exposure, expose
from insenv.effects.timing import TimingSkew, before_mean
from insenv.identify.clean.outliers import leaving_out
from insenv.identify.clean.repeats import repeats
from insenv.identify.clean.response.sawtooth import MOST_SHARE, PHASES, HeldDifferences, HoldGain, orthogonal, outside
from insenv.identify.clean.response.stretches import held_part, lagged
from insenv.identify.fit.problem import Model, Problem, regressors

#: Runs that are looked at, those that move most first.
MOST_RUNS = 3
#: Rows that are looked at: those with the most acceleration in a row.
MOST_ROWS = 40000
#: A false alarm in so many recordings is allowed.
FALSE_ALARM = 1e-4
#: Least share that is held (a smaller one is what a skew leaves), and its largest relative deviation.
LEAST_SHARE, LARGEST_SD = 0.8, 0.1
#: Rows of the first look.
COARSE = 8000
#: Standard deviations up to which a share is taken for a whole.
WHOLE = 4.0
#: Error of the scale of an output that is held whole, at most.
SCALE = 0.05
#: A part tells a share in so many standard deviations that half of the whole's would show, and has it if it is the
#: whole's within that half. Fewest differences of a part.
TELLS, HALF, PART = 3.0, 0.5, 48
#: Share of the motion that must be left in the rows looked at: where jumps and ramps were left out, what is beside them
#: is what smoothing makes of the reference.
LEAST_MOTION = 0.5
#: Fewest renewals that tell a hold. A jump that comes late by some rows is that late by a hold of every length with the
#: phase that fits, two by a hold of many lengths, and of each further one a hold of k rows makes one of k delays.
RENEWALS = 4.0
#: Share of what a hold of that time makes at other phases that it must make at its own.
SHOWN = 0.1
#: Share of what is left beyond noise where it stands that it must take.
ALL = 0.9
#: Delays beside which a hold must be told by so many standard deviations.
DELAYS, BESIDE = 16, 6.0


@dataclass(frozen=True)
class Hold:
    """An output of which the share ``share`` is held for ``hold`` [s], with their standard deviations.

    ``phases`` [s] are the times from a renewal to the start of each run, less than ``hold``. ``whole`` where readings
    themselves repeat (`insenv.identify.clean.repeats`): no fit is asked which share is held. Not ``taken`` out where
    its phase is not one, or where the reference does not tell the motion from one renewal to the next. ``seen`` is the
    share that the fit shows of an output that is taken to be held whole.
    """

    share: float
    share_sd: float
    hold: float
    hold_sd: float
    phases: tuple[float, ...]
    p_value: float
    whole: bool = False
    taken: bool = True
    seen: float = 1.0


@dataclass(frozen=True)
class Look:
    """The hold of an output, if there is one; ``excluded`` where one of nearly any length would have been seen."""

    hold: Hold | None = None
    excluded: bool = False


def find_hold(recordings: tuple[Recording, ...], spans: tuple[slice, ...], problem: Problem, model: Model) -> Look:
    """The hold of an output, from the stretch ``spans`` of the run that moves most of those that tell one.

    Parameters
    ----------
    recordings : tuple of Recording
    spans : tuple of slice
        Rows that are looked at in each, contiguous and fitted.
    problem : Problem
        For the target and the reference temperature.
    model : Model
        Declared terms.
    """
    if not problem.turns:
        return Look()
    if (shown := _shown(recordings, spans, problem, model)) is not None:
        return Look(shown)
    looks = []
    for run in np.argsort([-float(np.ptp(e.u)) for e in problem.exposures])[:MOST_RUNS].tolist():
        view = _view(recordings[run], spans[run], problem, run, model)
        if view is None:  # its fitted part may stand still
            continue
        look = _best(view)
        if look.hold is not None:
            hold = _of_all_runs(look.hold, run, recordings, spans, problem, model)
            if (
                _renewals(view, look.hold) >= RENEWALS
                and _shows(view, look.hold)
                and _takes_all(view, look.hold)
                and _beside_delays(view, look.hold)
                and _recurs(hold, recordings, spans, problem, model)
            ):
                return Look(hold)
            look = Look()
        looks.append(look)
    return looks[0] if looks else Look()


def _shown(recordings: tuple[Recording, ...], spans: tuple[slice, ...], problem: Problem, model: Model) -> Hold | None:
    """The hold that repeated readings show by themselves; of a run with few changes the phase that explains most."""
    found = repeats(recordings, spans, problem.target)
    if found is None:
        return None
    dt, phases = recordings[0].dt, []
    chance, sd = float(np.exp(found.log_chance)), dt / found.changes / np.sqrt(12)
    everywhere = repeats(recordings, tuple(slice(0, len(r)) for r in recordings), problem.target)
    if found.slips or (everywhere is not None and everywhere.slips):
        return Hold(1.0, 1 / found.changes, found.rows * dt, sd, (), chance, whole=True, taken=False)
    for run, (recording, span) in enumerate(zip(recordings, spans, strict=True)):
        view = _view(recording, span, problem, run, model) if found.phases[run] is None else None
        phases.append((found.phases[run] or 0) * dt if view is None else _phase(view, found.rows * dt))
    return Hold(1.0, 1 / found.changes, found.rows * dt, sd, tuple(phases), chance, whole=True)


def _view(recording: Recording, span: slice, problem: Problem, run: int, model: Model) -> HeldDifferences | None:
    """The cells of a run in which a hold is looked for; None where nothing moves there."""
    exposure = aligned(recording, _whole(recording, problem, run))
    cells = _cells(exposure, span)
    if len(cells) < 64 or not np.any(np.diff(exposure.u[cells])) or _still_there(exposure, cells) < LEAST_MOTION:
        return None
    columns = [regressors(t.effect, exposure, t.shape)[cells] for t in model]
    columns.append(TimingSkew().basis(exposure.u, exposure.motion)[cells])
    q = orthogonal(np.diff(np.column_stack(columns), axis=0))
    return HeldDifferences(exposure, cells, q, outside(q, np.diff((exposure.y - exposure.motion.rate)[cells])))


def _still_there(exposure: Exposure, cells: NDArray[np.int64]) -> float:
    """Share of the square sum of the acceleration, from the first to the last of the cells, that is in them."""
    moved = np.diff(exposure.u[cells[0] : cells[-1] + 1]) ** 2
    whole = float(np.sum(moved))
    both = cells[:-1][np.diff(cells) == 1] - cells[0]
    return float(np.sum(moved[both])) / whole if whole else 0.0


def aligned(recording: Recording, exposure: Exposure) -> Exposure:
    """The exposure at the instrument's own time, with the motion behind a noisy reading for the reading."""
    motion, table = exposure.motion, recording.table
    if table is None or table.still or motion.rate_edges is None:
        return exposure
    u = lagged(exposure, motion.lag)
    if motion.filtered:
        edges = motion.rate_edges - motion.lag * np.gradient(motion.rate_edges, motion.dt)
    else:
        edges = np.interp(motion.t - motion.lag, motion.t, before_mean(exposure.u, motion.rate_edges, motion)[1])
    return replace(exposure, u=u, motion=replace(motion, rate=u, rate_edges=edges, lag=0.0, window=0.0))


def _renewals(view: HeldDifferences, hold: Hold) -> float:
    """How many renewals tell a hold, by what it makes in each.

    A table that stands but for two jumps, and a clock that runs off, were a hold of four rows with 1e-48.
    """
    dt = view.exposure.motion.dt
    ratio, phase = hold.hold / dt, hold.phases[0] / dt
    made = outside(view.q, view.change(ratio, phase)) ** 2
    count = np.floor((view.cells[1:] + phase) / ratio).astype(np.int64)
    return effective(np.bincount(count - count[0], made))


def effective(weights: NDArray[Any]) -> float:
    """How many of some weights there are, were all of them alike: (sum w)^2 / sum w^2; 0 of none."""
    return float(np.sum(weights) ** 2 / np.sum(weights**2)) if np.any(weights) else 0.0


def _shows(view: HeldDifferences, hold: Hold) -> bool:
    """Whether the motion shows a hold at its phase as it does at others.

    Where every jump of a table falls on a renewal nothing is held, and what is left of the jumps is no hold.
    """
    dt = view.exposure.motion.dt
    ratio = hold.hold / dt
    usual = np.median([view.gain(ratio, ratio * k / PHASES).size for k in range(PHASES)])
    return view.gain(ratio, hold.phases[0] / dt).size > SHOWN * float(usual)


def _takes_all(view: HeldDifferences, hold: Hold) -> bool:
    """Whether the hold takes nearly all of what is left beyond noise where its sawtooth stands.

    What smoothing of a noisy reference leaves of ramps follows a sawtooth in part. By the squares of its differences,
    the mean square is B before and A after it, and P after it in all rows: (B - A) / (B - P).
    """
    dt = view.exposure.motion.dt
    change = outside(view.q, view.change(hold.hold / dt, hold.phases[0] / dt))
    power = float(change @ change)
    if not power:
        return False
    after, weight = view.left - float(change @ view.left) / power * change, change**2 / power
    taken = float(weight @ view.left**2 - weight @ after**2)
    return taken > ALL * (float(weight @ view.left**2) - float(np.mean(after**2)))


def _beside_delays(view: HeldDifferences, hold: Hold) -> bool:
    """Whether the hold is still told beside any filter from one hold time ahead to two late.

    Where all jumps of a table fall on one phase of a hold, a held output is a late one, and what smoothing makes of
    those jumps is one too.
    """
    dt, cells, u = view.exposure.motion.dt, view.cells, view.exposure.u
    ratio = hold.hold / dt
    late = np.unique(np.round(np.linspace(-ratio, 2 * ratio, DELAYS)).astype(int))
    rows = np.arange(len(u))
    delayed = np.column_stack([np.diff(np.interp(rows - k, rows, u)[cells]) for k in late])
    own = orthogonal(np.column_stack([view.q, delayed]))
    search = HeldDifferences(view.exposure, cells, own, outside(own, view.left))
    found = search.gain(ratio, hold.phases[0] / dt)
    if not 0 < found.share <= MOST_SHARE:
        return False
    noise = max(found.total - found.gain, 0.0) / max(len(view.left) - own.shape[1] - 1, 1)
    return found.gain > BESIDE**2 * noise


def _of_all_runs(
    hold: Hold,
    run: int,
    recordings: tuple[Recording, ...],
    spans: tuple[slice, ...],
    problem: Problem,
    model: Model,
) -> Hold:
    """The hold with the phase of each run: where it explains most; zero where a run does not move."""
    phases = []
    for other, (recording, span) in enumerate(zip(recordings, spans, strict=True)):
        if other == run:
            phases.append(hold.phases[0])
            continue
        view = _view(recording, span, problem, other, model)
        phases.append(0.0 if view is None else _phase(view, hold.hold))
    return replace(hold, phases=tuple(phases))


def _recurs(
    hold: Hold, recordings: tuple[Recording, ...], spans: tuple[slice, ...], problem: Problem, model: Model
) -> bool:
    """Whether every half of a run that could show the hold has it."""
    for run, (recording, span) in enumerate(zip(recordings, spans, strict=True)):
        view = _view(recording, span, problem, run, model)
        for share, sd in () if view is None else _shares_of_halves(view, hold, run):
            if sd * TELLS < HALF * hold.share < abs(share - hold.share):
                return False
    return True


def _shares_of_halves(view: HeldDifferences, hold: Hold, run: int) -> list[tuple[float, float]]:
    """Share that is held in each half of a stretch, with its standard deviation."""
    dt, cells, found = view.exposure.motion.dt, view.cells, []
    for part in np.array_split(np.arange(len(view.left)), 2):
        if len(part) < PART:
            continue
        some = slice(int(part[0]), int(part[-1]) + 1)
        own = orthogonal(view.q[some])
        search = HeldDifferences(view.exposure, cells[some.start : some.stop + 1], own, outside(own, view.left[some]))
        gain = search.gain(hold.hold / dt, hold.phases[run] / dt)
        noise = max(gain.total - gain.share**2 * gain.size, 0.0) / (len(part) - own.shape[1] - 1)
        if gain.size > 0:
            found.append((gain.share, float(np.sqrt(noise / gain.size))))
    return found


def _phase(view: HeldDifferences, hold: float) -> float:
    """The phase at which a hold of that time explains most [s]."""
    dt = view.exposure.motion.dt
    ratio = hold / dt
    step = max(1.0, ratio // PHASES)
    best = max((float(k) for k in np.arange(0.0, ratio, step)), key=lambda k: view.of((ratio, k)))
    while step > 1:
        step = max(1.0, step // 2)
        best = max((best - step, best, best + step), key=lambda k: view.of((ratio, k)))
    return (best % ratio) * dt


def agrees(hold: Hold, share: float, sd: float) -> bool:
    """Whether the readings themselves tell a share, and the one that their differences from row to row do.

    A hold is one in slow motion as in fast. What a reference that was read now and then leaves from row to row is as
    large as it happens to be, and in the readings a hold of the right length is the lag of the reference.
    """
    if hold.whole:
        return True
    apart = abs(share - hold.share)
    return sd <= LARGEST_SD and apart <= max(HALF * hold.share, TELLS * float(np.hypot(sd, hold.share_sd)))


def without_hold(recording: Recording, problem: Problem, run: int, hold: Hold) -> Recording:
    """The recording with what the hold adds taken out of the target.

    Rows that still hold a value from before the recording are left out: nobody knows that value.
    """
    exposure, phase = aligned(recording, _whole(recording, problem, run)), hold.phases[run]
    channel, cell = recording.channels[problem.target], exposure.cell_of_row
    part = held_part(exposure.motion, exposure.u, hold.hold, phase)
    rows = _fitted_rows(problem, run) & (cell >= 0)
    added = _share(hold, channel.values[rows], (exposure.u + part)[cell[rows]]) * part
    values = channel.values - np.where(cell >= 0, added[np.maximum(cell, 0)], 0.0)
    freed = replace(recording, channels={**recording.channels, problem.target: replace(channel, values=values)})
    older = (cell < round((hold.hold - phase) / exposure.motion.dt)) & (phase > 0)
    older |= recording.left_out.get(problem.target, np.zeros(len(recording), dtype=bool))
    return leaving_out(freed, problem.target, older) if older.any() and not older.all() else freed


def _fitted_rows(problem: Problem, run: int) -> NDArray[np.bool_]:
    """Which rows of a run lie in fitted bins, shape (rows,)."""
    cell, fitted = problem.exposures[run].cell_of_row, np.zeros(len(problem.exposures[run].y), bool)
    fitted[problem.bins.fitted_cells(run)] = True
    return (cell >= 0) & fitted[np.maximum(cell, 0)]


def _share(hold: Hold, values: Floats, held: Floats) -> float:
    """The share that is held: of a reading that is repeated with its scale factor that, where the fit does not deny it.

    Taken out as one, it would leave a lag of half the hold times what the scale is off by.
    """
    about = held - held.mean() if len(held) else held
    power = float(about @ about)
    gain = float(about @ values) / power if power > 0 else 1.0
    own = abs(gain - 1) < SCALE and (hold.whole or abs(gain - hold.seen) < abs(1 - hold.seen))
    return gain if hold.share == 1.0 and own else hold.share


def held_addition(u: Floats, motion: Motion, theta: Floats, phase: float) -> Floats:
    """What `insenv.effects.timing.SampleHold` adds where a renewal was ``phase`` before the start of the run."""
    return float(theta[0]) * held_part(motion, u, float(theta[1]), phase)


def _whole(recording: Recording, problem: Problem, run: int) -> Exposure:
    reference = problem.exposures[run].motion.reference_temperature
    return expose(recording, problem.target, reference_temperature=reference)


def _cells(exposure: Exposure, span: slice) -> NDArray[np.int64]:
    """Consecutive cells of ``span``: of a long one the `MOST_ROWS` with the most acceleration."""
    cells = exposure.cell_of_row[span]
    cells = cells[cells >= 0]
    first = _liveliest(exposure, cells, MOST_ROWS)
    return cells[first : first + MOST_ROWS]


def _liveliest(exposure: Exposure, cells: NDArray[np.int64], count: int) -> int:
    """Where the ``count`` of the cells with the most acceleration begin."""
    if len(cells) <= count:
        return 0
    moved = np.concatenate([[0.0], np.cumsum(np.diff(exposure.u[cells]) ** 2)])
    return int(np.argmax(moved[count:] - moved[:-count]))


def _best(view: HeldDifferences) -> Look:
    """The hold that explains most of what is left, refined, if it is more than chance."""
    exposure, cells, q, left = view.exposure, view.cells, view.q, view.left
    first = _liveliest(exposure, cells, COARSE)
    few = slice(first, first + min(COARSE, len(cells)) - 1)
    own = orthogonal(q[few])
    coarse = HeldDifferences(exposure, cells[first : few.stop + 1], own, outside(own, left[few]))
    best = coarse.coarse()
    if best is None:
        return Look()
    best = view.refined(best)
    hold = _significant(view.gain(*best), best, exposure.motion.dt, len(left) - q.shape[1], best[0] / len(cells))
    small = view.gain(*best).share < LEAST_SHARE
    return Look(hold, hold is None and small and coarse.sees_all())


def _significant(found: HoldGain, best: tuple[float, float], dt: float, freedom: int, finest: float) -> Hold | None:
    """The hold, if chance or a skew would not do."""
    noise = max(found.total - found.gain, 0.0) / max(freedom - 3, 1)
    sd = float(np.sqrt(noise / found.size)) if found.size > 0 else np.inf
    looks = freedom * PHASES
    p = min(1.0, float(chdtrc(3, found.gain / noise)) * looks) if noise > 0 else 0.0
    if p > FALSE_ALARM or not LEAST_SHARE <= found.share <= MOST_SHARE or sd > LARGEST_SD * found.share:
        return None
    ratio, phase = best
    # An output is held whole, unless the samples say otherwise: what its share is off by would look like a skew.
    share = 1.0 if abs(found.share - 1.0) <= WHOLE * sd else found.share
    return Hold(share, sd, ratio * dt, finest * dt / np.sqrt(12), ((phase % ratio) * dt,), p, seen=found.share)
