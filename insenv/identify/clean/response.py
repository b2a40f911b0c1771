r"""How an output follows the table: gain and lag, before anything relative to the input is looked for.

    y = g u(t - tau_r) + b_r + noise

A gain of -0.87 is an axis that points the other way with a scale of its own: no small error, and what multiplies the
rate (a skew, a held output, an asymmetry) is a share of what the instrument makes of it, g u. g is one for all runs,
the lag tau_r one for each: clocks are started anew. u is the motion behind the encoder's noise
(`insenv.core.series.trajectory`), shifted exactly. Gauss and Newton from the lag at which y and u correlate most, with
Tukey's weights: rows in which a table is on its way to a commanded rate are not to bend the gain. Of a command that
jumps the ends of its dwells are asked alone.

Nothing is taken out by this. Gains near one and lags beside an exact reference stay as they are: the search has effects
for them. Source of the weights: P. J. Huber and E. M. Ronchetti, Robust Statistics (2009), section 4.8.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.motion import Motion, interval_slope
from insenv.core.recording import Floats, Recording, Response
from insenv.core.series.robust import OF_MEDIAN, robust_deviation
from insenv.core.series.stretches import stretches as in_a_row
from insenv.data.cells.follow import correlation
from insenv.data.exposure import Exposure, expose
from insenv.data.reference import order
from insenv.effects.timing import before_mean, earlier, held_values
from insenv.identify.clean.ramps import ends_of_dwells
from insenv.identify.fit.problem import Model

#: Departure of a gain from one up to which it is a small error, as any other.
SMALL = 0.005
#: Departure from which a scale factor that was not declared is none: no effect's.
INCREDIBLE = 0.5
#: Least change of a rate, as a share of it, beside which a gain is told from a bias.
CHANGING = 0.01
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
#: Share of the fitted rows below which the longest stretch without a gap is one of many pieces.
SHREDDED = 0.1
#: Scatter of the rate in a stretch, as a share of that of all fitted rows, below which it lacks the motion.
LIVELY = 0.1
#: Fewest rows that tell a gain, longest lag [s], and rows of a run that are looked at.
FEWEST, LONGEST, MOST_ROWS = 64, 0.5, 40_000
#: Rows by which a lag is always looked for: what is read once a second may be seconds late.
ROWS = 10
#: Longest lag of two clocks that were never set by each other [s], the correlation, squared, from which on the reading
#: follows the input, and by how much it must be larger there.
FARTHEST, FOLLOWS, FAR_BETTER = 2.0, 0.25, 4.0
#: Logarithm of the likelihood ratio from which the lag is a filter's, and frequencies beside each other that count as
#: one; share of the square sum of the rate at those of the motion.
DECISIVE, CORRELATED, MOTION = 5.0, 2.0, 0.999
#: The same beside a filter, for one more parameter; windows tried, and the longest one, in seconds and in lags: a mean
#: that is late by less than an eighth of its window would have to look ahead.
ONE_MORE, TRIES, MOST_WINDOW, LATEST = 4.0, 8, 1.0, 8.0
#: Share of what is added to a mean, squared, that may be wrong in it: about a third of the added.
MISSED = 0.1
#: Passes, the departure in robust deviations from which a row has no weight, and the change of a lag in rows and of the
#: gain in its deviations that is none.
PASSES, FAR, SETTLED = 8, 5.0, 1e-3
#: Share of the range of the readings within which they are one number, and a gain that may be on its way to none.
SAME, NOTHING = 1e-6, 0.1


@dataclass(frozen=True)
class Stretch:
    """Cells ``start`` to ``stop`` of a run, one a row; ``used`` are those of them that may be fitted, None: all.

    Reading and input are running means ``over`` so many cells.
    """

    run: int
    exposure: Exposure
    start: int
    stop: int
    used: NDArray[np.bool_] | None = None
    over: int = 1

    @property
    def y(self) -> Floats:
        """The reading, shape (n,)."""
        return self._mean(self.exposure.y[self.start : self.stop])

    @property
    def known(self) -> Floats:
        """Cells that hold a row and may be fitted, shape (n,)."""
        there = self.exposure.count[self.start : self.stop] > 0
        known = (there if self.used is None else there & self.used).astype(float)
        return known if self.over == 1 else np.asarray(self._mean(known) > 1 - 0.5 / self.over, np.float64)

    def input(self, lag: float) -> Floats:
        """The input ``lag`` seconds earlier, shape (n,)."""
        return self._mean(self.whole(lag)[self.start : self.stop])

    def _mean(self, values: Floats) -> Floats:
        if self.over == 1:
            return values
        from scipy.ndimage import uniform_filter1d  # slow to import

        return np.asarray(uniform_filter1d(values, self.over, mode="nearest"))

    def whole(self, lag: float) -> Floats:
        """The same of the whole run."""
        return lagged(self.exposure, lag)

    def held(self, lag: float, hold: float, phase: float) -> Floats:
        """The input that a held output shows, shape (n,)."""
        u = self.whole(lag)
        return self._mean((u + held_part(self.exposure.motion, u, hold, phase))[self.start : self.stop])


def lagged(exposure: Exposure, lag: float) -> Floats:
    """Input of an exposure ``lag`` seconds earlier, before a first-order filter of ``-lag`` or a mean, shape (n,)."""
    motion = exposure.motion
    if not lag or motion.rate_edges is None:
        return exposure.u
    if motion.filtered:
        return np.asarray(exposure.u - lag * interval_slope(motion.rate_edges, motion.dt))
    return earlier(*before_mean(exposure.u, motion.rate_edges, motion), motion, lag)


def with_form(exposure: Exposure, filtered: bool, window: float) -> Exposure:
    """The exposure whose reference came through a filter, or is a mean over ``window``: that is undone at once."""
    motion = replace(exposure.motion, filtered=filtered, window=window)
    if not window or motion.rate_edges is None:
        return replace(exposure, motion=motion)
    u, edges = before_mean(exposure.u, motion.rate_edges, motion)
    return replace(exposure, u=u, motion=replace(motion, rate_edges=edges, window=0.0))


def held_part(motion: Motion, u: Floats, hold: float, phase: float) -> Floats:
    """What holding adds to ``u``, where a value was renewed ``phase`` seconds before the start of the run.

    The value that is held at first is older than the data: it is read off the line through the first two.
    """
    begin, end = float(motion.t[0]) + phase, float(motion.t[-1]) + phase
    dt = (end - begin) / motion.n if motion.step is None else motion.step
    hold = max(hold, motion.dt)
    age = np.floor((begin % hold) / motion.dt + 0.5 - 1e-6)
    # As `SampleHold` adds: thousands are tried, and what an effect asks first costs more than to hold.
    source = np.concatenate([[u[0] - age * (u[1] - u[0])], u])
    return held_values(source, max(hold / dt, 1.0), round(begin / dt)) - u


def stretch(exposure: Exposure, run: int, span: slice) -> Stretch | None:
    """The liveliest cells of a fitted span; None where the table does not change its rate."""
    cells = exposure.cell_of_row[span]
    cells = cells[cells >= 0]
    if len(cells) < FEWEST:
        return None
    start, stop = int(cells[0]), int(cells[-1]) + 1
    if stop - start > MOST_ROWS:
        moved = np.concatenate([[0.0], np.cumsum(np.diff(exposure.u[start:stop]) ** 2)])
        start += int(np.argmax(moved[MOST_ROWS - 1 :] - moved[: -(MOST_ROWS - 1)]))
        stop = start + MOST_ROWS
    u = exposure.u[start:stop]
    return Stretch(run, exposure, start, stop) if np.ptp(u) > CHANGING * np.abs(u).max() else None


def in_pieces(exposure: Exposure, run: int, rows: NDArray[np.bool_]) -> Stretch | None:
    """All cells of a run of which no stretch is long enough, those of ``rows`` alone to be fitted."""
    cells = exposure.cell_of_row[rows]
    cells = cells[cells >= 0]
    if len(cells) < FEWEST // 8 or cells[-1] - cells[0] > MOST_ROWS:
        return None
    start, stop = int(cells[0]), int(cells[-1]) + 1
    used = np.zeros(stop - start, bool)
    used[cells - start] = True
    u = exposure.u[cells]
    return Stretch(run, exposure, start, stop, used) if np.ptp(u) > CHANGING * np.abs(u).max() else None


def stretches(
    recordings: tuple[Recording, ...],
    spans: tuple[slice, ...],
    target: str,
    rows: tuple[NDArray[np.bool_], ...] = (),
) -> list[Stretch]:
    """The `stretch` of each recording that has one; of one that gaps cut to pieces, its fitted ``rows``."""
    exposures = [expose(one, target) for one in recordings]
    whole = [stretch(one, run, span) for run, (one, span) in enumerate(zip(exposures, spans, strict=True))]
    few = not any(whole)
    for run, (exposure, fit) in enumerate(zip(exposures, rows, strict=False)):
        shredded = spans[run].stop - spans[run].start < SHREDDED * int(fit.sum())
        if few or shredded or _all_but_steady(exposure, whole[run], fit):
            whole[run] = in_pieces(exposure, run, fit) or whole[run]
    return [one for one in whole if one]


def _all_but_steady(exposure: Exposure, one: Stretch | None, rows: NDArray[np.bool_]) -> bool:
    """Whether the table goes at one rate in a stretch and at others in the rest: errors of that rate tell no gain."""
    cells = exposure.cell_of_row[rows]
    cells = cells[cells >= 0]
    if one is None or not len(cells):
        return False
    return float(np.std(exposure.u[one.start : one.stop])) < LIVELY * float(np.std(exposure.u[cells]))


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
    found = likelier(parts, lags, own) if forms else _followed(parts, lags, own, None, filtered=False)
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


def with_response(
    recordings: tuple[Recording, ...], target: str, gain: float, found: Followed
) -> tuple[Recording, ...]:
    """The recordings with gain and lags said; of a run that tells none, the mean of the others' lags."""
    usual = float(np.mean(list(found.lags.values()))) if found.lags else 0.0
    each = [
        Response(gain, found.lags.get(run, usual), 0, found.filtered, found.window) for run in range(len(recordings))
    ]
    return tuple(replace(r, responses={**r.responses, target: one}) for r, one in zip(recordings, each, strict=True))


@dataclass(frozen=True)
class Followed:
    """Gain with its standard deviation, the lag of each run, and what is behind it: a delay, a filter or a mean.

    ``window`` is the time over which the reference is a mean [s]. ``left`` has for each run with a lag of its own the
    mean square of what is left at the frequencies of the motion, and how many they are.
    """

    gain: float
    sd: float
    lags: dict[int, float]
    filtered: bool
    left: dict[int, tuple[float, int]]
    window: float = 0.0

    @property
    def log_likelihood(self) -> float:
        """Up to a constant: Gaussian, with a noise of its own in every run."""
        return -0.5 / CORRELATED * sum(count * float(np.log(max(power, 1e-300))) for power, count in self.left.values())


def likelier(
    parts: list[Stretch],
    lags: dict[int, float],
    lag_of: set[int],
    held: tuple[float, dict[int, float]] | None = None,
) -> Followed:
    """The fit with lags that are delays, or that of a smoothed reference where it is far likelier.

    What is logged of an encoder is often smoothed: by a first-order filter, or as counts over a time, which is a mean
    over a window. It is late, and the faster the motion the smaller. Taken for a delay, that leaves a gain that grows
    with the rate of the motion. Delay and filter have the same parameters, a mean has one more.
    """
    delayed = _followed(parts, lags, lag_of, held, filtered=False)
    if not lag_of:
        return delayed
    best = delayed
    filtered = _followed(parts, lags, lag_of, held, filtered=True)
    # A filter of the reference makes it late: the output leads.
    leads = all(lag <= 0 for run, lag in filtered.lags.items() if run in lag_of)
    if leads and filtered.log_likelihood > best.log_likelihood + DECISIVE:
        best = filtered
    mean = _mean_over(parts, delayed.lags, lag_of, held)
    if mean is not None and mean.log_likelihood > max(
        delayed.log_likelihood + DECISIVE, best.log_likelihood + ONE_MORE
    ):
        best = mean
    return best


def _mean_over(
    parts: list[Stretch], lags: dict[int, float], lag_of: set[int], held: tuple[float, dict[int, float]] | None
) -> Followed | None:
    """The fit with a reference that is a mean over the likeliest window; None where lags are too short to tell one."""
    late = min(abs(lags[run]) for run in lag_of)
    shortest, longest = 2 * parts[0].exposure.motion.dt, min(MOST_WINDOW, LATEST * late)
    if longest <= shortest:
        return None
    tried: list[Followed] = []

    def loss(log_window: float) -> float:
        tried.append(_followed(parts, lags, lag_of, held, filtered=False, window=float(np.exp(log_window))))
        return -tried[-1].log_likelihood

    from scipy.optimize import minimize_scalar  # slow to import

    ends = float(np.log(shortest)), float(np.log(longest))
    minimize_scalar(loss, bounds=ends, method="bounded", options={"xatol": 0.05, "maxiter": TRIES})
    sound = [one for one in tried if all(_undone(s, one.window) for s in parts if s.run in lag_of)]
    return max(sound, key=lambda one: one.log_likelihood, default=None)


def _undone(one: Stretch, window: float) -> bool:
    """Whether what stands for the motion before a mean over a window has the reference for its mean, or nearly so.

    Of motion as fast as the window is long it has not, and is no more than a curve that is larger at some frequencies:
    a gyro behind a filter of its own, which makes fast motion smaller, had such a reference, and a gain 10 % short.
    """
    power, frequency = _motion(one)
    mean = np.sinc(frequency * window)
    added = mean**4 * ((1 - mean) + 5 * (1 - mean) ** 2)
    missed = 1 - mean * (1 + added)
    return float(power @ missed**2) < MISSED * float(power @ added**2)


def _followed(
    parts: list[Stretch],
    lags: dict[int, float],
    lag_of: set[int],
    held: tuple[float, dict[int, float]] | None,
    filtered: bool,
    window: float = 0.0,
) -> Followed:
    own = [replace(s, exposure=with_form(s.exposure, filtered, window)) for s in parts]
    gain, sd, found = fitted(own, lags, lag_of, held)
    left = {
        s.run: _at_motion(
            was, s.y - gain * _seen(s, found[s.run], held), _slack(s, _slope(s, found[s.run], held), held)
        )
        for was, s in zip(parts, own, strict=True)
        if s.run in lag_of
    }
    return Followed(gain, sd, found, filtered, left, window)


def _at_motion(one: Stretch, left: Floats, slack: Floats) -> tuple[float, int]:
    """Mean square of what is left at the frequencies of the motion, and how many they are.

    Beyond them there is only noise, and a form that makes fast motion larger makes that larger too.
    """
    from scipy.fft import dct  # slow to import

    known = one.known > 0
    left = np.where(known, left - np.median(left[known]), 0.0)
    bound = FAR * OF_MEDIAN * float(np.median(np.abs(left[known]))) + slack
    count = len(_motion(one)[0])
    modes = dct(np.clip(left, -bound, bound), norm="ortho")[1 : count + 1]
    return float(np.mean(modes**2)), count


def _motion(one: Stretch) -> tuple[Floats, Floats]:
    """Power of the input in the modes of its motion, and their frequencies [Hz]."""
    from scipy.fft import dct  # slow to import

    u = one.input(0.0)
    power = dct(u, norm="ortho")[1:] ** 2
    count = 1 + int(np.searchsorted(np.cumsum(power), MOTION * float(power.sum())))
    return power[:count], np.arange(1, count + 1) / (2 * len(u) * one.exposure.motion.dt)


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
    line = now + _slope(one, 0.0, None) * lag
    changed = float(np.linalg.norm((then - now) * one.known))
    return abs(lag) > 0 and float(np.linalg.norm((then - line) * one.known)) > BENT * changed > 0


def fitted(
    parts: list[Stretch],
    lags: dict[int, float],
    lag_of: set[int],
    held: tuple[float, dict[int, float]] | None = None,
) -> tuple[float, float, dict[int, float]]:
    """Gain, its standard deviation, and the lags, those of the runs ``lag_of`` fitted.

    ``held`` has a hold time and the phase of each run. A gain next to nothing is asked again by the rows that
    are not all one number.
    """
    found = _fitted(parts, lags, lag_of, held, None)
    if abs(found[0]) > NOTHING:
        return found
    told = _that_change(np.concatenate([s.y for s in parts]), np.concatenate([s.known for s in parts]) > 0)
    return found if told is None else _fitted(parts, lags, lag_of, held, told)


def _fitted(
    parts: list[Stretch],
    lags: dict[int, float],
    lag_of: set[int],
    held: tuple[float, dict[int, float]] | None,
    told: NDArray[np.bool_] | None,
) -> tuple[float, float, dict[int, float]]:
    """The same, the scatter of what is left by the rows ``told``; None: by all."""
    lags, weights, gain, sd = dict(lags), [s.known for s in parts], 1.0, np.inf
    for _ in range(PASSES):
        columns, readings, late = [], [], []
        for k, s in enumerate(parts):
            u = _seen(s, lags[s.run], held)
            slope = _slope(s, lags[s.run], held)
            own = np.zeros((len(u), 1 + 2 * len(parts)))
            own[:, 0], own[:, 1 + 2 * k] = u, 1.0
            own[:, 2 + 2 * k] = slope if s.run in lag_of else 0.0
            columns.append(own)
            readings.append(s.y)
            late.append(_slack(s, slope, held) * (s.run in lag_of))
        matrix, y, w = np.vstack(columns), np.concatenate(readings), np.concatenate(weights)
        size = np.sqrt(np.sum(w[:, None] * matrix**2, axis=0))
        size[size == 0] = 1.0
        scaled = matrix / size * np.sqrt(w)[:, None]
        theta = np.linalg.lstsq(scaled, y * np.sqrt(w), rcond=1e-10)[0]
        left = y - (matrix / size) @ theta
        before, gain = gain, float(theta[0] / size[0])
        scatter = w > 0 if told is None else (w > 0) & told
        spread = robust_deviation(left[scatter]) if np.any(scatter) else 0.0
        sd = spread * float(np.sqrt(max(np.linalg.pinv(scaled.T @ scaled, hermitian=True)[0, 0], 0.0))) / size[0]
        sd *= float(np.sqrt(parts[0].over))  # running means share rows
        moved = 0.0
        for k, s in enumerate(parts):
            if s.run in lag_of and gain:
                change = float(theta[2 + 2 * k] / size[2 + 2 * k]) / gain
                change = float(np.clip(change, -5 * s.exposure.motion.dt, 5 * s.exposure.motion.dt))
                lags[s.run] = float(np.clip(lags[s.run] + change, -FARTHEST - LONGEST, FARTHEST + LONGEST))
                moved = max(moved, abs(change) / s.exposure.motion.dt)
        if spread:
            far = FAR * spread + np.concatenate(late)
            share = np.clip(1 - (left / far) ** 2, 0.0, None) ** 2
            ends = np.cumsum([0, *(len(s.y) for s in parts)])
            weights = [share[a:b] * s.known for s, a, b in zip(parts, ends[:-1], ends[1:], strict=True)]
        if moved < SETTLED and abs(gain - before) < SETTLED * abs(sd):
            break
    return gain, sd, lags


def _that_change(y: Floats, known: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Of readings that are one number most of the time the other rows; None where they are not.

    Below its threshold, or where the table stands and it is coarse, a reading is one number whatever the input does: a
    gain of nothing leaves nothing there, and beside that all rows of the motion are outliers.
    """
    at = np.abs(y - np.median(y[known])) <= SAME * np.ptp(y[known]) if known.any() else known
    rest = known & ~at
    return rest if np.sum(known & at) > np.sum(rest) >= FEWEST // 8 else None


def _seen(one: Stretch, lag: float, held: tuple[float, dict[int, float]] | None) -> Floats:
    return one.input(lag) if held is None else one.held(lag, held[0], held[1][one.run])


def _slope(one: Stretch, lag: float, held: tuple[float, dict[int, float]] | None) -> Floats:
    """Change of what is seen with the lag."""
    step = 0.1 * one.exposure.motion.dt
    return (_seen(one, lag + step, held) - _seen(one, lag - step, held)) / (2 * step)


def _slack(one: Stretch, slope: Floats, held: tuple[float, dict[int, float]] | None) -> Floats:
    """What a row is off by if it is a renewal, or a row, too late: such rows tell the lag, and are no outliers.

    Where a table spins evenly and is stopped now and then, all that tells the lag lies in few rows.
    """
    return np.asarray(np.abs(slope) * (one.exposure.motion.dt if held is None else held[0]))


@dataclass(frozen=True)
class Held:
    """A held output beside gain and lags: its share and the standard deviation of that, and the phase of each run."""

    share: float
    share_sd: float
    phases: tuple[float, ...]


def with_held(
    recordings: tuple[Recording, ...],
    spans: tuple[slice, ...],
    target: str,
    hold: float,
    phases: tuple[float, ...],
    seen: bool = False,
) -> tuple[tuple[Recording, ...], Held | None]:
    """The recordings with lags that are told beside a hold, where the table's reading is noisy.

    A held output is late by half of its hold time: without the hold beside it, that was in the lag. Phases that were
    ``seen`` in the readings stay as they are.
    """
    parts = stretches(recordings, spans, target)
    parts = [s for s in parts if (table := recordings[s.run].table) is not None and not table.still]
    if not parts:
        return recordings, None
    found, lags = dict(enumerate(phases)), {}
    for s in parts:
        dt = s.exposure.motion.dt
        start = s.exposure.motion.lag - 0.5 * (hold - dt)
        unsettled = not seen and hold < MOST_PHASES * dt
        tried = np.arange(round(hold / dt)) * dt if unsettled else np.array([found[s.run]])
        misfits = [_misfit(s, start, hold, phase) for phase in tried.tolist()]
        found[s.run] = float(tried[int(np.argmin(misfits))])
        lags[s.run] = start
    follows = likelier(parts, lags, {s.run for s in parts}, (hold, found))
    form = [replace(s, exposure=with_form(s.exposure, follows.filtered, follows.window)) for s in parts]
    share, sd = _share(form, follows.lags, hold, found)
    old = recordings[parts[0].run].responses.get(target, Response()).gain
    gain = old * follows.gain if old != 1.0 else 1.0
    return with_response(recordings, target, gain, follows), Held(
        share, sd, tuple(found[i] for i in range(len(recordings)))
    )


#: Rows of a hold up to which every phase is tried.
MOST_PHASES = 64


def _misfit(one: Stretch, lag: float, hold: float, phase: float) -> float:
    """Square sum that is left of a run with its own gain, lag and level, at that phase."""
    gain, _, lags = fitted([one], {one.run: lag}, {one.run}, (hold, {one.run: phase}))
    held, known, lag = (hold, {one.run: phase}), one.known > 0, lags[one.run]
    left = (one.y - gain * _seen(one, lag, held))[known]
    left = left - np.median(left)
    bound = FAR * OF_MEDIAN * float(np.median(np.abs(left))) + _slack(one, _slope(one, lag, held), held)[known]
    return float(np.sum(np.minimum(left**2, bound**2)))


def _share(parts: list[Stretch], lags: dict[int, float], hold: float, phases: dict[int, float]) -> tuple[float, float]:
    """Share of the output that is held, of its gain, and its standard deviation: noise is held as well."""
    total, weight = 0.0, 0.0
    for s in parts:
        motion, lag = s.exposure.motion, lags[s.run]
        u = s.input(lag)
        part = held_part(motion, s.whole(lag), hold, phases[s.run])[s.start : s.stop]
        matrix = np.column_stack([u, part, _slope(s, lag, None), np.ones(len(u))])[s.known > 0]
        size = np.linalg.norm(matrix, axis=0)
        scaled = matrix / np.where(size > 0, size, 1.0)
        y = s.y[s.known > 0]
        theta = np.linalg.lstsq(scaled, y, rcond=1e-10)[0]
        noise = float(np.mean((y - scaled @ theta) ** 2)) * max(hold / motion.dt, 1.0)
        variance = noise * float(np.linalg.pinv(scaled.T @ scaled, hermitian=True)[1, 1]) / size[1] ** 2
        gain = float(theta[0] / size[0])
        if variance > 0 and gain:
            own, own_variance = float(theta[1] / size[1]) / gain, variance / gain**2
            total, weight = total + own / own_variance, weight + 1 / own_variance
    return (total / weight, float(weight**-0.5)) if weight else (1.0, np.inf)
