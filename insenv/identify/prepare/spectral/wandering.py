"""A line that the bins can follow and whose phase does not hold.

One sinusoid takes out little of such a line, and what it foretells for the held-out data has the wrong phase: it is no
`tone` of the model. In the modes r_k of the residual (DCT-II of each block) its power P, smoothed, stands above that of
the noise beside it, B. There the modes are damped to the noise,

    r_k -> r_k sqrt(B / P(f_k)),        f_k = k / (2 n T)

with the gain of the fitted blocks for the held-out ones too: a hole in the spectrum would be as wrong as a peak.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import dct, idct
from scipy.ndimage import median_filter, uniform_filter1d

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.identify.fit.bins import Block, at_places
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.heldout import residual
from insenv.identify.fit.problem import Problem
from insenv.identify.prepare.spectral.coherence import follows
from insenv.identify.prepare.spectral.lines import (
    IN_REFERENCE,
    LEAST_STEADY,
    SAME_LINE,
    Line,
    has_line,
    line_at,
    multiple,
    of_reference,
    periodogram,
    share_of_motion,
    steps_of_encoder,
    within_half_a_count,
)

#: Fewest cycles in the fitted time: of a slower one nobody knows whether it is a line or the wander of the noise.
FEWEST_CYCLES = 40.0
#: Fewest bins of a stretch in which a line is measured.
FEWEST_BINS = 128
#: Half the band in which a line of the bins is looked for, as a share of its frequency, and in widths 1 / duration.
BAND_SHARE, BAND_WIDTHS = 0.02, 4.0
#: Power of the motion about a line, in that of what is left there, up to which it is the last digits of an angle.
DIGITS = 1e-6
#: Half the band in which a line of the reference is that of the target, in widths 1 / duration.
WITHIN = 2.0
#: Share within which a table that turns steadily keeps its rate, the share of the time that it must, and most lines of
#: one turn.
STEADY_TURN, MOSTLY, ORDERS = 0.01, 0.8, 8
#: Most poles, or teeth of a gear; deviations of a line's frequency, and width in 1 / duration, by which it is theirs.
POLES, SURE, EXACTLY = 72, 3.0, 0.2
#: Share of the largest rate below which a table rests, and fewest bins there; share of its amplitude in motion that a
#: line of the target has at rest at least.
RESTS, FEWEST_AT_REST, HALF = 1e-2, 8, 0.5
#: Modes over which the power of a line is smoothed; how far above the noise it counts; passes that bring it down.
SMOOTHED, ABOVE, PASSES = 5, 1.6, 8
#: A line reaches no further than this share of its frequency.
REACH = 0.5
#: Median of the square of a standard normal.
MEDIAN = 0.4549
#: Least power of the line in held-out data, as a share of that in the fitted ones, with which it is the same line.
STILL_THERE = 0.2


def wanders(problem: Problem, fit: Fit, frequency: float, runs: tuple[int, ...] = ()) -> Line | None:
    """The line at ``frequency`` [Hz] in the residual of ``fit``, if its phase does not hold; else None.

    Looked at in the longest fitted stretch of each run (of ``runs``, if given); the strongest one speaks.
    """
    found = [w for b in _stretches(problem, True, runs) if (w := _of_block(problem, fit, b, frequency)) is not None]
    if not found or any(w.steady for w in found):
        return None
    return _said_of_motion(problem, fit, max(found, key=lambda w: w.amplitude))


def of_counts(problem: Problem, fit: Fit, frequency: float) -> Line | None:
    """The line at ``frequency`` [Hz] in the residual of ``fit``, if it is the pattern of an encoder's or own counts.

    It is one of the reference as well where that has it and what the target reads has not.
    """
    if not problem.turns:
        return None
    for block in _stretches(problem, True) if problem.counter else ():
        line = _of_block(problem, fit, block, frequency)
        if line and within_half_a_count(line.amplitude, line.frequency, problem.counter):
            return replace(line, steady=False, phase=0.0, of_counts=True)
    if problem.commanded:
        return None
    for block, left, reference in _beside_reference(problem, fit):
        line, width = _of_block(problem, fit, block, frequency), problem.bins.width
        steps = line and problem.encoder and steps_of_encoder(line, width, left, reference, problem.encoder)
        # In a slow band the motion has power as well: what the steps make there is tried where that is known.
        steps = steps and _made_by_steps(problem, block, left, frequency)
        if line and (steps or of_reference(frequency, width, left, reference)):
            return replace(line, steady=False, phase=0.0, of_counts=True)
    return None


def _made_by_steps(problem: Problem, block: Block, left: Floats, frequency: float) -> bool:
    """Whether the steps of the table's angle make as tall a line as is left about a frequency; so if not known."""
    errors = problem.step_errors()
    if errors is None:
        return True
    width = problem.bins.width
    # As far as a rate that is known a little less than the motion is moves such a line.
    far = max(SAME_LINE, _reach(frequency, block.n * width))

    def peak(values: Floats) -> float:
        found = periodogram(values, width)
        return float(found.power[np.abs(found.f - frequency) <= far].max(initial=0.0))

    made = [peak(draw[block.start : block.stop]) for draw in errors]
    return float(np.median(made)) > IN_REFERENCE * peak(left)


def left_of(problem: Problem, lines: Sequence[Line], frequency: float) -> Line | None:
    """The line that was damped at a frequency, as nearly as the fitted bins tell it, of which some is left."""
    span = _longest(problem)
    damped = (line for line in lines if line.of_counts or not line.steady)
    return next((line for line in damped if abs(line.frequency - frequency) * span < 1), None)


def stands_in_reference(problem: Problem, fit: Fit, frequency: float) -> bool:
    """Whether what is left at ``frequency`` [Hz] stands in the reference, and not in what the target reads."""
    if problem.commanded or not problem.turns:
        return False
    width = problem.bins.width
    return all(of_reference(frequency, width, left, other) for _, left, other in _beside_reference(problem, fit))


def stops_at_rest(problem: Problem, fit: Fit, frequency: float) -> bool:
    """Whether what is left at ``frequency`` [Hz] where the table turns is not there where it rests: a motor's ripple.

    Of a line of the target itself the amplitude at rest is at least `HALF` of the other, beyond twice its deviation.
    Rounding that no noise blurs may hide it at rest.
    """
    if not problem.turns or problem.coarse is not None:
        return False
    rate = np.abs(problem.bins.mean(tuple(e.motion.rate for e in problem.exposures)))
    resting, left = rate < RESTS * rate.max(), residual(problem, fit)
    still, moving = (
        [
            _amplitude(problem.bins.time[part], left[part], frequency)
            for block in problem.fitted
            if len(part := block.start + np.flatnonzero(where[block.start : block.stop])) > FEWEST_AT_REST
        ]
        for where in (resting, ~resting)
    )
    if not still or not moving:
        return False
    tall = max(amplitude - 2 * sd for amplitude, sd in moving)
    return max(amplitude + 2 * sd for amplitude, sd in still) < HALF * tall


def _amplitude(time: Floats, values: Floats, frequency: float) -> tuple[float, float]:
    """Amplitude of the wave at ``frequency`` [Hz] beside a level, and the largest standard deviation it may have."""
    angle = 2 * np.pi * frequency * (time - time[0])
    columns = np.column_stack([np.ones(len(time)), np.cos(angle), np.sin(angle)])
    inverse = np.linalg.pinv(columns.T @ columns)
    theta = inverse @ columns.T @ values
    noise = np.sum((values - columns @ theta) ** 2) / max(len(values) - 3, 1)
    return float(np.hypot(*theta[1:])), float(np.sqrt(noise * np.linalg.eigvalsh(inverse[1:, 1:])[-1]))


def moves_there(problem: Problem, fit: Fit, frequency: float) -> bool:
    """Whether a measured reference has a line at ``frequency`` [Hz]: the ripple of a motor, or steps of who walks.

    What a filter, a lag or a soft mount makes of such motion is left of it, and no line of the target. Nor is what
    comes after each move of a table that moves again and again, about an axis across the target's.
    """
    if problem.commanded:
        return False
    if not problem.turns:
        return _has_line(problem, _turned(problem), frequency)
    moving = _moving_about(problem, fit, frequency)
    return _has_line(problem, ((block, reference) for block, _, reference in moving), frequency)


def heated_there(problem: Problem, frequency: float) -> bool:
    """Whether the temperature changes in a line at ``frequency`` [Hz] in each run, as a room or a chamber does."""
    heat = problem.heat()
    if heat is None:
        return False
    change = np.gradient(heat)
    return _has_line(problem, ((b, change[b.start : b.stop]) for b in _stretches(problem, True)), frequency)


def _has_line(problem: Problem, stretches: Iterable[tuple[Block, Floats]], frequency: float) -> bool:
    for block, motion in stretches:
        found = periodogram(motion, problem.bins.width)
        if has_line(found, np.abs(found.f - frequency) <= WITHIN / (block.n * problem.bins.width)):
            return True
    return False


def _turned(problem: Problem) -> Iterator[tuple[Block, Floats]]:
    """The longest fitted stretch of each run in which a table turns, with the angle by which it does in a cell."""
    cells = tuple(_angles_of_cells(e.motion) for e in problem.exposures)
    turned = problem.bins.mean(cells)
    for block in _stretches(problem, True):
        if np.ptp(turned[block.start : block.stop]):
            yield block, turned[block.start : block.stop]


def _angles_of_cells(motion: Motion) -> Floats:
    """By how much the table turns in each cell [rad], by its rate where no angle was logged; shape (cells,)."""
    if motion.angle is not None:
        return np.diff(motion.angle)
    return motion.rate * motion.dt / motion.projection if motion.projection else np.zeros(motion.n)


def goes_with_motion(problem: Problem, fit: Fit, frequency: float) -> bool:
    """Whether what is left about ``frequency`` [Hz] goes, window by window, with what a measured reference has."""
    if problem.commanded or not problem.turns:
        return False
    stretches = [(left, reference) for _, left, reference in _moving_about(problem, fit, frequency)]
    return bool(stretches) and follows(stretches, frequency * problem.bins.width)


def of_the_motion(problem: Problem, fit: Fit, frequency: float) -> Line | None:
    """The line at ``frequency`` [Hz] in the residual of ``fit``, if it goes with the motion; else None."""
    if not goes_with_motion(problem, fit, frequency):
        return None
    found = [w for b in _stretches(problem, True) if (w := _of_block(problem, fit, b, frequency)) is not None]
    if not found:
        return None
    return replace(max(found, key=lambda w: w.amplitude), steady=False, phase=0.0, of_motion=True)


def _said_of_motion(problem: Problem, fit: Fit, line: Line) -> Line:
    """The line, and of it whether it goes with the motion, or comes a whole number of times a turn of a table."""
    moved = goes_with_motion(problem, fit, line.frequency) or each_turn(problem, line.frequency)
    return replace(line, of_motion=moved)


def each_turn(problem: Problem, frequency: float) -> bool:
    """Whether a table that turns steadily does so at ``frequency`` [Hz], or a few times as slowly.

    There a wave of its angle whose amplitude changes, as with the temperature, is a line whose phase does not hold.
    """
    return any(multiple(frequency, turn, ORDERS, WITHIN / span) for span, turn in _steady_turns(problem))


def of_poles(problem: Problem, line: Line, dt: float) -> bool:
    """Whether a line of samples every ``dt`` seconds comes a whole number of times a turn, as a motor's poles do.

    Or is one that is too fast for them. At one rate nothing tells it from a line of the instrument.
    """
    for span, turn in _steady_turns(problem):
        near = max(SURE * line.frequency_sd, EXACTLY / span)
        if any(multiple(f, turn, POLES, near) for f in (line.frequency, 1 / dt - line.frequency)):
            return True
    return False


def _steady_turns(problem: Problem) -> Iterator[tuple[float, float]]:
    """Of each run in which a table turns steadily the time that is looked at [s], and how often it turns [1/s]."""
    for block, turned in _turned(problem):
        turns = np.abs(turned) / (2 * np.pi * problem.exposures[block.run].motion.dt)
        usual = float(np.median(turns))
        steady = np.abs(turns - usual) < STEADY_TURN * usual
        if usual and np.mean(steady) >= MOSTLY:
            yield block.n * problem.bins.width, float(turns[steady].mean())


def _beside_reference(problem: Problem, fit: Fit) -> Iterator[tuple[Block, Floats, Floats]]:
    """The longest fitted stretch of each run, with what is left there and the reference."""
    left = residual(problem, fit)
    reference = problem.bins.mean(tuple(e.motion.rate for e in problem.exposures))
    for block in _stretches(problem, True):
        yield block, left[block.start : block.stop], reference[block.start : block.stop]


def _moving_about(problem: Problem, fit: Fit, frequency: float) -> Iterator[tuple[Block, Floats, Floats]]:
    """Those of them whose motion has a share of what is left at a frequency: the digits of an angle have lines too."""
    for block, left, reference in _beside_reference(problem, fit):
        if share_of_motion(frequency, problem.bins.width, left, reference) > DIGITS:
            yield block, left, reference


def lost(problem: Problem, fit: Fit, frequency: float) -> Line | None:
    """The line at ``frequency`` in fitted and held-out data alike, of which one wave does not foretell the other."""
    fitted = [w for b in _stretches(problem, True) if (w := _of_block(problem, fit, b, frequency)) is not None]
    later = [w for b in _stretches(problem, False) if (w := _of_block(problem, fit, b, frequency)) is not None]
    if not fitted or not later:
        return None
    best = max(fitted, key=lambda w: w.amplitude)
    if max(w.amplitude for w in later) ** 2 < STILL_THERE * best.amplitude**2:
        return None
    width = max(best.frequency_sd, abs(max(later, key=lambda w: w.amplitude).frequency - frequency))
    return _said_of_motion(problem, fit, replace(best, steady=False, phase=0.0, frequency_sd=width))


def without_line(problem: Problem, fit: Fit, line: Line) -> Problem:
    """The problem with the line damped to the noise beside it, in all runs."""
    left, y = residual(problem, fit), problem.y.copy()
    free = np.zeros(len(y), bool)
    free[list(problem.outliers)] = True
    width = problem.bins.width
    fitted = (at_places(left[b.start : b.stop], problem.bins.places(b)) for b in problem.fitted)
    gain = _gain([dct(series, type=2, norm="ortho") for series in fitted], width, line.frequency)
    for block in problem.bins.blocks:
        rows, place = slice(block.start, block.stop), problem.bins.places(block)
        series = at_places(np.where(free[rows], 0.0, left[rows]), place)
        damped = idct(dct(series, type=2, norm="ortho") * gain(_frequencies(len(series), width)), type=2, norm="ortho")
        y[rows] += np.where(free[rows], 0.0, (damped - series)[place])
    return problem.measured_as(y)


def reach(problem: Problem, frequency: float) -> float:
    """Half the band in which a line of the fitted bins is looked for [Hz]."""
    return _reach(frequency, _longest(problem))


def _longest(problem: Problem) -> float:
    """Longest fitted stretch [s]."""
    return max(b.n for b in problem.fitted) * problem.bins.width


def _reach(frequency: float, duration: float) -> float:
    return max(BAND_SHARE * frequency, BAND_WIDTHS / duration)


def _frequencies(n: int, width: float) -> Floats:
    return np.arange(n) / (2 * n * width)


def _gain(modes: list[Floats], width: float, frequency: float) -> Callable[[Floats], Floats]:
    """What modes are multiplied with, as a function of frequency, from those of the fitted blocks."""
    longest = max(modes, key=len)
    f = _frequencies(len(longest), width)
    gain, far = np.ones(len(f)), np.abs(f - frequency) > REACH * frequency
    peak = int(np.argmin(np.abs(f - frequency)))
    for _ in range(PASSES):
        # With each pass there is less of the line in what stands for the noise beside it.
        left = (gain * longest) ** 2
        power = uniform_filter1d(left, SMOOTHED) * MEDIAN / median_filter(left, size=_beside(len(f)), mode="reflect")
        loud = (power > ABOVE) & ~far
        # What is next to the line and loud is the line; what is loud beyond a quiet stretch is another one.
        quiet = uniform_filter1d(loud.astype(float), 4 * SMOOTHED) < 1 / (4 * SMOOTHED)
        below, above = np.flatnonzero(quiet[:peak]), np.flatnonzero(quiet[peak + 1 :])
        loud[: below[-1] if len(below) else 0] = False
        loud[peak + 1 + above[0] if len(above) else len(f) :] = False
        gain[loud] /= np.sqrt(power[loud])
    return lambda at: np.interp(at, f, gain)


def _beside(n: int) -> int:
    """Modes over which the noise beside a line is taken."""
    return int(np.clip(n // 4, 65, 2049)) | 1


def _stretches(problem: Problem, fitted: bool, runs: tuple[int, ...] = ()) -> list[Block]:
    """Longest stretch of each run with one use."""
    blocks = problem.fitted if fitted else problem.held_out
    longest: dict[int, Block] = {}
    for block in blocks:
        if (not runs or block.run in runs) and block.n > getattr(longest.get(block.run), "n", 0):
            longest[block.run] = block
    return list(longest.values())


def _of_block(problem: Problem, fit: Fit, block: Block, frequency: float) -> Line | None:
    """The line near ``frequency`` in one stretch of bins; None where there is none, or too few cycles to tell."""
    width = problem.bins.width
    if block.n < FEWEST_BINS or frequency * block.n * width < FEWEST_CYCLES:
        return None
    values = residual(problem, fit)[block.start : block.stop]
    if not np.ptp(values):  # a reading that stands still, as one held at nought at rest does
        return None
    place, time = problem.bins.places(block), problem.bins.time[block.start : block.stop]
    if int(place[-1]) + 1 > block.n:
        values, time = at_places(values, place), time[0] + width * np.arange(place[-1] + 1)
    spectrum = periodogram(values, width)
    half = _reach(frequency, block.n * width)
    near = np.flatnonzero(np.abs(spectrum.f - frequency) < half)
    if not len(near):
        return None
    peak = int(near[np.argmax(spectrum.power[near])])
    line = line_at(time, width, values, spectrum, peak, block.run, half)
    # Of what is nothing where bins are lost the line has that share of its amplitude.
    lost = len(values) / block.n
    line = replace(line, amplitude=line.amplitude * lost, amplitude_sd=line.amplitude_sd * lost)
    return line if line.amplitude > LEAST_STEADY * line.amplitude_sd else None
