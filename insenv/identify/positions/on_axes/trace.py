"""Closing the loop on a whole unit on a table whose axes are read: what its declared model lacks.

All rests and turns of the six channels are one problem (`problem`), and what the table, the unit's seat and the
instruments may do are candidates side by side (`terms`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc  # scipy.stats is slow to import

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Limits
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.series.robust import MEDIAN
from insenv.core.unit.gimbals import Gimbals
from insenv.core.unit.motion import UNIT
from insenv.data.manifest import Manifest
from insenv.data.split import split
from insenv.effects.base import Effect
from insenv.effects.catalogue import by_key
from insenv.effects.noise import AngleRandomWalk
from insenv.identify.findings import NextExperiment
from insenv.identify.positions.least_squares import Fit
from insenv.identify.positions.on_axes.next import limits_of, next_runs, plans
from insenv.identify.positions.on_axes.problem import Cells, OnAxes, UnitTerm, as_noisy_as_read, foretold
from insenv.identify.positions.on_axes.terms import (
    SLIP,
    Candidates,
    Raw,
    able,
    candidates,
    changes,
    excess,
    whole_sheet,
)
from insenv.identify.positions.search import Outcome, Step, as_told, search
from insenv.information.positions import QUARTER
from insenv.information.unit.calibration import Blocks, UnitModel, gathered, joined, nothing

#: Where the manifest holds nothing out, every so-manieth rest is.
EVERY = 4
#: Angle by which an axis turns in a sample [rad], where no channel says so.
_TURNS = 1e-5
#: What the order of turns that two axes make at once may change the attitude by [rad].
_AT_ONCE = 1e-5
#: Probability, of a residual that is noise, below which something is left.
_LEFT = 1e-3
#: How often a mounting slips at most.
MOST_SLIPS = 2


@dataclass(frozen=True)
class UnitFound:
    """What was found: the problem, what was tried, the search's outcome, and why what is left is no noise."""

    problem: OnAxes
    tried: tuple[UnitTerm, ...]
    outcome: Outcome
    reasons: tuple[str, ...]
    rests: int
    remarks: tuple[str, ...] = ()
    next_runs: tuple[NextExperiment, ...] = ()


def on_axes(recordings: Sequence[Recording]) -> bool:
    """Whether recordings are of a unit on a table whose axes are read."""
    return all(
        r.mounting.gimbals is not None
        and all(f"axis_{m}" in r.channels for m in range(1, len(r.mounting.gimbals.axes) + 1))
        and all(name in r.channels for name in UNIT)
        for r in recordings
    )


def trace_unit(
    manifest: Manifest,
    recordings: Sequence[Recording],
    tried: Sequence[Effect] | None = None,
    alpha: float = 0.01,
    progress: Callable[[str], None] = lambda text: None,
) -> UnitFound:
    """Find what the declared model of a unit and its table lacks.

    Raises
    ------
    InputError
        If gravity is not known, runs are on other tables, a declared effect is none of a unit, or there are no turns.
    """
    _check(manifest, recordings)
    warm = all("temperature" in r.channels and changes(r.channels["temperature"].values) for r in recordings)
    progress("rests and turns")
    sheets = [_sheet(manifest, recording) for recording in recordings]
    models = [UnitModel(whole_sheet(sheet, warm), in_turns=True) for sheet in sheets]
    for recording in recordings:
        _check_one_by_one(manifest, recording)
    runs = [_with_turning(as_means(recording)) for recording in recordings]
    blocks = [_blocks(manifest, model, run) for model, run in zip(models, runs, strict=True)]
    starts = np.cumsum([0.0, *(float(r.t[-1] - r.t[0]) for r in recordings[:-1])])
    numbers, rests = _numbered(blocks)
    held = _held_out(manifest, recordings, blocks, (numbers, rests))
    size = models[0].size * models[0].sheet.dt
    slips = [
        float(start + size * t)
        for start, block in zip(starts, blocks, strict=True)
        for t in np.flatnonzero(np.diff(block.turning[0].astype(int)) == 1) + 1
    ]
    keys = None if tried is None else [effect.id for effect in tried]
    terms = candidates(manifest.model.declared, models[0].gimbals, slips, keys, warm)
    layout = _layout([model.gimbals for model in models], sheets[0])
    cells = [
        cell
        for row, model in enumerate(models)
        for cell in _cells(model, blocks[row], _excess(model, runs[row], warm), terms, layout,
                           (float(starts[row]), row), (numbers[row], held[row]))
    ]  # fmt: skip
    problem = OnAxes(tuple(cells), (1.0,) * len(cells), np.array([sd for _, _, sd in layout]))
    # A slip at any turn takes up all that one rest is off by: the noise is looked at without.
    whole = [*terms.declared, *(term for term in terms.tried if term.shape is None)]
    problem = foretold(as_noisy_as_read(problem, whole), terms.declared)
    progress("candidates")
    terms = replace(terms, tried=tuple(as_told(problem, terms.declared, terms.tried)))
    outcome = search(problem, terms.declared, terms.tried, alpha, at_once=1)
    reasons = (*_structure(problem, outcome.after), *_slipped_often(outcome.steps))
    further: tuple[NextExperiment, ...] = ()
    if any(outcome.rivals.values()):
        progress("what to measure next")
        end = float(starts[-1] + recordings[-1].t[-1] - recordings[-1].t[0])
        further = _next(models[0], limits_of(recordings), (problem, outcome), terms, layout, (end, len(runs)))
    return UnitFound(problem, terms.tried, outcome, reasons, rests, (_said(rests, held, numbers),), further)


#: Columns of the table's errors of which a deviation is stated: name, angle of mounting (None: of all runs), deviation.
Layout = tuple[tuple[str, float | None, float], ...]


def _layout(tables: Sequence[Gimbals], sheet: Datasheet) -> Layout:
    """One seat for each angle at which the unit was mounted, and for one that may be proposed."""
    assert sheet.mounting.gimbals is not None
    mounts = dict.fromkeys([*(table.mounted for table in tables), tables[0].mounted + QUARTER])
    found: list[tuple[str, float | None, float]] = []
    for name, sd in zip(sheet.mounting.gimbals.names, sheet.mounting.gimbals.sd, strict=True):
        if sd > 0:
            found += [(name, mount, sd) for mount in (mounts if name.startswith("mounting") else [None])]
    return tuple(found)


def _next(
    model: UnitModel,
    limits: Limits,
    found: tuple[OnAxes, Outcome],
    terms: Candidates,
    layout: Layout,
    begun: tuple[float, int],
) -> tuple[NextExperiment, ...]:
    """What would tell what was added from its rivals."""
    problem, outcome = found
    made = []
    for plan in plans(model, limits):
        blocks = plan.blocks()
        count = blocks.turning.shape[-1]
        still = excess(np.arange(count + 1.0), np.full(count + 1, 298.15), 298.15)
        fitted = np.ones(count, np.int64), np.zeros(count, bool)
        made.append((plan, _cells(plan.model, blocks, still, terms, layout, begun, fitted)))
    sets = {
        step.term.effect.key: (step.term, [t for t in _shaped(terms.tried, outcome.rivals[step.term.effect.key])])
        for step in outcome.steps
        if outcome.rivals.get(step.term.effect.key)
    }
    return next_runs(problem, outcome.after, list(sets.values()), made)


def _shaped(tried: Sequence[UnitTerm], keys: Sequence[str]) -> list[UnitTerm]:
    """A term of each of the keys: of those with shapes the one in the middle."""
    found = []
    for key in keys:
        own = [term for term in tried if term.effect.key == key]
        found.append(own[len(own) // 2])
    return found


def _check(manifest: Manifest, recordings: Sequence[Recording]) -> None:
    path = manifest.path
    if any(r.site.local_gravity is None for r in recordings):
        raise InputError(f"{path}: neither site.gravity nor site.latitude; a unit on axes wants one of them")
    if len({r.mounting.gimbals.axes for r in recordings if r.mounting.gimbals}) > 1:
        raise InputError(f"{path}: runs on tables with other axes; wanted one table")
    for key in manifest.model.declared:
        if by_key(key).id not in able():
            names = ", ".join(sorted(able()))
            raise InputError(f"{path}: model.declared has {key!r}; of a unit on axes wanted some of {names}")


def _sheet(manifest: Manifest, recording: Recording) -> Datasheet:
    """What is known of a run: noise as stated, or white as neighbouring samples differ."""
    dt = recording.dt
    noise = {}
    for target in UNIT:
        stated = {k: v for k, v in manifest.noise.get(target, {}).items() if v > 0}
        steps = np.diff(recording.channels[target].values)
        white = float(np.median(np.abs(steps))) / MEDIAN / np.sqrt(2) * np.sqrt(dt)
        noise[target] = stated or {AngleRandomWalk.id: max(white, 1e-12)}
    gravity = recording.site.local_gravity
    return Datasheet(
        sampling=1.0 / dt,
        duration=len(recording) * dt,
        site=replace(recording.site, gravity=gravity),
        mounting=recording.mounting,
        noise=noise,
        reference_temperature=manifest.model.reference_temperature,
    )


def _steps(recording: Recording) -> Floats:
    """Angles by which the axes turn in the samples, zero where that is noise, shape (k, n)."""
    assert recording.mounting.gimbals is not None
    noise, axes = recording.mounting.gimbals.noise, recording.mounting.gimbals.axes
    angles = np.stack([recording.channels[f"axis_{m + 1}"].values for m in range(len(axes))])
    steps = np.abs(np.diff(angles, axis=1, prepend=angles[:, :1]))
    return np.where(steps > max(_TURNS, 6 * noise), steps, 0.0)


def _check_one_by_one(manifest: Manifest, recording: Recording) -> None:
    """Turns about two axes at once have no order, in which what a gyro sums up would be known."""
    steps = _steps(recording)
    half_products = 0.25 * (steps.sum(axis=0) ** 2 - (steps**2).sum(axis=0))
    if half_products.sum() > _AT_ONCE:
        rows = np.flatnonzero(half_products)
        where = f"at {recording.t[rows[0]]:g} s and in {len(rows)} rows in all"
        raise InputError(
            f"{manifest.path}: {recording.label}: two axes turn at once, {where}; wanted one axis after the other"
        )


def as_means(recording: Recording) -> Recording:
    """The recording with readings at an instant as means over the interval that ends there, by the trapezoidal rule.

    The cells are means over rows: taken for these, an accelerometer's reading at an instant is half a row late, and of
    nothing a `force_delay` of half a row was stated.
    """
    found = {
        name: replace(recording.channels[name], values=_means(recording.channels[name].values), covers="interval")
        for name in UNIT
        if recording.channels[name].covers == "instant"
    }
    return replace(recording, channels={**recording.channels, **found})


def _means(values: Floats) -> Floats:
    """Mean of each value and the one before it; of the first alone."""
    return np.concatenate([values[:1], 0.5 * (values[1:] + values[:-1])])


def _with_turning(recording: Recording) -> Recording:
    """The recording with a channel that says where an axis turns."""
    if "turning" in recording.channels:
        return recording
    flags = _steps(recording).any(axis=0).astype(float)
    return replace(recording, channels={**recording.channels, "turning": Channel(flags, "1", "interval")})


def _blocks(manifest: Manifest, model: UnitModel, run: Recording) -> Blocks:
    one = replace(run, channels={n: replace(c, values=c.values[None]) for n, c in run.channels.items()})
    blocks = joined(gathered(model, nothing(model, 1), one))
    if blocks is None or not blocks.turning.any() or blocks.turning.all():
        raise InputError(
            f"{manifest.path}: {run.label} has no rests or no turns; wanted a unit that is turned and rests"
        )
    return blocks


def _numbered(blocks: Sequence[Blocks]) -> tuple[list[NDArray[np.int64]], int]:
    """Number of the rest to which each block belongs, from 1 through all runs, and how many there are."""
    found, last = [], 0
    for block in blocks:
        turning = block.turning[0].astype(int)
        begun = np.concatenate([[1], np.diff(turning) == -1]).astype(int)
        number = last + np.cumsum(begun)
        found.append(number)
        last = int(number[-1])
    return found, last


def _held_out(
    manifest: Manifest,
    recordings: Sequence[Recording],
    blocks: Sequence[Blocks],
    counted: tuple[Sequence[NDArray[np.int64]], int],
) -> list[NDArray[np.bool_]]:
    """Whether each block is held out: by the number of its rest, else where the row in that rest's middle is."""
    (numbers, rests), named = counted, manifest.held_out.positions
    if named in ("even", "odd"):
        return [number % 2 == (named == "odd") for number in numbers]
    if isinstance(named, tuple):
        if beyond := [n for n in named if n > rests]:
            where = f"{manifest.path}: held_out.positions has {beyond[0]}"
            raise InputError(f"{where}; there are {rests} rests, counted from 1")
        return [np.isin(number, named) for number in numbers]
    if manifest.held_out.names_nothing or named is not None:
        return [number % EVERY == 0 for number in numbers]
    found = []
    for use, run, block, number in zip(split(manifest, recordings), recordings, blocks, numbers, strict=True):
        per_block, still = len(run) / len(number), ~block.turning[0]
        middle = {n: np.flatnonzero(still & (number == n)).mean() + 0.5 for n in np.unique(number[still])}
        out = {n: bool(use.held_out[int(at * per_block)]) for n, at in middle.items()}
        found.append(np.array([out.get(n, False) for n in number]))
    return found


def _excess(model: UnitModel, run: Recording, warm: bool) -> Mapping[float, Floats]:
    """Of `insenv.identify.positions.on_axes.terms.excess` by blocks."""
    if not warm:
        return {}
    values, size = run.channels["temperature"].values, model.size
    edges = np.concatenate([values[:1], values[size - 1 :: size]])[: len(values) // size + 1]
    t = np.arange(len(edges), dtype=np.float64) * float(size * model.sheet.dt)
    return excess(t, edges, model.sheet.reference_temperature)


def _cells(  # noqa: PLR0913 -- what a run is made of
    model: UnitModel,
    blocks: Blocks,
    lagged: Mapping[float, Floats],
    terms: Candidates,
    layout: Layout,
    begun: tuple[float, int],
    use: tuple[NDArray[np.int64], NDArray[np.bool_]],
) -> list[Cells]:
    """Cells of the six channels of a run; ``use``: of each block the number of its rest, and whether it is held out."""
    names, mounted = [p.name for p in model.parameters], model.gimbals.mounted
    found, (start, run), (number, held) = [], begun, use
    for c, target in enumerate(UNIT):
        columns, means, covariance = model.cells(blocks, 0, c)
        edges = model.edges(blocks, 0, c)
        middle = np.asarray(0.5 * (edges[1:] + edges[:-1]), np.float64)
        time = start + middle * float(model.size * model.sheet.dt)
        own = {names[j]: columns[:, i] for i, j in enumerate(model.places[c])}
        late: dict[float, Floats] = {tau: np.add.reduceat(v, edges[:-1]) / np.diff(edges) for tau, v in lagged.items()}
        raw = Raw(target, own, time, late)
        design = np.column_stack([make(raw) for make in terms.made])
        nuisance = np.zeros((len(time), len(layout)))
        for j, (name, mount, _) in enumerate(layout):
            if mount is None or mount == mounted:
                nuisance[:, j] = own[name]
        first = edges[:-1]
        turning = blocks.turning[0][first]
        found.append(Cells(c, design, nuisance, means, covariance, time, run, turning, held[first], number[first]))
    return found


def _structure(problem: OnAxes, fit: Fit) -> tuple[str, ...]:
    """Whether the held-out cells scatter as the fitted ones foretell."""
    held = problem.held_out
    r = fit.residual[held].ravel()
    slopes = fit.slopes[held].reshape(len(r), -1)
    covariance = np.eye(len(r)) + slopes @ fit.told @ slopes.T
    square = float(r @ np.linalg.solve(covariance, r)) / fit.variance
    p = float(chdtrc(len(r), square))
    if p >= _LEFT or not len(r):
        return ()
    ratio = np.sqrt(square / len(r))
    return (f"held-out rests and turns scatter {ratio:.3g} times as much as the fitted ones foretell (p = {p:.1e})",)


def _slipped_often(steps: Sequence[Step]) -> tuple[str, ...]:
    """A unit that slips again and again: what goes with the attitude is off by as much at each, and no slip."""
    slips = sum(step.term.effect.id == SLIP for step in steps)
    if slips <= MOST_SLIPS:
        return ()
    return (f"{SLIP} {slips} times: no mounting slips so often, and a cause that goes with the attitude looks like it",)


def _said(rests: int, held: Sequence[NDArray[np.bool_]], numbers: Sequence[NDArray[np.int64]]) -> str:
    out = len({int(n) for h, number in zip(held, numbers, strict=True) for n in number[h]})
    used = f"{rests - out} fitted, {out} held out, each with the turn after it"
    return f"{rests} rests on a table whose axes are read: {used}"
