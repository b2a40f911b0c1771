"""From recordings to problems: bin width, cells, declared model, and lines that the bins must reject."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Recording, Response
from insenv.core.series.coarse import Coarse, coarse
from insenv.data.exposure import CHANNEL_OF, expose
from insenv.data.manifest.spec import Manifest
from insenv.data.reference import order
from insenv.data.split import RowUse
from insenv.effects.base import CurveEffect, DrivenEffect, NoiseEffect
from insenv.effects.catalogue import by_key
from insenv.effects.rate.scale import ScaleFactor
from insenv.effects.timing import TimingSkew
from insenv.identify.clean.bursts import without_bursts
from insenv.identify.clean.doubtful import Settled, agreeing, doubted, measured_parts, rows_per_motion, settled
from insenv.identify.clean.holds import LEAST_SHARE, MOST_SHARE, WHOLE, Hold, Look, agrees, find_hold, without_hold
from insenv.identify.clean.lost import lost_rows
from insenv.identify.clean.motion import at_rest
from insenv.identify.clean.outliers import leaving_out, outliers, without_outliers
from insenv.identify.clean.rails import Rail, find_rails, without_rails
from insenv.identify.clean.ramps import jumping, slewed
from insenv.identify.clean.response import responding, with_held
from insenv.identify.clean.triads import of_others, turns_left_out, without_turns
from insenv.identify.findings import RejectedRows, SampleSpectrum
from insenv.identify.fit.bins import gather
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Model, Problem, Term, regressors
from insenv.identify.prepare.lines import SAME_LINE, Line, find_lines, quantum
from insenv.identify.prepare.samples import sample_spectrum

#: Fitted bins aimed at, and the most that are used.
BINS, MOST_BINS = 2000, 20000
#: Cells of all runs together: where curves are evaluated.
MOST_CELLS = 60000
#: Bins per turn of the table, so that angle harmonics survive.
BINS_PER_TURN = 8
#: Share of the table's rate from which an axis lies along the table's: within half a degree.
ALONG = float(np.cos(np.deg2rad(0.5)))
#: Longest bin chosen unasked [s].
LONGEST_BIN = 5.0
#: Cycles of the slowest rejected line in a bin.
CYCLES_PER_BIN = 8
#: Share of the square sum of the motion that bins which reject a line must leave.
LEFT = 0.5
#: Share of the samples' variance from which a line is worth a word though the bins do not feel it.
LEAST_LINE = 0.01
#: Part of a row by which a hold time may be off a whole number of them; fitted bins that must be left of whole holds.
WHOLE_ROWS, FEWEST_BINS = 1e-3, 200
#: Share of the square sum of the acceleration below the frequency that the motion reaches.
MOTION = 0.95


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
    """

    plain: Problem
    problem: Problem
    model: Model
    lines: tuple[Line, ...]
    held: Look = Look()
    rejected: tuple[RejectedRows, ...] = ()
    rails: tuple[Rail, ...] = ()
    samples: Callable[[], SampleSpectrum | None] = field(default=lambda: None, repr=False, compare=False)


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
    uses, moving = at_rest(manifest, recordings, uses, target)
    rows = _rows_per_bin(manifest, recordings, uses, width)
    fit = tuple(use.fit for use in uses)
    recordings, jumps = _without_jumps(recordings, target)
    recordings = responding(recordings, _spans(recordings, uses), target, model, fit, forms=not holds)
    told = settled(parts := doubted(recordings, _spans(recordings, uses), target, fit))
    rows = _rows_of_motion(manifest, uses, rows_per_motion(parts, told), rows)
    followed = told or settled(measured_parts(recordings, _spans(recordings, uses), target, fit))
    recordings, rejected = (
        (clean := _clean(recordings, target, rows, (*moving, *jumps), followed)).recordings,
        clean.rejected,
    )
    rows = _agreeing(manifest, recordings, uses, target, rows, model) if told else rows
    plain = _problem(manifest, recordings, uses, target, rows, reject_lines=False)
    kept = without_turns(recordings, uses, plain, model)
    if kept is not uses:
        uses, rejected = kept, (*rejected, *turns_left_out(recordings, target))
        plain = _problem(manifest, recordings, uses, target, rows, reject_lines=False)
    _enough(manifest, plain, model, target)
    held, measured, recordings = _held(recordings, uses, plain, model) if holds else (Look(), recordings, recordings)
    rows = _whole_holds(manifest, measured, uses, held.hold, rows)
    plain = _problem(manifest, measured, uses, target, rows, reject_lines=False)
    lines = _recurring(_lines(recordings, uses, plain, model), plain) if tones else ()
    lines = tuple(line for line in lines if not _of_hold_or_motion(line, held.hold, plain))
    if not lines:
        free = plain if held.hold is None else _problem(manifest, recordings, uses, target, rows, reject_lines=False)
        plain = _clipping(manifest, clean, uses, target, rows, plain)
        return Prepared(
            plain, free, model, (), held, rejected, clean.rails, partial(_samples, recordings, uses, plain, model, ())
        )
    wandering = [line.frequency for line in lines if not line.steady]
    if wandering and manifest.held_out.averaging is None:
        wide = int(np.ceil(max(_rejecting(line) for line in lines if not line.steady) / recordings[0].dt))
        if wide > rows:
            rows = wide
            plain = _problem(manifest, measured, uses, target, rows, reject_lines=False)
    freed = tuple(_without_steady(r, target, lines, run) for run, r in enumerate(recordings))
    problem = _problem(manifest, freed, uses, target, rows, reject_lines=False)
    if wandering:
        rejecting = _problem(manifest, freed, uses, target, rows, reject_lines=True)
        if _scatter(rejecting, model) < _scatter(problem, model):
            problem = rejecting
    plain = _clipping(manifest, clean, uses, target, rows, plain)
    return Prepared(
        plain, problem, model, lines, held, rejected, clean.rails,
        partial(_samples, recordings, uses, plain, model, lines),
    )  # fmt: skip


def _without_jumps(
    recordings: tuple[Recording, ...], target: str
) -> tuple[tuple[Recording, ...], tuple[RejectedRows, ...]]:
    """The recordings without rows within which a table's rate jumps: half of a jump would be told to be a lag."""
    jumps = tuple(row for run, r in enumerate(recordings) for row in jumping(r, target, run))
    return tuple(_leaving_out(r, target, run, jumps) for run, r in enumerate(recordings)), jumps


def _recurring(lines: tuple[Line, ...], problem: Problem) -> tuple[Line, ...]:
    """Lines without those that wander and stand in one of several runs alone beside a table: the table shook so."""
    if not problem.turns or len({block.run for block in problem.fitted}) == 1:
        return lines

    def again(line: Line) -> bool:
        """Whether another run has it, as near as either wanders."""
        far = [max(SAME_LINE, line.frequency_sd, one.frequency_sd) for one in lines]
        near = [abs(one.frequency - line.frequency) < reach for one, reach in zip(lines, far, strict=True)]
        return any(close and one.run != line.run for close, one in zip(near, lines, strict=True))

    return tuple(line for line in lines if line.steady or again(line))


def _of_hold_or_motion(line: Line, hold: Hold | None, problem: Problem) -> bool:
    """Whether a line is that of a held output, or wanders and cannot be rejected but with the motion."""
    if hold is not None and _of_hold(line, hold, problem):
        return True
    return not line.steady and not _leaves_motion(problem, _rejecting(line))


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
    outlying = (*lost, *outlying)
    free, events = without_bursts(free, target)
    events = tuple(e for e in events if not any(_overlap(e, m) for m in moving))
    others = (*moving, *outlying, *events)
    clipping = tuple(_leaving_out(r, target, run, others) for run, r in enumerate(recordings)) if rails else free
    tables = [slewed(recording, target).channels.get("table_rate") for recording in recordings]
    free, clipping = _on_tables(free, tables), _on_tables(clipping, tables)
    return _Clean(free, clipping, (*clipped, *others), rails)


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
    return _problem(manifest, clean.clipping, uses, target, rows, reject_lines=False)


def _held(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], plain: Problem, model: Model
) -> tuple[Look, tuple[Recording, ...], tuple[Recording, ...]]:
    """A held output, and the recordings with it and without it; their bins begin with a renewal."""
    spans, target = _spans(recordings, uses), plain.target
    look = find_hold(recordings, spans, plain, model)
    if look.hold is None:
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
        hold = replace(hold, share=share, share_sd=sd, phases=beside.phases)
    recordings = with_lags
    freed = tuple(without_hold(r, plain, run, hold) for run, r in enumerate(recordings))
    if not _whole_rows(hold, recordings[0].dt):
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


def _rows_of_motion(manifest: Manifest, uses: tuple[RowUse, ...], told: int, rows: int) -> int:
    """Rows of a bin that holds no faster motion than measured references tell, if enough bins are left."""
    if manifest.held_out.averaging is not None:
        return rows
    wide = min(told, sum(int(use.fit.sum()) for use in uses) // FEWEST_BINS)
    return _divisible(wide, sum(len(use.fit) for use in uses)) if wide > rows else rows


def _agreeing(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    target: str,
    rows: int,
    model: Model,
) -> int:
    """Rows of the shortest bins from which on the gain is that of longer ones, by the noise and the weights of the fit.

    Noise that the fit takes for slow gives fast motion weight, of which a reference with errors tells the least.
    """
    fitted, found = sum(int(use.fit.sum()) for use in uses), []
    free = (*(t for t in model if not isinstance(t.effect, (ScaleFactor, TimingSkew))), Term(ScaleFactor()))
    wide = rows
    while manifest.held_out.averaging is None and (wide == rows or fitted >= FEWEST_BINS * wide):
        problem = _problem(manifest, recordings, uses, target, wide, reject_lines=False)
        fit = solve(problem, (*free, Term(TimingSkew(), per_run=True)))
        own = np.flatnonzero(fit.design.term == len(free) - 1)
        if not len(own):
            break
        found.append((wide, float(fit.theta[own[0]]), float(fit.sd[own[0]])))
        wide *= 2
    return agreeing(found) if found else rows


def _whole_rows(hold: Hold, dt: float) -> bool:
    return abs(hold.hold / dt - round(hold.hold / dt)) < WHOLE_ROWS


def _whole_holds(
    manifest: Manifest, recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], hold: Hold | None, rows: int
) -> int:
    """Rows of a bin that holds whole renewals: within one, noise is held too, and is not white."""
    dt = recordings[0].dt
    if hold is None or manifest.held_out.averaging is not None or not _whole_rows(hold, dt):
        return rows
    each = round(hold.hold / dt)
    wide = each * -(-rows // each)
    return wide if sum(int(use.fit.sum()) for use in uses) >= FEWEST_BINS * wide else rows


def _spans(recordings: tuple[Recording, ...], uses: tuple[RowUse, ...]) -> tuple[slice, ...]:
    """The longest contiguous stretch of each run that may be fitted."""
    return tuple(_longest_fitted(r, use) for r, use in zip(recordings, uses, strict=True))


def _without_steady(recording: Recording, target: str, lines: tuple[Line, ...], run: int) -> Recording:
    """The recording with the steady lines of this run subtracted from the target."""
    own = [line for line in lines if line.run == run and line.steady]
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


def declared_model(manifest: Manifest, recordings: tuple[Recording, ...], target: str) -> Model:
    """Terms of the declared effects.

    Raises
    ------
    InputError
        If a declared effect is unknown, is noise or driven by it, has a shape to be searched, or needs a channel that
        is not there.
    """
    where = f"{manifest.path}: model.declared"
    motions = [expose(r, target).motion for r in (_head(recording) for recording in recordings)]
    terms = []
    for key in manifest.model.declared:
        effect = by_key(key, where=where)
        if of_others(manifest, recordings, target, effect, motions):
            continue
        if isinstance(effect, NoiseEffect):
            raise InputError(f"{where} names {key!r}, which is noise; wanted it in the [noise] table")
        if isinstance(effect, DrivenEffect):
            raise InputError(f"{where} names {key!r}, which is driven by chance and cannot be fitted; leave it out")
        if isinstance(effect, CurveEffect) and effect.shapes:
            names = " and ".join(p.name for p in effect.shapes)
            raise InputError(f"{where} names {key!r}, whose {names} would have to be found first; leave it out")
        missing = sorted({CHANNEL_OF.get(n.partition(".")[0], n) for m in motions for n in effect.missing(m)})
        if effect.of_earth:
            _wants_latitude(recordings, where)
            missing = []
        if missing:
            raise InputError(f"{where} names {key!r}, which needs the channel {', '.join(missing)}; the file has none")
        if not effect.of_earth or any(_sees_north(m) for m in motions):
            # On an accelerometer that turns, that wave is how the table leans: in each run as it was set up then.
            leans = effect.of_earth and target.startswith("accel")
            terms.append(Term(effect, per_run=leans or effect.id == "bias" and _bias_per_run(manifest, recordings)))
    return tuple(terms)


def _sees_north(motion: Motion) -> bool:
    """Whether the axis turns through the horizontal Earth rate: not where it lies along the table's, or nothing turns.

    Its known vertical part needs no term. What a mount that is not quite along the axis sees is found like any effect.
    """
    return motion.angle is not None and abs(motion.projection) < ALONG


def _head(recording: Recording) -> Recording:
    """The first rows of a recording: enough to see which references there are."""
    channels = {n: replace(c, values=c.values[:16]) for n, c in recording.channels.items()}
    left_out = {name: mask[:16] for name, mask in recording.left_out.items()}
    return replace(recording, t=recording.t[:16], channels=channels, segments=(), left_out=left_out)


def _wants_latitude(recordings: tuple[Recording, ...], where: str) -> None:
    for recording in recordings:
        if recording.site.latitude is None:
            raise InputError(f"{where} names 'earth_rate', which needs site.latitude; the manifest has none")


def _bias_per_run(manifest: Manifest, recordings: tuple[Recording, ...]) -> bool:
    """A bias belongs to its power-up, unless it is said to be common or the runs are positions of one set-up."""
    if manifest.model.bias is not None:
        return manifest.model.bias == "per-run"
    return len({replace(recording.mounting, base_turned=0.0) for recording in recordings}) == 1


def _rows_per_bin(
    manifest: Manifest, recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], least: float = 0.0
) -> int:
    """Rows of a bin, which is at least ``least`` seconds long where the manifest says nothing."""
    dt = recordings[0].dt
    for recording in recordings:
        if abs(recording.dt / dt - 1) > 0.02:
            raise InputError(
                f"{recording.label}: sampled every {recording.dt:.6g} s, {recordings[0].label} every {dt:.6g} s; "
                "wanted one rate for all runs"
            )
    if manifest.held_out.averaging is not None:
        rows = int(round(manifest.held_out.averaging / dt))
        if rows < 1:
            raise InputError(
                f"{manifest.path}: held_out.averaging = {manifest.held_out.averaging:g} s is shorter than the "
                f"sampling period, {dt:g} s"
            )
        if rows > max(map(len, recordings)):
            raise InputError(
                f"{manifest.path}: held_out.averaging = {manifest.held_out.averaging:g} s is longer than the "
                f"recording, {max(len(r) * r.dt for r in recordings):g} s"
            )
        return rows
    if least:
        return round(least / dt)
    fitted = sum(int(use.fit.sum()) for use in uses) * dt
    width = min(_nice(fitted / BINS), LONGEST_BIN)
    turn = min((_quickest_turn(r) for r in recordings), default=np.inf)
    width = max(min(width, turn / BINS_PER_TURN), fitted / MOST_BINS)
    return _divisible(max(_fewest_rows(recordings), int(round(width / dt))), sum(map(len, recordings)))


def _fewest_rows(recordings: tuple[Recording, ...]) -> int:
    """Two rows of a bin where a noisy angle is read between its edges: neighbouring bins would share a reading."""
    noisy = [r.table is not None and not r.table.still and r.table.of == "angle" for r in recordings]
    return 2 if any(noisy) else 1


def _nice(x: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that does not exceed ``x``."""
    power = 10.0 ** np.floor(np.log10(x))
    return float(power * max(m for m in (1, 2, 5) if m * power <= x * (1 + 1e-9)))


def _quickest_turn(recording: Recording) -> float:
    """Shortest time that the table takes for a turn [s]."""
    n = min(max(2, len(recording) // 1000), len(recording) - 1)
    if "table_angle" in recording.channels:
        angle = recording.channels["table_angle"].values
        rate = float(np.abs((angle[n:] - angle[:-n]) / (recording.t[n:] - recording.t[:-n])).max())
    elif "table_rate" in recording.channels:
        rate = float(np.abs(recording.channels["table_rate"].values).max())
    else:
        return np.inf
    return 2 * np.pi / rate if rate > 0 else np.inf


def _divisible(rows_per_bin: int, total_rows: int) -> int:
    """As many rows to a bin, or a few less where their cells would be whole bins: 13 rows have no other divisor.

    Within a long cell the table changes its rate, and what is not linear in the rate is wrong there.
    """
    most = 2 * max(1.0, total_rows / MOST_CELLS)
    tried = range(rows_per_bin, int(0.8 * rows_per_bin), -1)
    return next((n for n in tried if _rows_per_cell(n, total_rows) <= most), rows_per_bin)


def _rows_per_cell(rows_per_bin: int, total_rows: int) -> int:
    """The smallest divisor of a bin that keeps the number of cells in bounds."""
    least = max(1.0, total_rows / MOST_CELLS)
    return min(d for d in range(1, rows_per_bin + 1) if rows_per_bin % d == 0 and (d >= least or d == rows_per_bin))


def _problem(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    target: str,
    rows_per_bin: int,
    reject_lines: bool,
) -> Problem:
    per_cell = _rows_per_cell(rows_per_bin, sum(map(len, recordings)))
    with_earth = "earth_rate" in manifest.model.declared
    reference = manifest.model.reference_temperature
    exposures = tuple(expose(r, target, per_cell, reference, with_earth) for r in recordings)
    bins = gather(
        exposures,
        tuple(u.fit for u in uses),
        tuple(u.held_out for u in uses),
        rows_per_bin // per_cell,
        per_cell,
        reject_lines,
    )
    if not any(b.fitted for b in bins.blocks) or all(b.fitted for b in bins.blocks):
        kind = "held-out" if any(b.fitted for b in bins.blocks) else "fitted"
        raise InputError(
            f"{manifest.path}: no whole bin of {bins.width:g} s lies in the {kind} rows of {target!r}; "
            "wanted longer stretches or a shorter held_out.averaging"
        )
    y = bins.mean(tuple(e.y - e.motion.rate for e in exposures))
    turning = any(np.ptp(e.u) for e in exposures)
    out = () if turning else outliers(y, bins.blocks)
    rounded = _coarse(recordings, target) if turning else None
    exact = turning and all(_commanded(recording) for recording in recordings)
    unit = recordings[0].channels[target].unit
    return Problem(target, unit, exposures, bins, y, out, commanded=exact, coarse=rounded)


def _commanded(recording: Recording) -> bool:
    """Whether the reference is a command, or has no noise of its own."""
    names = order(recording)
    return bool(names) and recording.channels[names[0]].source == "command"


def _coarse(recordings: tuple[Recording, ...], target: str) -> Coarse | None:
    """What rounding of a target that is read at instants leaves, in the run in which it leaves most."""
    if recordings[0].channels[target].covers == "interval":
        return None
    rates = [r.channels.get("table_rate") for r in recordings]
    each = [
        coarse(r.channels[target].values, None if rate is None else rate.values)
        for r, rate in zip(recordings, rates, strict=True)
    ]
    return max((one for one in each if one is not None), key=lambda one: one.rms, default=None)


def _enough(manifest: Manifest, problem: Problem, model: Model, target: str) -> None:
    bins = sum(b.n for b in problem.fitted)
    parameters = sum(len(problem.names(term)) for term in model)
    if bins < parameters + 8:
        raise InputError(
            f"{manifest.path}: {target!r} has {bins} fitted bins of {problem.bins.width:g} s for {parameters} "
            "declared parameters and the noise; wanted at least "
            f"{parameters + 8}: a longer recording or a shorter held_out.averaging"
        )


def _lines(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], problem: Problem, model: Model
) -> tuple[Line, ...]:
    """Lines above the bin rate that matter, in the longest contiguous stretch of each run that may be fitted."""
    found: list[Line] = []
    for run, (recording, use) in enumerate(zip(recordings, uses, strict=True)):
        span = _longest_fitted(recording, use)
        t = (recording.t - recording.t[0])[span]
        step = quantum(recording.channels[problem.target].values[span]) * recording.dt
        values = _sample_residual(recording, span, problem, model)
        found += find_lines(t, recording.dt, values, step, run, 0.6 / problem.bins.width)
    noise = _bin_noise(problem)
    return tuple(x for x in found if _matters(x, problem.bins.width, noise))


def _samples(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], problem: Problem, model: Model, lines: tuple[Line, ...]
) -> SampleSpectrum | None:
    """Spectrum of the samples of the run with the longest stretch that may be fitted."""
    spans = _spans(recordings, uses)
    run = max(range(len(spans)), key=lambda k: spans[k].stop - spans[k].start)
    values = _sample_residual(recordings[run], spans[run], problem, model)
    own = tuple(line for line in lines if line.run == run)
    return sample_spectrum(values, recordings[run].dt, own, problem.bins.width)


def _of_hold(line: Line, hold: Hold, problem: Problem) -> bool:
    """Whether a line is what a hold leaves: a sideband of its renewals, no further off than the motion reaches."""
    exposure = problem.exposures[line.run]
    power = np.abs(np.fft.rfft(np.diff(exposure.u))) ** 2
    share = np.cumsum(power) / max(float(power.sum()), 1e-300)
    reach = float(np.searchsorted(share, MOTION)) / (len(exposure.u) - 1) / exposure.motion.dt
    off = line.frequency * hold.hold
    return abs(off - round(off)) / hold.hold <= 2 * reach and round(off) > 0


def _matters(line: Line, width: float, noise: float) -> bool:
    """Whether a line is a visible part of the samples, or leaks into the bins beside their own noise."""
    return line.share > LEAST_LINE or line.amplitude / (np.pi * line.frequency * width) > noise


def _bin_noise(problem: Problem) -> float:
    """Scatter from bin to bin, robust against the lines themselves being in it: of one bin."""
    steps = np.concatenate([np.diff(problem.y[b.start : b.stop]) for b in problem.fitted if b.n > 1])
    return float(np.median(np.abs(steps)) / 0.6745 / np.sqrt(2)) if len(steps) else 0.0


def _longest_fitted(recording: Recording, use: RowUse) -> slice:
    """Longest stretch of consecutive fitted rows without a gap."""
    best = slice(0, 0)
    for piece in recording.pieces():
        edges = np.flatnonzero(np.diff(np.concatenate([[0], use.fit[piece].astype(int), [0]])))
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            if b - a > best.stop - best.start:
                best = slice(piece.start + int(a), piece.start + int(b))
    return best


def _sample_residual(recording: Recording, span: slice, problem: Problem, model: Model) -> Floats:
    """Samples of ``span`` minus the reference and what the declared effects explain of them, shape (rows,).

    Commanded motion and a scale factor that is declared are no lines. Bins may have averaged that motion away, so the
    coefficients are fitted to the samples themselves.
    """
    values = recording.channels[problem.target].values[span]
    if not {"table_angle", "table_rate"} & set(recording.channels):
        return values
    reference = problem.exposures[0].motion.reference_temperature
    exposure = expose(recording, problem.target, reference_temperature=reference)
    cell = exposure.cell_of_row[span]
    inside = cell >= 0
    bases = [regressors(term.effect, exposure, term.shape)[cell[inside]] for term in model]
    if exposure.motion.lag:
        bases.append(regressors(TimingSkew(), exposure, ())[cell[inside]])  # what is late is no line
    columns = np.column_stack([np.ones(int(inside.sum())), *bases])
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    left = np.zeros(len(values))
    sample = values[inside] - exposure.motion.rate[cell[inside]]
    left[inside] = sample - columns @ np.linalg.lstsq(columns, sample, rcond=1e-9)[0]
    return left
