"""Spectral lines: tones that bins can follow, and lines above the bin rate.

In white noise of variance s^2 the periodogram |sum x exp(-2 pi i f t)|^2 / (n s^2) is exponentially distributed, so
the largest of m independent frequencies exceeds x with probability m exp(-x). A bin is a mean over T: a line of
frequency f above the bin rate comes through with up to 1 / (pi f T) of its amplitude, aliased to anywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import idct, next_fast_len, rfft, rfftfreq
from scipy.ndimage import maximum_filter1d, median_filter, uniform_filter1d
from scipy.optimize import minimize_scalar

from insenv.core.recording import Floats
from insenv.identify.fit.bins import at_places
from insenv.identify.fit.gls import Fit, whitened
from insenv.identify.fit.problem import Problem

#: Fewest values in which a line is looked for.
FEWEST = 256
#: Frequency in bins up to which a line is told from them; faster ones are told from the samples.
FASTEST = 0.48
#: Frequency in bins from which on bins become longer for a line that wanders: below, it is damped where it folds to.
WANDERS = 0.6
#: Probability of calling noise a line, per recording and target.
FALSE_ALARM = 1e-4
#: Probability that noise confirms in other samples, near its frequency, a line that was found.
CONFIRMED = 1e-3
#: How many times as many frequencies are as good as independent where those between Fourier's are looked at too
#: (measured: the largest of 608 and of 4096 values of noise exceeds a height 1.3 to 1.8 times as often).
BETWEEN = 1.6
#: At most so many lines are looked for.
MOST_LINES = 8
#: Widths of a line, 1 / duration, that it must be away from half the sampling rate.
EDGE = 4.0
#: Two peaks closer than this are one line, whose frequency wanders [Hz].
SAME_LINE = 0.3
#: A line reaches as far from its peak as its power, smoothed over `SMOOTHED` of a hertz, is so many times the noise's;
#: no further than a share of its frequency.
LOUDER, SMOOTHED, WIDEST = 2.0, 0.1, 0.1
#: Share of a line's power from which on the reference has it too.
IN_REFERENCE = 0.25
#: Share of a line's power below which the readings themselves, or the reference, have none of it.
IN_READING = 0.1
#: The same of motion, where it has a line, of which a drive's filter may leave a seventh; and where it has any: an axis
#: that is reversed leaves four times its power.
MOTION_LINE, MOTION_ANY = 0.02, 0.5
#: Frequencies on either side that are a line's own, of a Hann window, and fewest beside it that tell a response.
OWN_WIDTH, LEAST_BESIDE = 3, 16
#: Times the middle step from value to value of what is a change of the motion, and cycles of a line that show it.
CHANGES, CYCLES = 10.0, 3.0
#: A line is steady if one sinusoid takes out more than this share of its power, and is so many deviations tall.
STEADY, LEAST_STEADY = 0.9, 4.0
#: Frequencies of other values at which a line is theirs too, and the least height there.
SIDE, RECURS = 3, 5.0
#: Counts up to which the angle of a line may be the pattern of the counter itself.
HALF_A_COUNT = 0.5
#: Noise of a reading in counts from which on it has no pattern: a line of counts is exp(-2 (pi s)^2) as tall with noise
#: of s of them from row to row, 7e-3 at half a count and 3e-9 at one.
BLURRED = 1.0


def strongest_tone(problem: Problem, fit: Fit) -> tuple[float, float]:
    """Frequency [Hz] of the strongest tone in the whitened residual of the bins, and the frequencies looked at."""
    _, _, residual = whitened(problem, fit)
    width, best, looked = problem.bins.width, (0.0, 0.0), 0.0
    power: dict[int, Floats] = {}
    places = [problem.bins.places(block) for block in problem.fitted]
    size = next_fast_len(4 * max(int(place[-1]) + 1 for place in places))
    offset = 0
    for block, place in zip(problem.fitted, places, strict=True):
        series = idct(residual[offset : offset + block.n], type=2, norm="ortho")
        offset += block.n
        if block.n < 16:
            continue
        spectrum = np.abs(rfft(at_places(series, place), size)) ** 2 * 2 / block.n
        power[block.run] = power.get(block.run, 0) + spectrum
        looked += block.n / 2
    frequencies = rfftfreq(size, width)
    slowest = 1.5 / (max(int(place[-1]) + 1 for place in places) * width)
    usable = (frequencies > slowest) & (frequencies < FASTEST / width)
    if power and usable.any():
        total = np.where(usable, sum(power.values()), 0)
        best = (float(frequencies[total.argmax()]), float(total.max()))
    return (best[0] if best[0] > 0 else 0.25 / width), max(looked, 1.0)


def coherent_power(problem: Problem, fit: Fit, frequencies: Floats) -> Floats:
    """Power of the whitened residual at ``frequencies`` [Hz], all blocks of a run in one phase: shape (k,)."""
    power = np.zeros(len(frequencies))
    for run in {block.run for block in problem.fitted}:
        series, time = whitened_series(problem, fit, run)
        power += np.abs(np.exp(-2j * np.pi * np.outer(frequencies, time)) @ series) ** 2
    return power


def whitened_series(problem: Problem, fit: Fit, run: int) -> tuple[Floats, Floats]:
    """The residual of a run's fitted bins, whitened, one after another, and their times [s]: shapes (n,)."""
    _, _, residual = whitened(problem, fit)
    parts: list[tuple[Floats, Floats]] = []
    offset = 0
    for block in problem.fitted:
        if block.run == run:
            series = idct(residual[offset : offset + block.n], type=2, norm="ortho")
            parts.append((np.asarray(series), problem.bins.time[block.start : block.stop]))
        offset += block.n
    return np.concatenate([series for series, _ in parts]), np.concatenate([time for _, time in parts])


@dataclass(frozen=True)
class Line:
    """A line above the bin rate in one run.

    Attributes
    ----------
    run : int
        Counted from 0.
    frequency, frequency_sd : float
        [Hz]; the standard deviation of a line that wanders is its width.
    amplitude, amplitude_sd : float
        Of the sinusoid with the line's power.
    phase : float
        Of a steady line: it is amplitude * cos(2 pi f (t - t[0]) + phase) [rad].
    steady : bool
        Whether one sinusoid takes out most of the line's power.
    share : float
        Share of the line in the variance of the samples.
    p_value : float
        Probability that noise alone has such a peak.
    of_counts : bool
        Whether it is the pattern of counts, of the table's encoder or of the reading's counter, and no line.
    of_motion : bool
        Whether it goes with what the reference has there: a motor's ripple, of which a filter or a lag leaves some.
    averaged : bool
        Whether it was left to means that are long beside it: nothing was subtracted.
    """

    run: int
    frequency: float
    frequency_sd: float
    amplitude: float
    amplitude_sd: float
    phase: float
    steady: bool
    share: float
    p_value: float
    of_counts: bool = False
    of_motion: bool = False
    averaged: bool = False

    @property
    def own(self) -> bool:
        """Whether it is the target's own, which has a name."""
        return not (self.of_counts or self.of_motion)

    def at(self, t: Floats) -> Floats:
        """The line at times from the start of the run [s]; zero unless it is steady."""
        return self.steady * self.amplitude * np.cos(2 * np.pi * self.frequency * t + self.phase)


def find_lines(t: Floats, dt: float, values: Floats, quantum: float, run: int, lowest: float) -> tuple[Line, ...]:
    """Lines of ``values`` above ``lowest`` [Hz], strongest first.

    A line may wander within `SAME_LINE` (a dithered laser gyro's does): its power is summed over the band. Lines whose
    angle stays below half of ``quantum``, the step of the readings times the sampling period, are the counter's own
    pattern and are not listed, unless the noise of the readings is `BLURRED` counts or more: it leaves none.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times of a contiguous stretch, from the start of the run [s].
    dt : float
        Sampling period [s].
    values : ndarray, shape (n,)
    quantum : float
    run : int
    lowest : float
    """
    n = len(values)
    if n < FEWEST:
        return ()
    found = periodogram(values, dt)
    f = found.f
    # At half the sampling rate cosine and sine are one column: readings that alternate are no line with an amplitude.
    height = heights(values, found)
    ratio = np.where((f > lowest) & (f < 0.5 / dt - EDGE / (n * dt)), height, 0)
    threshold = np.log(BETWEEN * n / 2 / FALSE_ALARM)
    blurred = float(np.median(found.background)) >= (BLURRED * quantum / dt) ** 2
    lines: list[Line] = []
    left = values - values.mean()
    for _ in range(MOST_LINES):
        peak = int(ratio.argmax())
        if ratio[peak] < threshold:
            break
        low, high = _reach(found, peak, SAME_LINE / 2)
        p = min(1.0, float(np.exp(-min(height[peak], 700.0)) * BETWEEN * n / 2))
        line = replace(line_at(t, dt, left, found, peak, run, SAME_LINE / 2), p_value=p)
        ratio[(f > low - SAME_LINE / 2) & (f < high + SAME_LINE / 2)] = 0
        # One that wanders as far as half the sampling rate is noise that rises, as that of an angle in steps.
        at_the_end = line.frequency + line.frequency_sd > 0.5 / dt
        if not at_the_end and (blurred or not within_half_a_count(line.amplitude, line.frequency, quantum)):
            lines.append(line)
    return tuple(sorted(lines, key=lambda line: -line.amplitude))


def folds(line: Line, width: float) -> bool:
    """Whether means over ``width`` [s] fold a line that wanders and is just too fast for them to something near."""
    return not line.steady and line.frequency < WANDERS / width


def multiple(frequency: float, base: float, most: int, near: float) -> int:
    """Which multiple of a ``base`` a frequency is, as nearly as ``near`` (all [Hz]); 0 of none up to the ``most``."""
    order = round(frequency / base)
    return order if 1 <= order <= most and abs(frequency - order * base) <= near else 0


def within_half_a_count(amplitude: float, frequency: float, count: float) -> bool:
    """Whether the angle of a line stays within half a ``count`` of the readings [rad]: their counter's own pattern.

    Of a line's amplitude [rad/s] and frequency [Hz].

    At a steady rate what a counter carries over from row to row is a saw tooth of one count.
    """
    return amplitude / (2 * np.pi * frequency) <= HALF_A_COUNT * count


def steps_of_encoder(line: Line, dt: float, left: Floats, reference: Floats, step: float) -> bool:
    """Whether a line of ``left`` is what the steps of an angle make of a steady rate, and no line of the instrument.

    At a steady rate an angle read in steps of q is late by a saw tooth of q: lines of the rate less than pi f q tall,
    at frequencies that sampling folds. They stand in the reference, and what the instrument reads has none.

    Parameters
    ----------
    line : Line
    dt : float
        Time between the values [s].
    left, reference : ndarray, shape (n,)
        What is left of the readings, and what was subtracted from them: the rate of the reference.
    step : float
        To which the angle is read [rad].
    """
    if line.amplitude > np.pi * line.frequency * step or _of_reading(line.frequency, dt, left, reference):
        return False
    own, other = periodogram(left, dt), periodogram(reference, dt)
    band = np.abs(own.f - line.frequency) <= max(0.5 * SAME_LINE, 2 / (len(left) * dt))
    return bool(other.power[band].sum() > IN_REFERENCE * own.power[band].sum())


def of_reference(frequency: float, dt: float, left: Floats, reference: Floats) -> bool:
    """Whether a line of ``left`` stands in what was subtracted and not in the readings: it is no line of theirs.

    So do the steps of an encoder behind a rate that a drive has filtered, its graduation, or a lamp that flickers.
    Changes of the motion have power at each frequency: they are left out where the line lasts between them.

    Parameters
    ----------
    frequency : float
        Of the line [Hz].
    dt : float
        Time between the values [s].
    left, reference : ndarray, shape (n,)
        What is left of the readings, and what was subtracted from them.
    """
    own, read, _ = _powers(frequency, dt, left, reference)
    return read < IN_READING * own


def _of_reading(frequency: float, dt: float, left: Floats, reference: Floats) -> bool:
    """Whether a line of ``left`` stands in the readings and not in what was subtracted."""
    own, _, other = _powers(frequency, dt, left, reference)
    return other < IN_READING * own


def _powers(frequency: float, dt: float, left: Floats, reference: Floats) -> tuple[float, float, float]:
    """Power of a line in what is left, in the readings and in the reference, between changes of the motion."""
    own = read = other = 0.0
    for part in _between_changes(left + reference, math.ceil(CYCLES / (frequency * dt))):
        n = np.arange(part.stop - part.start)
        wave = np.sin(np.pi * (n + 0.5) / len(n)) ** 2 * np.exp(-2j * np.pi * frequency * dt * n)
        here, there = (complex((x[part] - x[part].mean()) @ wave) for x in (left, reference))
        own, read, other = own + abs(here) ** 2, read + abs(here + there) ** 2, other + abs(there) ** 2
    return own, read, other


def _between_changes(reading: Floats, least: int) -> list[slice]:
    """Parts of ``least`` values and more between changes of the motion, whose spectra reach far; else the whole."""
    steps = np.abs(np.diff(reading))
    edges = np.flatnonzero(steps > CHANGES * np.median(steps)) + 1
    parts = [slice(a, b) for a, b in pairwise([0, *edges.tolist(), len(reading)]) if b - a >= least]
    return parts or [slice(0, len(reading))]


def of_motion(frequency: float, dt: float, left: Floats, reference: Floats) -> bool:
    """Whether the motion has a line where ``left`` has one, or is as loud there: steps of who carries the unit, say.

    What a filter, a soft mount or another axis makes of such motion is left of it, and no line of the instrument.

    Parameters
    ----------
    frequency : float
        Of the line that is left [Hz].
    dt : float
        Time between the values [s].
    left, reference : ndarray, shape (n,)
        What is left of the readings, and what was subtracted from them.
    """
    own, other = periodogram(left, dt), periodogram(reference, dt)
    band = _about(own, frequency, len(left) * dt)
    return _share(own, other, band) > (MOTION_LINE if has_line(other, band) else MOTION_ANY)


def beyond_motion(frequency: float, dt: float, left: Floats, reference: Floats) -> bool:
    """Whether a line that is left is taller than what a response makes of the motion; arguments as of `of_motion`.

    A response is smooth: what is left beside the line, noise and all, bounds it. Steps of a staircase have power at all
    frequencies, far more than a line of a gyro, and no line.
    """
    own, other = periodogram(left, dt), periodogram(reference, dt)
    band = _about(own, frequency, len(left) * dt)
    peak = int(np.flatnonzero(band)[own.power[band].argmax()])
    beside = band.copy()
    beside[max(0, peak - OWN_WIDTH) : peak + OWN_WIDTH + 1] = False
    if beside.sum() < LEAST_BESIDE:
        return False
    response = _share(other, own, beside)
    return bool(own.power[peak] > np.log(BETWEEN * band.sum() / FALSE_ALARM) * response * other.power[peak])


def share_of_motion(frequency: float, dt: float, left: Floats, reference: Floats) -> float:
    """Power of the reference about a frequency in that of what is left there; arguments as of `of_motion`."""
    own = periodogram(left, dt)
    return _share(own, periodogram(reference, dt), _about(own, frequency, len(left) * dt))


def _share(own: Periodogram, other: Periodogram, band: NDArray[np.bool_]) -> float:
    """Power of one periodogram in a band, in that of its ``own``."""
    return float(other.power[band].sum()) / max(float(own.power[band].sum()), 1e-300)


def _about(found: Periodogram, frequency: float, span: float) -> NDArray[np.bool_]:
    """Frequencies about one that a stretch of ``span`` seconds does not tell from it."""
    return np.asarray(np.abs(found.f - frequency) <= max(0.5 * SAME_LINE, 2 / span))


def has_line(values: Periodogram, band: NDArray[np.bool_]) -> bool:
    """Whether a periodogram has a line in a ``band`` of its frequencies, that was known before it was looked at."""
    peak = float((values.power / values.background)[band].max(initial=0.0))
    return peak > np.log(BETWEEN * max(int(band.sum()), 1) / FALSE_ALARM)


def again(line: Line, dt: float, values: Floats) -> bool:
    """Whether other ``values`` every ``dt`` seconds have a peak where the line is, as far from it as lines wander."""
    n = len(values)
    if n < FEWEST:
        return False
    found = periodogram(values, dt)
    band = np.abs(found.f - line.frequency) <= max(SAME_LINE, 3 * line.frequency_sd)
    peak = float(heights(values, found)[band].max(initial=0.0))
    return peak > np.log(BETWEEN * max(int(band.sum()), 1) / CONFIRMED)


@dataclass(frozen=True)
class Periodogram:
    """Power with a Hann window in units of the variance of white samples, its background; frequencies [Hz]."""

    f: Floats
    power: Floats
    background: Floats


def periodogram(values: Floats, dt: float) -> Periodogram:
    """Power and background of samples every ``dt`` seconds."""
    n = len(values)
    window = np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    size = next_fast_len(n)
    power = np.abs(rfft((values - values.mean()) * window, size)) ** 2 / np.sum(window**2)
    f = rfftfreq(size, dt)
    return Periodogram(f, power, _background(power, f))


def heights(values: Floats, found: Periodogram) -> Floats:
    """Power over its background, the largest at a frequency of ``found`` and half a step beside it, shape (m,).

    A line half way between two frequencies has 0.72 of its power at each: one that stands out would not.
    """
    n, size = len(values), next_fast_len(len(values))
    window = np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    power = np.abs(rfft((values - values.mean()) * window, 2 * size)) ** 2 / np.sum(window**2)
    between = np.append(power[1::2], 0.0)[: len(found.f)]
    return np.maximum(np.maximum(found.power, between), np.append(0.0, between[:-1])) / found.background


def with_others(found: Periodogram, height: Floats, dt: float, others: Floats) -> Floats:
    """Heights with those that other values have at the same frequencies, as one alone of the same probability.

    Of two peaks of noise, exponential each, the sum x is exceeded with (1 + x) exp(-x); the second is the largest of
    `SIDE` frequencies, and both ways to stand out have a half of their probability (R. A. Fisher, Statistical Methods
    for Research Workers, 4th ed., 1932, section 21.1).

    Parameters
    ----------
    found : Periodogram
    height : ndarray, shape (m,)
        Of the values that were looked at, as `heights` gives them.
    dt : float
        Time between the values, and between the others [s].
    others : ndarray, shape (n,)
    """
    if len(others) < FEWEST:
        return height
    own = periodogram(others, dt)
    largest = maximum_filter1d(heights(others, own), SIDE)
    then = largest[np.minimum(np.rint(found.f / own.f[1]).astype(int), len(largest) - 1)]
    total = np.maximum(height + then - np.log(SIDE * BETWEEN), 0.0)
    return np.maximum(height, np.where(then > RECURS, total - np.log1p(total) - np.log(2), 0.0))


def _reach(found: Periodogram, peak: int, half: float) -> tuple[float, float]:
    """From where to where a line reaches [Hz]: ``half`` on both sides of its peak, and on while it is loud."""
    f, step = found.f, float(found.f[1])
    size = 2 * int(np.ceil(min(0.5 * SMOOTHED, 0.5 * half) / step)) + 1
    most = int(np.ceil(max(half, WIDEST * f[peak]) / step))
    least = int(np.ceil(half / step))
    start, stop = max(0, peak - most - size), min(len(f), peak + most + size + 1)
    loud = uniform_filter1d(found.power[start:stop] / found.background[start:stop], size) > LOUDER
    ends = []
    for way in (-1, 1):
        at = least
        while at < most and 0 <= peak + way * at - start < len(loud) and loud[peak + way * at - start]:
            at += 1
        ends.append(float(f[peak]) + way * at * step)
    return ends[0], ends[1]


def line_at(t: Floats, dt: float, values: Floats, found: Periodogram, peak: int, run: int, half: float) -> Line:
    """The line at a ``peak`` of the periodogram of ``values``, which reaches at least ``half`` [Hz] on both sides."""
    f, power, background = found.f, found.power, found.background
    n = len(values)
    low, high = _reach(found, peak, half)
    band = (f > low) & (f < high)
    excess = max(0.0, float(np.sum(power[band] - background[band]))) / len(f)
    p = min(1.0, float(np.exp(-min((power / background)[peak], 700.0)) * n / 2))
    amplitude_sd = float(np.sqrt(2 * background[peak] / n))
    frequency, c, s = _sinusoid(t, dt, values, float(f[peak]))
    steady_power = 0.5 * (c**2 + s**2)
    uncertain = 2 * float(background[peak]) * np.sqrt(band.sum()) / len(f)
    amplitude = float(np.hypot(c, s))
    if steady_power > STEADY * excess - uncertain and amplitude > LEAST_STEADY * amplitude_sd:
        frequency_sd = float(np.sqrt(6) * amplitude_sd / (np.pi * n * dt * amplitude))
        share = min(1.0, steady_power / float(np.var(values)))
        phase = float(np.arctan2(-s, c))
        return Line(run, frequency, frequency_sd, amplitude, amplitude_sd, phase, True, share, p)
    centre = float(np.sum(f[band] * power[band]) / np.sum(power[band]))
    width = float(np.sqrt(np.sum(power[band] * (f[band] - centre) ** 2) / np.sum(power[band])))
    share = min(1.0, excess / float(np.var(values)))
    return Line(run, centre, width, float(np.sqrt(2 * excess)), amplitude_sd, 0.0, False, share, p)


def _sinusoid(t: Floats, dt: float, values: Floats, near: float) -> tuple[float, float, float]:
    """Frequency [Hz] near ``near``, and cosine and sine amplitudes, of the sinusoid that takes out most power."""
    step = 1 / (len(values) * dt)

    def lost(frequency: float) -> float:
        return -float(np.abs(values @ np.exp(-2j * np.pi * frequency * t)))

    best = minimize_scalar(lost, bounds=(near - step, near + step), method="bounded", options={"xatol": 1e-4 * step})
    basis = np.column_stack([np.cos(2 * np.pi * best.x * t), np.sin(2 * np.pi * best.x * t)])
    c, s = np.linalg.lstsq(basis, values, rcond=None)[0]
    return float(best.x), float(c), float(s)


def _background(power: Floats, f: Floats) -> Floats:
    """Level of the noise around each frequency: a running median over a few hundred bins, robust against lines."""
    width = int(np.clip(len(f) // 16, 65, 1025)) | 1
    coarse = max(1, len(f) // 20000)
    medians = median_filter(power[::coarse], size=max(9, width // coarse) | 1, mode="reflect") / np.log(2)
    return np.maximum(np.interp(f, f[::coarse], medians), 1e-300)


def quantum(samples: Floats) -> float:
    """Step between values of quantised samples; 0 where the samples are not quantised coarsely."""
    values = np.unique(samples[:: max(1, len(samples) // 20000)])
    if len(values) < 2 or len(values) > 2000:
        return 0.0
    steps = np.diff(values)
    step = float(steps[steps > 1e-6 * np.ptp(values)].min())
    multiples = (values - values[0]) / step
    return step if np.abs(multiples - np.rint(multiples)).max() < 0.05 else 0.0
