"""Lines of the samples that the bins do not follow: which there are, and which of them matter to means.

A line that is a visible part of the samples, or leaks into means beside their own noise, is rejected by the bins. One
that is slight to any one mean is not so to all of them together,

    amplitude in a mean: |sin(pi f T) / (pi f T)|,        seen at |f - k / T| below 1 / 2 T,

where n means find what is n^-1/2 of their noise: a steady one is subtracted too, and of one that wanders what means
fold it to is damped there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from insenv.core.recording import Floats, Recording
from insenv.core.series.robust import MEDIAN
from insenv.data.split import RowUse
from insenv.identify.clean.holds import Hold
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Model, Problem
from insenv.identify.prepare.rows_left import sample_residual
from insenv.identify.prepare.spectral.coherence import follows
from insenv.identify.prepare.spectral.lines import (
    FASTEST,
    SAME_LINE,
    Line,
    again,
    beyond_motion,
    of_motion,
    quantum,
    steps_of_encoder,
)
from insenv.identify.prepare.spectral.lost_rows import lines_of_rows, rows_of
from insenv.identify.prepare.spectral.wandering import of_poles, without_line

#: Robust deviations beyond which a sample beside a reference that turns tells of no line: a line alone stays below.
JUMPS = 4.0
#: Share of the samples' variance from which a line is worth a word though the bins do not feel it.
LEAST_LINE = 0.01
#: Probability of noise with such a peak from which on a slighter one, of a unit at rest, is worth a word as well.
CERTAIN = 1e-8
#: Share of the square sum of the acceleration below the frequency that the motion reaches.
MOTION = 0.95


def lines_of_samples(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], problem: Problem, model: Model, width: float = 0.0
) -> tuple[Line, ...]:
    """Lines above the bin rate, or that of means over ``width`` [s].

    They are of the longest stretch of each run that may be fitted, short gaps bridged.
    """
    width = width or problem.bins.width
    found: list[Line] = []
    for run, (recording, use) in enumerate(zip(recordings, uses, strict=True)):
        rows = rows_of(recording, use.fit)
        t, channel = (recording.t - recording.t[0])[rows.index], recording.channels[problem.target]
        step = (channel.step or quantum(channel.values[rows.index])) * recording.dt
        left = sample_residual(recording, rows.index, problem, model)
        lines = lines_of_rows(rows, t, recording.dt, left, step, run, FASTEST / width)
        if lines and problem.turns:
            tame = lines_of_rows(rows, t, recording.dt, tamed(left), step, run, FASTEST / width)
            lines = tuple(x for x in lines if any(abs(x.frequency - y.frequency) < SAME_LINE for y in tame))
        values, reference = rows.filled(left), rows.filled(channel.values[rows.index] - left)
        for line in lines:
            steps = steps_of_encoder(line, recording.dt, values, reference, problem.encoder)
            moves = problem.turns and not steps and _of_motion(problem, line, recording.dt, values, reference)
            moved = moves or of_poles(problem, line, recording.dt)
            found += [] if moved else [replace(line, of_counts=steps)]
    return tuple(found)


def tamed(values: Floats) -> Floats:
    """Values without those further from the middle than noise and a line are: what a servo leaves of jumps is.

    A table that goes to and fro makes the same transients again and again, of which each multiple of the cycle is a
    line.
    """
    left = values - np.median(values)
    most = JUMPS * float(np.median(np.abs(left))) / MEDIAN
    return np.where(np.abs(left) <= most, left, 0.0) if most else left


def _of_motion(problem: Problem, line: Line, dt: float, left: Floats, reference: Floats) -> bool:
    """Whether the motion has a line there as well, or goes with one whose frequency wanders."""
    wanders = not (problem.commanded or line.steady)
    if line.steady and beyond_motion(line.frequency, dt, left, reference):
        return False
    return of_motion(line.frequency, dt, left, reference) or (
        wanders and follows([(left, reference)], line.frequency * dt)
    )


def that_matter(found: tuple[Line, ...], problem: Problem, width: float) -> tuple[Line, ...]:
    """Those of the lines that are a visible part of the samples, or leak into means over ``width`` [s]."""
    noise = _bin_noise(problem)
    return tuple(x for x in found if _matters(x, width, noise))


def _matters(line: Line, width: float, noise: float) -> bool:
    """Whether a line is a visible part of the samples, or leaks into the bins beside their own noise."""
    return line.share > LEAST_LINE or line.amplitude / (np.pi * line.frequency * width) > noise


def _bin_noise(problem: Problem) -> float:
    """Scatter from bin to bin, robust against the lines themselves being in it: of one bin."""
    steps = np.concatenate([np.diff(problem.y[b.start : b.stop]) for b in problem.fitted if b.n > 1])
    return float(np.median(np.abs(steps)) / MEDIAN / np.sqrt(2)) if len(steps) else 0.0


def slight(
    found: tuple[Line, ...],
    lines: tuple[Line, ...],
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    problem: Problem,
    model: Model,
) -> tuple[Line, ...]:
    """Those that there are beside ``lines``, certain and too slight to matter to any one mean.

    All means together see them where they fold them to. What wanders while a table turns may be the table's.
    """

    def known(x: Line) -> bool:
        return any(abs(x.frequency - one.frequency) < max(SAME_LINE, one.frequency_sd) for one in lines)

    sure = (x for x in found if x.p_value < CERTAIN and (x.steady or not problem.turns) and not known(x))
    return tuple(x for x in sure if recurs(x, recordings, uses, problem, model))


def confirmed(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], problem: Problem, model: Model, width: float
) -> tuple[Line, ...]:
    """Lines that means over ``width`` [s] do not follow, of those that held-out samples of the run have as well.

    The tallest peak of a hump is elsewhere in other data.
    """
    found = that_matter(lines_of_samples(recordings, uses, problem, model, width), problem, width)
    return tuple(x for x in found if recurs(x, recordings, uses, problem, model))


def recurs(
    line: Line, recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], problem: Problem, model: Model
) -> bool:
    """Whether held-out samples of its run have a line as well."""
    recording = recordings[line.run]
    rows = rows_of(recording, uses[line.run].held_out)
    return again(line, recording.dt, rows.filled(sample_residual(recording, rows.index, problem, model)))


def recurring(lines: tuple[Line, ...], problem: Problem) -> tuple[Line, ...]:
    """Lines without those that wander and stand in one of several runs alone beside a table: the table shook so."""
    if not problem.turns or len({block.run for block in problem.fitted}) == 1:
        return lines

    def recurs(line: Line) -> bool:
        """Whether another run has it, as near as either wanders."""
        far = [max(SAME_LINE, line.frequency_sd, one.frequency_sd) for one in lines]
        near = [abs(one.frequency - line.frequency) < reach for one, reach in zip(lines, far, strict=True)]
        return any(close and one.run != line.run for close, one in zip(near, lines, strict=True))

    return tuple(line for line in lines if line.steady or recurs(line))


def of_hold(line: Line, hold: Hold | None, problem: Problem) -> bool:
    """Whether a line is what a hold leaves: a sideband of its renewals, no further off than the motion reaches."""
    if hold is None:
        return False
    exposure = problem.exposures[line.run]
    power = np.abs(np.fft.rfft(np.diff(exposure.u))) ** 2
    share = np.cumsum(power) / max(float(power.sum()), 1e-300)
    reach = float(np.searchsorted(share, MOTION)) / (len(exposure.u) - 1) / exposure.motion.dt
    off = line.frequency * hold.hold
    return abs(off - round(off)) / hold.hold <= 2 * reach and round(off) > 0


def without_folded(problem: Problem, model: Model, lines: tuple[Line, ...]) -> Problem:
    """The problem with lines that wander damped to the noise where means fold them to: no tone is there."""
    rate = 1 / problem.bins.width
    for line in lines:
        seen_at = abs(line.frequency - rate * round(line.frequency / rate))
        problem = without_line(problem, solve(problem, model), replace(line, frequency=seen_at))
    return problem
