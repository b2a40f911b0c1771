r"""What a frame of the rate table shows.

The residual of a step at a steady rate is the mean of the gyro's rate less that of the table by its encoder, d. Of the
levels of the present power-up, means d_j over the time T_j at the rates W_j, a line is taken by weights T_j:

    r_j = (d_j - a - b W_j) / max |W|,    band: 2 N / sqrt(T_j) / max |W|

with N the angle random walk that the datasheet tells. Without levels at three rates there is no line.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from insenv.core.recording import Floats

#: Rates that differ by less are one level [rad/s].
SAME_RATE = 1e-5
_NOTHING: Floats = np.zeros(0)


@dataclass(frozen=True)
class History:
    """One value for each step of the run so far.

    Attributes
    ----------
    time : ndarray, shape (k,)
        End of the step [s].
    rate : ndarray, shape (k,)
        Mean table rate by the encoder [rad/s].
    steady : ndarray, shape (k,)
        1 where the table turned evenly, else 0.
    residual : ndarray, shape (k,)
        Mean gyro rate less table rate [rad/s].
    power_up : ndarray, shape (k,)
        Number of the power-up.
    scale_factor : ndarray, shape (k, 3)
        True error, believed mean and standard deviation; NaN where nothing is believed.
    """

    time: Floats = field(default_factory=lambda: _NOTHING)
    rate: Floats = field(default_factory=lambda: _NOTHING)
    steady: Floats = field(default_factory=lambda: _NOTHING)
    residual: Floats = field(default_factory=lambda: _NOTHING)
    power_up: Floats = field(default_factory=lambda: _NOTHING)
    scale_factor: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    def then(self, values: tuple[float, float, float, float, float], scale_factor: Floats) -> History:
        """The history with one step more; ``values`` of the attributes in their order."""
        old = (self.time, self.rate, self.steady, self.residual, self.power_up)
        time, rate, steady, residual, power_up = (np.append(row, v) for row, v in zip(old, values, strict=True))
        known = np.concatenate([self.scale_factor, scale_factor[None]])
        return History(time, rate, steady, residual, power_up, known)


@dataclass(frozen=True)
class View:
    """One frame.

    Attributes
    ----------
    time, duration : float
        Since the start of the run, and its length at most [s].
    table_angle : float
        Cumulative [rad].
    rate, largest : float
        Table rate now, and its limit [rad/s].
    temperature : float
        Of the instrument [K].
    power_up : int
    noise : float
        Angle random walk [rad/sqrt(s)].
    true_rates, true_errors : ndarray, shape (g,)
        Curve of the error of the warm gyro over the rate, both [rad/s].
    history : History
    title : str
    demanded : float or None
        Standard deviation of the scale factor that is wanted; None: there is no estimator.
    """

    time: float
    duration: float
    table_angle: float
    rate: float
    largest: float
    temperature: float
    power_up: int
    noise: float
    true_rates: Floats
    true_errors: Floats
    history: History = field(default_factory=History)
    title: str = ""
    demanded: float | None = None


@dataclass(frozen=True)
class LevelLine:
    """Levels in the order of their rates, shape (m,): rates [rad/s], residuals and band as shares of the largest rate.

    ``curve`` is the true error less its own line at those rates, at ``View.true_rates``.
    """

    rate: Floats
    residual: Floats
    band: Floats
    curve: Floats


def line(view: View) -> LevelLine | None:
    """The line of the present power-up (see the module's opening); None while there is none."""
    h = view.history
    own = (h.power_up == view.power_up) & (h.steady > 0)
    if not own.any():
        return None
    rate, level = np.unique(np.round(h.rate[own] / SAME_RATE) * SAME_RATE, return_inverse=True)
    if len(rate) < 3:
        return None
    steps = np.bincount(level).astype(float)
    mean = np.bincount(level, h.residual[own]) / steps
    seconds = steps * (h.time[0] if len(h.time) else 1.0)
    largest = float(np.abs(rate).max())
    true = np.interp(rate, view.true_rates, view.true_errors)
    left = view.true_errors - np.polyval(np.polyfit(rate, true, 1, w=np.sqrt(seconds)), view.true_rates)
    fitted = np.polyval(np.polyfit(rate, mean, 1, w=np.sqrt(seconds)), rate)
    return LevelLine(rate, (mean - fitted) / largest, 2 * view.noise / np.sqrt(seconds) / largest, left / largest)
