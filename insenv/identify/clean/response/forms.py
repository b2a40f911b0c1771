"""What is behind a lag: a delay, a filter or a mean, whichever leaves least at the frequencies of the motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from insenv.core.recording import Floats, Recording, Response
from insenv.core.series.robust import OF_MEDIAN
from insenv.identify.clean.response.fit import FAR, fitted, seen, slack_of, slope_of
from insenv.identify.clean.response.stretches import Stretch, with_form

#: Logarithm of the likelihood ratio from which the lag is a filter's, and frequencies beside each other that count as
#: one; share of the square sum of the rate at those of the motion.
DECISIVE, CORRELATED, MOTION = 5.0, 2.0, 0.999
#: The same beside a filter, for one more parameter; windows tried, and the longest one, in seconds and in lags: a mean
#: that is late by less than an eighth of its window would have to look ahead.
ONE_MORE, TRIES, MOST_WINDOW, LATEST = 4.0, 8, 1.0, 8.0
#: Share of what is added to a mean, squared, that may be wrong in it: about a third of the added.
MISSED = 0.1


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
    delayed = follow(parts, lags, lag_of, held, filtered=False)
    if not lag_of:
        return delayed
    best = delayed
    filtered = follow(parts, lags, lag_of, held, filtered=True)
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


def follow(
    parts: list[Stretch],
    lags: dict[int, float],
    lag_of: set[int],
    held: tuple[float, dict[int, float]] | None,
    filtered: bool,
    window: float = 0.0,
) -> Followed:
    """The fit with a reference of one form: late by a delay, smoothed by a filter, or a mean over a window."""
    own = [replace(s, exposure=with_form(s.exposure, filtered, window)) for s in parts]
    gain, sd, found = fitted(own, lags, lag_of, held)
    left = {
        s.run: _at_motion(
            was, s.y - gain * seen(s, found[s.run], held), slack_of(s, slope_of(s, found[s.run], held), held)
        )
        for was, s in zip(parts, own, strict=True)
        if s.run in lag_of
    }
    return Followed(gain, sd, found, filtered, left, window)


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
        tried.append(follow(parts, lags, lag_of, held, filtered=False, window=float(np.exp(log_window))))
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


def with_response(
    recordings: tuple[Recording, ...], target: str, gain: float, found: Followed
) -> tuple[Recording, ...]:
    """The recordings with gain and lags said; of a run that tells none, the mean of the others' lags."""
    usual = float(np.mean(list(found.lags.values()))) if found.lags else 0.0
    each = [
        Response(gain, found.lags.get(run, usual), 0, found.filtered, found.window) for run in range(len(recordings))
    ]
    return tuple(replace(r, responses={**r.responses, target: one}) for r, one in zip(recordings, each, strict=True))
