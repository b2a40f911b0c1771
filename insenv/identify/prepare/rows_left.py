"""What a model leaves of the rows of a recording: reading less reference and what its effects explain of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats, Recording
from insenv.data.exposure import expose, has_table
from insenv.data.reference import is_in_points
from insenv.data.split import RowUse
from insenv.effects.timing import TimingSkew
from insenv.identify.fit.problem import Model, Problem, regressors
from insenv.identify.prepare.spectral.lines import Line, quantum
from insenv.identify.prepare.spectral.lost_rows import rows_of
from insenv.identify.prepare.unsteady.spectrogram import RowsLeft

#: Standard deviations by which a line that wanders is away at most.
WANDERS = 4.0
#: Share of the variance from which on lines that wander are most of the rows, as the dither of a laser gyro.
DITHERS = 0.5
#: Quantiles of the changes from row to row that are not nothing, and their ratio, of readings that hop by one step.
HOPS, ONE_STEP = (0.1, 0.9), 1.3


def sample_residual(recording: Recording, rows: slice | NDArray[np.int64], problem: Problem, model: Model) -> Floats:
    """Samples of some rows minus the reference and what the effects of a model explain of them, shape (rows,).

    Commanded motion and a scale factor that is declared are no lines. Bins may have averaged that motion away, so the
    coefficients are fitted to the samples themselves.
    """
    values = recording.channels[problem.target].values[rows]
    if not has_table(recording):
        return values
    return _left(recording, rows, problem, model)[0]


def _left(
    recording: Recording, rows: slice | NDArray[np.int64], problem: Problem, model: Model
) -> tuple[Floats, Floats]:
    """What is left of the samples of some rows, and the reference there, both of shape (rows,)."""
    values = recording.channels[problem.target].values[rows]
    temperature = problem.exposures[0].motion.reference_temperature
    exposure = expose(recording, problem.target, reference_temperature=temperature)
    cell = exposure.cell_of_row[rows]
    inside = cell >= 0
    bases = [regressors(term.effect, exposure, term.shape)[cell[inside]] for term in model]
    if exposure.motion.lag:
        bases.append(regressors(TimingSkew(), exposure, ())[cell[inside]])  # what is late is no line
    columns = np.column_stack([np.ones(int(inside.sum())), *bases])
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    left, rate = np.zeros(len(values)), np.zeros(len(values))
    rate[inside] = exposure.motion.rate[cell[inside]]
    sample = values[inside] - rate[inside]
    left[inside] = sample - columns @ np.linalg.lstsq(columns, sample, rcond=1e-9)[0]
    return left, rate


def rows_left(
    recordings: Sequence[Recording], uses: Sequence[RowUse], problem: Problem, model: Model, lines: Sequence[Line]
) -> tuple[RowsLeft, ...]:
    """What a model leaves of the longest stretch of each run, fitted rows and held-out ones.

    None of lists of points, whose rows do not follow each other, nor where lines that wander are most of the rows: what
    they do is all that changes there.
    """
    found = []
    for run, (recording, use) in enumerate(zip(recordings, uses, strict=True)):
        rows = rows_of(recording, use.fit | use.held_out)
        own = [line for line in lines if line.run == run]
        dithers = sum(line.share for line in own if not line.steady) > DITHERS
        if is_in_points(recording) or dithers or not len(rows.index):
            continue
        readings = recording.channels[problem.target].values[rows.index]
        known = has_table(recording) or len(model) > 1
        values, rate = _left(recording, rows.index, problem, model) if known else (readings, readings)
        start = float(recording.t[rows.index[0]] - recording.t[0])
        told = tuple((line.frequency, 0.0 if line.steady else WANDERS * line.frequency_sd) for line in own)
        left = RowsLeft(run, start, recording.dt, rows.filled(values), None, problem.commanded, told)
        missing = np.ones(len(left.values), bool)
        missing[rows.place] = recording.left_out.get(problem.target, np.zeros(len(recording), bool))[rows.index]
        left = replace(left, rate=rows.filled(rate)) if has_table(recording) else left
        missing_rows = missing if missing.any() else None
        found.append(replace(left, step=step(readings), missing=missing_rows, encoder=problem.encoder))
    return tuple(found)


def step(readings: Floats) -> float:
    """The step by which ``readings``, shape (n,), hop, or to which they were rounded; 0 where neither is coarse."""
    moves = np.abs(np.diff(readings))
    moves = moves[moves > 0]
    if not len(moves):
        return 0.0
    low, high = np.quantile(moves, HOPS)
    return float(high) if high <= ONE_STEP * low else quantum(readings)
