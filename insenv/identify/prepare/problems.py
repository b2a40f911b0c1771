"""From recordings to problems: bin width, cells, declared model, and lines that the bins must reject."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from insenv.core.errors import InputError
from insenv.core.lazy import unanswered
from insenv.core.recording import Channel, Recording, Response
from insenv.data.manifest.spec import Manifest
from insenv.data.split import RowUse
from insenv.identify.clean.bursts import without_bursts
from insenv.identify.clean.corners import cornering
from insenv.identify.clean.doubtful import (
    Settled,
    doubted,
    measured_parts,
    rows_per_motion,
    rows_per_reading,
    settled,
)
from insenv.identify.clean.holds import LEAST_SHARE, WHOLE, Hold, Look, agrees, find_hold, without_hold
from insenv.identify.clean.knocks import knocks
from insenv.identify.clean.lost import lost_rows
from insenv.identify.clean.motion import at_rest
from insenv.identify.clean.outliers import leaving_out, without_outliers
from insenv.identify.clean.rails import Rail, find_rails, without_rails
from insenv.identify.clean.ramps import bending, jumping, slewed
from insenv.identify.clean.response.found import responding
from insenv.identify.clean.response.held import with_held
from insenv.identify.clean.response.sawtooth import MOST_SHARE
from insenv.identify.clean.triads import turns_left_out, without_turns
from insenv.identify.findings import RejectedRows, SampleSpectrum
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Model, Problem
from insenv.identify.prepare.binned import binned, enough
from insenv.identify.prepare.bounded import bounded, of_points
from insenv.identify.prepare.declared import declared_model
from insenv.identify.prepare.lines_of_samples import (
    confirmed,
    lines_of_samples,
    of_hold,
    recurring,
    recurs,
    slight,
    that_matter,
    without_folded,
)
from insenv.identify.prepare.means import (
    LEFT,
    ToldByMeans,
    begun_later,
    by_means,
    of_known_errors,
    of_unknown_errors,
)
from insenv.identify.prepare.rows_left import rows_left, sample_residual
from insenv.identify.prepare.samples import sample_spectrum
from insenv.identify.prepare.spectral.lines import (
    Line,
    folds,
)
from insenv.identify.prepare.spectral.lost_rows import longest
from insenv.identify.prepare.unsteady.spectrogram import RowsLeft
from insenv.identify.prepare.widths import rows_of_motion, rows_per_bin, whole_holds, whole_rows

#: Cycles of the slowest rejected line in a bin.
CYCLES_PER_BIN = 8
#: Share of its power to which the noise of means must fall for means twice as long, and fewest of these to fit.
QUIETER, FEWEST_QUIET = 0.5, 50


@dataclass(frozen=True)
class Prepared:
    """One target, ready for the search.

    Attributes
    ----------
    plain : Problem
        Bins as plain means: what the declared model is judged on.
    problem : Problem
        The bins that the search works on: the same, or with lines rejected.
    model : Model
        Declared terms.
    lines : tuple of Line
        Lines above the bin rate, in the samples that may be fitted.
    held : Look
        Whether the output is held; the bins that the search works on are free of that.
    rejected : tuple of RejectedRows
        Outlying rows, which no bin of ``problem`` holds.
    rails : tuple of Rail
        Values at which the target clips; ``plain`` has the rows at them.
    samples : callable
        Spectrum of the samples, when it is asked for.
    fast : callable
        Lines of the samples that means over so many seconds do not follow, and that held-out data have too.
    gains, skews : tuple of (float, float, float)
        Length of means [s], gain of the reading on a reference with errors by them, and its deviation, shortest first;
        the same of the skew [s].
    left : callable
        What a model leaves of the rows of each run.
    """

    plain: Problem
    problem: Problem
    model: Model
    lines: tuple[Line, ...]
    held: Look = Look()
    rejected: tuple[RejectedRows, ...] = ()
    rails: tuple[Rail, ...] = ()
    samples: Callable[[], SampleSpectrum | None] = field(default=lambda: None, repr=False, compare=False)
    fast: Callable[[float], tuple[Line, ...]] = field(default=unanswered, repr=False, compare=False)
    gains: tuple[tuple[float, float, float], ...] = ()
    skews: tuple[tuple[float, float, float], ...] = ()
    left: Callable[[Problem, Model], tuple[RowsLeft, ...]] = field(default=unanswered, repr=False, compare=False)


def prepare(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    target: str,
    tones: bool = True,
    holds: bool = True,
    width: float = 0.0,
) -> Prepared:
    """Bins and declared model of one target.

    Lines above the bin rate are looked for where ``tones`` may be found, an output that is held where ``holds`` may.
    Bins are at least ``width`` seconds long, unless the manifest says how long.
    """
    _series(manifest)
    model = declared_model(manifest, recordings, target)
    ready = _ready(manifest, recordings, uses, target, model, holds, width)
    own = ready.recordings, ready.uses, ready.plain, model
    every = lines_of_samples(*own) if tones else ()
    folded = tuple(x for x in every if folds(x, ready.plain.bins.width))
    seen = tuple(x for x in every if x not in folded)
    lines = recurring(that_matter(seen, ready.plain, ready.plain.bins.width), ready.plain)
    lines = tuple(line for line in lines if not _of_hold_or_motion(line, ready.held.hold, ready.plain))
    beside = slight(seen, lines, *own)
    lines = (*lines, *(x for x in beside if x.steady))
    rows = _rejecting_rows(manifest, ready, lines)
    if lines:
        problem = _without_lines(manifest, ready, lines, rows, model, target)
        lines, rows, problem = _quieter(manifest, ready, seen, (lines, rows, problem), model)
    plain = ready.plain if rows == ready.rows else binned(manifest, ready.measured, ready.uses, target, rows)
    if not lines:
        problem = plain if ready.held.hold is None else binned(manifest, ready.recordings, ready.uses, target, rows)
    plain = _clipping(manifest, ready.clean, ready.uses, target, rows, plain)
    plain, problem = (of_points(bounded(one, model)) for one in (plain, problem))
    folded = tuple(x for x in recurring(folded, plain) if not of_hold(x, ready.held.hold, plain) and recurs(x, *own))
    folded = tuple(replace(x, averaged=True) for x in (*folded, *beside) if not x.steady and x not in lines)
    problem = without_folded(problem, model, folded)
    samples = partial(_samples, ready.recordings, ready.uses, plain, model, lines)
    left = partial(rows_left, ready.recordings, ready.uses, lines=every)
    fast = partial(confirmed, *own) if tones else unanswered
    dt, rails = recordings[0].dt, ready.clean.rails
    elsewhere = begun_later(manifest, ready.measured, ready.uses, target, rows, model) if ready.means.skews else ()
    both = ready.means.gains, (*ready.means.skews, *elsewhere)
    gains, skews = (tuple((n * dt, c, sd) for n, c, sd in each) for each in both)
    told = (*lines, *folded)
    return Prepared(plain, problem, model, told, ready.held, ready.rejected, rails, samples, fast, gains, skews, left)


@dataclass(frozen=True)
class _Ready:
    """Recordings with their responses, without rows that are no measurements and without a hold, and their bins.

    ``measured`` ones have the hold still, and ``plain`` is of these. ``means`` tell where the reference has errors.
    """

    recordings: tuple[Recording, ...]
    measured: tuple[Recording, ...]
    uses: tuple[RowUse, ...]
    clean: _Clean
    rejected: tuple[RejectedRows, ...]
    held: Look
    rows: int
    plain: Problem
    means: ToldByMeans


def _ready(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    target: str,
    model: Model,
    holds: bool,
    width: float,
) -> _Ready:
    uses, moving = at_rest(manifest, recordings, uses, target)
    rows = rows_per_bin(manifest, recordings, uses, width)
    fit = tuple(use.fit for use in uses)
    recordings, jumps = _without_jumps(recordings, target)
    recordings = responding(recordings, _spans(recordings, uses), target, model, fit, forms=not holds)
    parts = doubted(recordings, _spans(recordings, uses), target, fit)
    told = settled(parts)
    rows = rows_of_motion(manifest, uses, max(rows_per_motion(parts, told), rows_per_reading(recordings)), rows)
    followed = told or settled(measured_parts(recordings, _spans(recordings, uses), target, fit))
    clean = _clean(recordings, target, rows, (*moving, *jumps), followed)
    recordings, rejected = clean.recordings, clean.rejected
    each = by_means(manifest, recordings, uses, target, rows, model) if followed else iter(())
    means = of_known_errors(each) if told else of_unknown_errors(each)
    rows = means.rows if means.gains else rows
    plain = binned(manifest, recordings, uses, target, rows)
    kept = without_turns(recordings, uses, plain, model)
    if kept is not uses:
        uses, rejected = kept, (*rejected, *turns_left_out(recordings, target))
        plain = binned(manifest, recordings, uses, target, rows)
    enough(manifest, plain, model, target)
    before = recordings, rows
    held, measured, recordings = _held(recordings, uses, plain, model) if holds else (Look(), recordings, recordings)
    rows = whole_holds(manifest, measured, uses, held.hold, rows)
    if measured is not before[0] or rows != before[1]:
        plain = binned(manifest, measured, uses, target, rows)
    return _Ready(recordings, measured, uses, clean, rejected, held, rows, plain, means)


def _rejecting_rows(manifest: Manifest, ready: _Ready, lines: tuple[Line, ...]) -> int:
    """Rows of a bin whose window rejects the lines that wander, if there are any."""
    wandering = [_rejecting(line) for line in lines if not line.steady]
    if not wandering or manifest.held_out.averaging is not None:
        return ready.rows
    return max(ready.rows, int(np.ceil(max(wandering) / ready.recordings[0].dt)))


def _without_lines(
    manifest: Manifest, ready: _Ready, lines: tuple[Line, ...], rows: int, model: Model, target: str
) -> Problem:
    """Bins with steady lines subtracted, and by a window that rejects those that wander if that leaves less.

    Errors of counts make up for each other from one plain mean to the next, and under a window they do not.
    """
    freed = tuple(_without_steady(r, target, lines, run) for run, r in enumerate(ready.recordings))
    problem = binned(manifest, freed, ready.uses, target, rows)
    if all(line.steady or line.of_counts for line in lines):
        return problem
    rejecting = binned(manifest, freed, ready.uses, target, rows, reject_lines=True)
    return rejecting if _scatter(rejecting, model) < _scatter(problem, model) else problem


def _quieter(
    manifest: Manifest,
    ready: _Ready,
    seen: tuple[Line, ...],
    so_far: tuple[tuple[Line, ...], int, Problem],
    model: Model,
) -> tuple[tuple[Line, ...], int, Problem]:
    """The same, of a unit at rest, by means twice as long as long as their noise becomes less by `QUIETER`.

    White noise is as loud in any means, for so long a mean. A dithered laser gyro has lines at 9 and 30 Hz and beside
    them others, a twentieth of these, that are most of what its means scatter by once these are rejected.
    """
    lines, rows, problem = so_far
    if problem.turns or manifest.held_out.averaging is not None:
        return so_far
    loud = _density(problem, model)
    while int((~problem.bins.held_out).sum()) >= 2 * FEWEST_QUIET:
        hidden = (x for x in that_matter(seen, problem, problem.bins.width) if x not in lines)
        more = (*lines, *hidden)
        found = _without_lines(manifest, ready, more, 2 * rows, model, problem.target)
        if (quiet := _density(found, model)) > QUIETER * loud:
            break
        lines, rows, problem, loud = more, 2 * rows, found, quiet
    return lines, rows, problem


def _without_jumps(
    recordings: tuple[Recording, ...], target: str
) -> tuple[tuple[Recording, ...], tuple[RejectedRows, ...]]:
    """The recordings without rows within which a table's rate jumps or bends: half of it would be told to be a lag."""
    jumps = tuple(row for run, r in enumerate(recordings) for row in jumping(r, target, run) or bending(r, target, run))
    jumps += tuple(row for run, r in enumerate(recordings) for row in cornering(r, target, run, jumps))
    return tuple(_leaving_out(r, target, run, jumps) for run, r in enumerate(recordings)), jumps


def _of_hold_or_motion(line: Line, hold: Hold | None, problem: Problem) -> bool:
    """Whether a line is that of a held output, or wanders and cannot be rejected but with the motion."""
    return of_hold(line, hold, problem) or not line.steady and not _leaves_motion(problem, _rejecting(line))


def _rejecting(line: Line) -> float:
    """Length of bins whose window rejects a line that wanders [s]."""
    return CYCLES_PER_BIN / line.frequency


def _leaves_motion(problem: Problem, length: float) -> bool:
    """Whether means over ``length`` seconds leave the motion of the table, if it turns.

    A line that is rejected at the price of the motion leaves nothing that tells of the instrument.
    """
    u, run = problem.bins.mean(tuple(e.u for e in problem.exposures)), problem.bins.run
    count = int(length / problem.bins.width)
    if count < 2 or not problem.turns:
        return True
    group = run * (len(u) // count + 1) + (np.arange(len(u)) - np.searchsorted(run, run)) // count
    own = np.unique(group, return_inverse=True)[1].ravel()
    means = (np.bincount(own, u) / np.bincount(own))[own]
    off = u - np.bincount(run, u)[run] / np.bincount(run)[run]
    return bool(np.sum((u - means) ** 2) <= (1 - LEFT) * np.sum(off**2))


def _series(manifest: Manifest) -> None:
    if manifest.procedure == "multi-position":
        raise InputError(
            f"{manifest.path}: model.procedure = 'multi-position' has rests, not a series in time; wanted another here"
        )


@dataclass(frozen=True)
class _Clean:
    """Recordings without rows that are no measurements; ``clipping`` ones still have those at the rails."""

    recordings: tuple[Recording, ...]
    clipping: tuple[Recording, ...]
    rejected: tuple[RejectedRows, ...]
    rails: tuple[Rail, ...]


def _clean(
    recordings: tuple[Recording, ...],
    target: str,
    longest: int,
    moving: tuple[RejectedRows, ...],
    told: tuple[Settled, ...],
) -> _Clean:
    rails = find_rails(recordings, target)
    free, clipped = without_rails(recordings, target, rails)
    # Where the gyro clips, means know nothing of what it would have read: no fault of the reference.
    lost = tuple(row for row in lost_rows(free, target, told) if not any(_touch(row, clip) for clip in clipped))
    free = tuple(_leaving_out(r, target, run, lost) for run, r in enumerate(free))
    free, outlying = without_outliers(free, target, longest)
    rang = tuple(k for run, r in enumerate(free) for k in knocks(r, target, run))
    rang = tuple(k for k in rang if not any(_overlap(k, m) for m in moving))
    free = tuple(_leaving_out(r, target, run, rang) for run, r in enumerate(free))
    outlying = (*lost, *outlying, *rang)
    free, events = without_bursts(free, target)
    events = tuple(e for e in events if not any(_overlap(e, m) for m in moving))
    others = (*moving, *outlying, *events)
    clipping = tuple(_leaving_out(r, target, run, others) for run, r in enumerate(recordings)) if rails else free
    tables = [slewed(recording, target).channels.get("table_rate") for recording in recordings]
    free, clipping = _on_tables(free, tables), _on_tables(clipping, tables)
    rejected = tuple(row for row in (*clipped, *others) if _in_use(row, recordings[row.run]))
    return _Clean(free, clipping, rejected, rails)


def _in_use(one: RejectedRows, recording: Recording) -> bool:
    """Whether some of the rows are fitted or held out."""
    return recording.unused is None or not bool(recording.unused[one.start : one.stop].all())


def _on_tables(recordings: tuple[Recording, ...], rates: list[Channel | None]) -> tuple[Recording, ...]:
    """The recordings with these rates of their tables, where they have one."""
    return tuple(
        r if rate is None else replace(r, channels={**r.channels, "table_rate": rate})
        for r, rate in zip(recordings, rates, strict=True)
    )


def _overlap(one: RejectedRows, other: RejectedRows) -> bool:
    return one.run == other.run and one.start < other.stop and other.start < one.stop


def _touch(one: RejectedRows, other: RejectedRows) -> bool:
    return one.run == other.run and one.start <= other.stop and other.start <= one.stop


def _leaving_out(recording: Recording, target: str, run: int, rejected: tuple[RejectedRows, ...]) -> Recording:
    """The recording with rejected rows of this run left out."""
    mask = np.zeros(len(recording), bool)
    for one in rejected:
        if one.run == run:
            mask[one.start : one.stop] = True
    return leaving_out(recording, target, mask) if mask.any() else recording


def _clipping(
    manifest: Manifest, clean: _Clean, uses: tuple[RowUse, ...], target: str, rows: int, plain: Problem
) -> Problem:
    """What the declared model is judged on: with the rows at a rail, which it takes for readings."""
    if not clean.rails:
        return plain
    return binned(manifest, clean.clipping, uses, target, rows)


def _held(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], plain: Problem, model: Model
) -> tuple[Look, tuple[Recording, ...], tuple[Recording, ...]]:
    """A held output, and the recordings with it and without it; their bins begin with a renewal."""
    spans, target = _spans(recordings, uses), plain.target
    look = find_hold(recordings, spans, plain, model)
    if look.hold is None or not look.hold.taken:
        unheld = _unheld(recordings, uses, target, model)
        return look, unheld, unheld
    hold = look.hold
    with_lags, beside = with_held(recordings, spans, target, hold.hold, hold.phases, hold.whole)
    if beside is not None:
        whole = hold.whole or abs(beside.share - 1.0) <= WHOLE * beside.share_sd
        share, sd = 1.0 if whole else beside.share, hold.share_sd if hold.whole else beside.share_sd
        if not LEAST_SHARE <= share <= MOST_SHARE or not agrees(hold, beside.share, beside.share_sd):
            unheld = _unheld(recordings, uses, target, model)
            return Look(), unheld, unheld
        hold = replace(hold, share=share, share_sd=sd, phases=beside.phases, seen=beside.share)
    recordings = with_lags
    freed = tuple(without_hold(r, plain, run, hold) for run, r in enumerate(recordings))
    if not whole_rows(hold, recordings[0].dt):
        return Look(hold), recordings, freed
    ahead = [round(phase / recordings[0].dt) for phase in hold.phases]

    def begun(runs: tuple[Recording, ...]) -> tuple[Recording, ...]:
        own = [replace(r.responses.get(target, Response()), ahead=n) for r, n in zip(runs, ahead, strict=True)]
        return tuple(replace(r, responses={**r.responses, target: one}) for r, one in zip(runs, own, strict=True))

    return Look(hold), begun(recordings), begun(freed)


def _unheld(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], target: str, model: Model
) -> tuple[Recording, ...]:
    """The recordings of an output that is not held, with the form of a lag, for which nobody looked so far."""
    if not any(r.responses.get(target, Response()).lag for r in recordings):
        return recordings
    others = [{name: one for name, one in r.responses.items() if name != target} for r in recordings]
    bare = tuple(replace(r, responses=own) for r, own in zip(recordings, others, strict=True))
    return responding(bare, _spans(recordings, uses), target, model, tuple(use.fit for use in uses))


def _spans(recordings: tuple[Recording, ...], uses: tuple[RowUse, ...]) -> tuple[slice, ...]:
    """The longest contiguous stretch of each run that may be fitted."""
    return tuple(longest(r, use.fit) for r, use in zip(recordings, uses, strict=True))


def _without_steady(recording: Recording, target: str, lines: tuple[Line, ...], run: int) -> Recording:
    """The recording with the steady lines of this run subtracted from the target, but for those of counts."""
    own = [line for line in lines if line.run == run and line.steady and line.own]
    if not own:
        return recording
    channel = recording.channels[target]
    t = recording.t - recording.t[0]
    values = channel.values - sum(line.at(t) for line in own)
    return replace(recording, channels={**recording.channels, target: replace(channel, values=values)})


def _scatter(problem: Problem, model: Model) -> float:
    """Bin-to-bin scatter of the fitted residual: what lines leave in the bins, free of slow structure."""
    left = problem.y - solve(problem, model).predicted()
    steps = np.concatenate([np.diff(left[b.start : b.stop]) for b in problem.fitted])
    return float(np.mean(steps**2))


def _density(problem: Problem, model: Model) -> float:
    """The same of a mean of one second, if it were white."""
    return _scatter(problem, model) * problem.bins.width


def _samples(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], problem: Problem, model: Model, lines: tuple[Line, ...]
) -> SampleSpectrum | None:
    """Spectrum of the samples of the run with the longest stretch that may be fitted."""
    spans = _spans(recordings, uses)
    run = max(range(len(spans)), key=lambda k: spans[k].stop - spans[k].start)
    values = sample_residual(recordings[run], spans[run], problem, model)
    own = tuple(line for line in lines if line.run == run)
    return sample_spectrum(values, recordings[run].dt, own, problem.bins.width)
