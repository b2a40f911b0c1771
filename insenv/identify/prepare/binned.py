"""One target in bins, as a problem that can be fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from insenv.core.errors import InputError
from insenv.core.lazy import Lazy
from insenv.core.recording import Floats, Recording
from insenv.core.series.coarse import Coarse, coarse
from insenv.core.series.counts import Counts, counts_of_angle, counts_of_rate
from insenv.data.exposure import Exposure, expose, rates_of_angles, turns
from insenv.data.manifest.spec import Manifest
from insenv.data.reference import order
from insenv.data.split import RowUse
from insenv.effects.angle import EarthRate
from insenv.identify.clean.outliers import outliers
from insenv.identify.fit.bins import Bins, gather, whole
from insenv.identify.fit.problem import Model, Problem
from insenv.identify.prepare.widths import rows_per_cell

#: Zeros of an encoder at which its steps are tried; noise of a reading, in steps, that is more than what these make.
DRAWS, BLURRED = 16, 0.6
#: Bins that the noise wants beside the declared parameters.
SPARE = 6
#: The same of points, which no counter joins: beside fewer, one list without a fault in ten had a name.
SPARE_POINTS = 5


def binned(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    target: str,
    rows_per_bin: int,
    reject_lines: bool = False,
) -> Problem:
    """The target in bins of some rows, whose window rejects lines if need be.

    Raises
    ------
    InputError
        If no whole bin lies in the fitted rows, or in those held out.
    """
    per_cell = rows_per_cell(rows_per_bin, sum(map(len, recordings)))
    with_earth = EarthRate.id in manifest.model.declared
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
    mean: Callable[[tuple[Floats, ...]], Floats] = bins.mean
    if any(e.beside is not None for e in exposures):
        beside = tuple(np.zeros(len(e.y)) if e.beside is None else e.beside for e in exposures)
        mean = partial(_without_gaps, bins, reject_lines)
        y += bins.mean(beside) - mean(beside)
    turning = turns(exposures)
    points = exposures[0].motion.points
    out = () if turning or points else outliers(y, bins.blocks)
    rounded = _coarse(recordings, target) if turning and not points else None
    exact = turning and all(_commanded(recording) for recording in recordings)
    unit = recordings[0].channels[target].unit
    step = max((_encoder_step(r, e) for r, e in zip(recordings, exposures, strict=True)), default=0.0)
    count = max(r.channels[target].step * r.dt for r in recordings)
    made = Problem(target, unit, exposures, bins, y, out, commanded=exact, coarse=rounded, encoder=step, counter=count)
    return replace(made, steps=Lazy(partial(_errors_of_steps, recordings, target, per_cell, mean))) if step else made


def _without_gaps(bins: Bins, reject_lines: bool, beside: tuple[Floats, ...]) -> Floats:
    """What a reading of the angle has beside the motion, over all cells of the bins; neighbours take that of lost ones.

    So its errors cancel from one bin to the next, though rows are lost between them.
    """
    own = whole(bins, reject_lines).mean(beside)
    if reject_lines:
        return own
    first = 0
    for run, kept in enumerate(bins.kept):
        per_bin = bins.weights[run].shape[1]
        edges = np.append(0.0, np.cumsum(beside[run])) / per_bin
        lost = edges[per_bin * kept[1:]] - edges[per_bin * (kept[:-1] + 1)]
        own[first : first + len(kept)] += 0.5 * (np.append(lost, 0.0) + np.append(0.0, lost))
        first += len(kept)
    return own


def _errors_of_steps(
    recordings: tuple[Recording, ...], target: str, per_cell: int, mean: Callable[[tuple[Floats, ...]], Floats]
) -> Floats | None:
    """What the steps of the table's angle would make of the bins, the encoder's zero elsewhere in a step each time.

    The angle behind the reading, with what the encoder has of noise beside its steps, is read anew.
    """
    runs: list[Floats] = []
    for recording in recordings:
        table, name = recording.table, order(recording)[0]
        if table is None or table.still:
            return None
        counts = _counts(recording)
        if counts is None:
            runs.append(rates_of_angles(recording, target, per_cell, np.zeros((DRAWS, len(recording)))))
            continue
        angle, step = table.angle_at(recording.t - recording.channels[name].delay), counts.step
        blurred = 0.0
        if table.of == "angle" and table.noise > BLURRED * step:
            blurred = np.sqrt(table.noise**2 - step**2 / 12)
        noise = blurred * np.random.default_rng(0).standard_normal(len(angle))
        zeros = step * (np.arange(DRAWS)[:, None] + 0.5) / DRAWS
        errors = np.floor((angle + noise + zeros) / step) * step - zeros - angle
        runs.append(rates_of_angles(recording, target, per_cell, counts.of_rows(errors)))
    return np.array([mean(tuple(run[k] for run in runs)) for k in range(DRAWS)])


def _encoder_step(recording: Recording, exposure: Exposure) -> float:
    """Step to which the angle of a table is read, as the target sees it [rad]; 0 where that is not the reference."""
    counts = _counts(recording)
    return abs(exposure.motion.projection) * counts.step if counts else 0.0


def _counts(recording: Recording) -> Counts | None:
    """The counts of the encoder that is the reference; None where another one is, or none are seen."""
    names = order(recording)
    if not names or (channel := recording.channels[names[0]]).source != "encoder":
        return None
    if channel.every:
        return None
    if names[0] == "table_angle":
        return counts_of_angle(channel.values)
    table = recording.table
    if table is None or table.still:
        return None
    return counts_of_rate(channel.values, table.rate_at(recording.t - channel.delay), recording.dt)


def _commanded(recording: Recording) -> bool:
    """Whether the reference is a command, or has no noise of its own."""
    names = order(recording)
    return bool(names) and recording.channels[names[0]].source in ("command", "set")


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


def enough(manifest: Manifest, problem: Problem, model: Model, target: str) -> None:
    """Raise InputError where the fitted bins are too few for the declared parameters and the noise."""
    bins = sum(b.n for b in problem.fitted)
    parameters = sum(len(problem.names(term)) for term in model)
    what, wanted = f"bins of {problem.bins.width:g} s", "a longer recording or a shorter held_out.averaging"
    spare = SPARE
    if problem.in_points:
        what, wanted, spare = "points", "more points", SPARE_POINTS
    if bins < parameters + spare:
        raise InputError(
            f"{manifest.path}: {target!r} has {bins} fitted {what} for {parameters} declared parameters and the noise; "
            f"wanted at least {parameters + spare}: {wanted}"
        )
