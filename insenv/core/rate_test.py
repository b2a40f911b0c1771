r"""What a rate test found: frozen results in SI units, which the report shows and scripts compare.

    F_j = K (Omega_j + F_0 / K) + nu_j,     K = 1 + scale-factor error,     B_0 = mean output at rest / K

Zhang, DOI 10.11857/j.issn.1674-5124.2016.12.001, after GJB 2426A and IEEE Std 952.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from insenv.core.filing import Filing
from insenv.core.recording import Floats

#: What a nonlinearity is divided by: key -> words. The deviations are those of the dwells from the line, rate by rate.
NORMALISATIONS: Mapping[str, str] = {
    "largest_output": "largest deviation / output at the largest rate",
    "fitted_output": "largest deviation / fitted output at the largest rate",
    "span": "largest deviation / span of the fitted output",
    "reading": "largest deviation / fitted output at the same rate",
    "rms": "rms deviation / output at the largest rate",
}


@dataclass(frozen=True)
class Valued:
    """A value and its standard deviation; NaN where there is none."""

    value: float = float("nan")
    sd: float = float("nan")


@dataclass(frozen=True)
class Dwell:
    """A stretch at one rate.

    Attributes
    ----------
    rate : float
        Of the table about the input axis, mean over the stretch [rad/s].
    output : float
        Mean output over the same stretch [rad/s].
    zero : float
        Static output that is taken off it [rad/s].
    sd : float
        Of ``output - zero``, with the spread from setting to setting [rad/s].
    start, duration : float
        Of what was averaged [s].
    turns : int
        Whole turns that were averaged; 0: no whole turn, the whole stretch was.
    power_up : int
        Which power-up, from 1.
    temperature : float
        Mean [K]; NaN: not measured.
    """

    rate: float
    output: float
    zero: float
    sd: float
    start: float
    duration: float
    turns: int
    power_up: int
    temperature: float = float("nan")


@dataclass(frozen=True)
class LineFit:
    """A straight line through the dwells.

    Attributes
    ----------
    method : str
        "all points", "without flagged" (equal weights), "robust" (Tukey's biweight), "weighted" (without flagged, by
        variance).
    power_up : int
        Which power-up; 0: the means over all of them.
    scale_factor : Valued
        K, output per rate.
    offset : Valued
        F_0 after the static output was taken off [rad/s].
    bias : Valued
        F_0 / K with the static output put back, less the Earth rate where that is known [rad/s].
    rates, residuals, sd : ndarray, shape (M,)
        Of every point, flagged ones too; residual: dwell less line [rad/s].
    weights : ndarray, shape (M,)
        Of the fit; 0: left out.
    nonlinearity : mapping of str to Valued
        By the keys of `NORMALISATIONS`; over the points that the fit used (for "robust": over all).
    noise_alone : float
        Mean of "largest_output" if there were nothing but the noise of the dwells.
    asymmetry : Valued
        |K(+) - K(-)| / mean of both.
    """

    method: str
    power_up: int
    scale_factor: Valued
    offset: Valued
    bias: Valued
    rates: Floats
    residuals: Floats
    sd: Floats
    weights: Floats
    nonlinearity: Mapping[str, Valued]
    noise_alone: float
    asymmetry: Valued


@dataclass(frozen=True)
class Flagged:
    """A rate whose dwells deviate by the rule: mean residual from the robust line [rad/s], in standard deviations."""

    rate: float
    residual: float
    z: float


@dataclass(frozen=True)
class RateLineResult:
    """The scale-factor test.

    Attributes
    ----------
    dwells, zeros : tuple of Dwell
    zero_method : str
        "ends", "interleaved" or "none".
    zero_reason : str
        Why.
    fits : tuple of LineFit
        Of the means over all power-ups, one for each method.
    each : tuple of LineFit
        Of each power-up, by method and power-up.
    flagged : tuple of Flagged
    rule, false_alarm : str, float
        By what points are flagged, and the probability that a sound instrument has any.
    repeatability : mapping of str to Valued
        Of K over the power-ups, relative, by method.
    noise, setting : float
        White noise [rad/sqrt(s)] and spread from setting to setting [rad/s].
    setting_from : str
        What the spread was taken from.
    earth_rate : float
        Taken off the bias [rad/s]; NaN: not known.
    """

    dwells: tuple[Dwell, ...]
    zeros: tuple[Dwell, ...]
    zero_method: str
    zero_reason: str
    fits: tuple[LineFit, ...]
    each: tuple[LineFit, ...]
    flagged: tuple[Flagged, ...]
    rule: str
    false_alarm: float
    repeatability: Mapping[str, Valued]
    noise: float
    setting: float
    setting_from: str
    earth_rate: float = float("nan")

    def fit(self, method: str) -> LineFit:
        """The fit of the means over all power-ups by one method."""
        return next(fit for fit in self.fits if fit.method == method)

    def of_each(self, method: str) -> tuple[LineFit, ...]:
        """The fits of the power-ups by one method."""
        return tuple(fit for fit in self.each if fit.method == method)


@dataclass(frozen=True)
class Stability:
    """Bias stability: standard deviation of means over ``averaging`` [s], of ``count`` of them.

    ``settled``: the same after the time that is given for the warm-up; NaN where nothing was left out or no time is as
    short.
    """

    averaging: float
    value: Valued
    count: int
    settled: Valued = field(default_factory=Valued)


@dataclass(frozen=True)
class AllanTerm:
    """A term of the Allan variance that is no power of the averaging time.

    Attributes
    ----------
    kind : str
        "markov" or "sinusoid".
    shape : float
        Correlation time T [s]; frequency f [Hz].
    square : float
        q^2 [rad^2/s^3]; square of the amplitude [rad^2/s^2].
    """

    kind: str
    shape: float
    square: float

    def variance(self, taus: Floats) -> Floats:
        """Its part of the Allan variance at ``taus``, shape (k,) [rad^2/s^2]."""
        if self.kind == "markov":
            x = taus / self.shape
            # For small x the bracket is x^2 / 3, of which differences of exponentials leave nothing.
            bracket = 1 - (3 - 4 * np.exp(-x) + np.exp(-2 * x)) / (2 * x)
            return np.asarray(self.square * np.where(x < 1e-4, x**2 / 3, bracket) * self.shape**2 / taus, np.float64)
        x = np.pi * self.shape * taus
        return np.asarray(self.square * (np.sin(x) ** 2 / x) ** 2, np.float64)


@dataclass(frozen=True)
class AllanResult:
    """Allan deviation of the record at rest, and the terms fitted to it.

    Attributes
    ----------
    taus, deviation, lower, upper : ndarray, shape (k,)
        [s], [rad/s].
    coefficients : mapping of str to Valued
        SI; NaN where no model of these terms fits.
    p_value : float
        Of the fit; NaN: too few averaging times to tell.
    others : tuple of AllanTerm
        Terms beside the powers of the averaging time.
    left_out : int
        Shortest averaging times that the terms are not of: filters, lines, sway.
    floor : Valued
        Least deviation / 0.664 [rad/s], what the bias instability is at most; NaN where the deviation still falls.
    floor_at : float
        Its averaging time [s].
    """

    taus: Floats
    deviation: Floats
    lower: Floats
    upper: Floats
    coefficients: Mapping[str, Valued]
    p_value: float = float("nan")
    others: tuple[AllanTerm, ...] = ()
    left_out: int = 0
    floor: Valued = field(default_factory=Valued)
    floor_at: float = float("nan")


@dataclass(frozen=True)
class BiasSettling:
    """How the bias settles after a power-up.

    Attributes
    ----------
    rise : Valued
        Mean of the last tenth (an hour at most) less that of the first (five minutes at most) [rad/s].
    amplitude, time_constant : Valued
        Of b + a exp(-t / tau) [rad/s], [s]; NaN where no exponential is seen.
    settled : float
        After it, all means over a hundredth of the record are within ``limit`` of the last tenth [s].
    limit : float
        [rad/s]
    """

    rise: Valued
    amplitude: Valued
    time_constant: Valued
    settled: float
    limit: float


@dataclass(frozen=True)
class StaticResult:
    """The test at rest.

    Attributes
    ----------
    label : str
        Of the run.
    duration : float
        At rest [s].
    bias : Valued
        B_0 as the instrument gives it, the Earth rate in it [rad/s].
    earth_rate : float
        Earth rate on the input axis [rad/s]; NaN: not known.
    earth_note : str
        What was done about it.
    bias_of_each : tuple of float
        B_0 of each power-up [rad/s].
    repeatability : Valued
        Their standard deviation [rad/s].
    stability : tuple of Stability
    allan : AllanResult
    warm_up : BiasSettling, optional
    warm_up_left_out : float
        Time after each power-up that B_0 and "settled" leave out [s].
    t, series, temperature : ndarray, shape (m,)
        Means over some seconds: time since the power-up, output, temperature (empty: not measured).
    """

    label: str
    duration: float
    bias: Valued
    earth_rate: float
    earth_note: str
    bias_of_each: tuple[float, ...]
    repeatability: Valued
    stability: tuple[Stability, ...]
    allan: AllanResult
    warm_up: BiasSettling | None
    warm_up_left_out: float
    t: Floats
    series: Floats
    temperature: Floats

    @property
    def bias_without_earth(self) -> Valued:
        """B_0 with the Earth rate taken off; NaN where that is not known [rad/s]."""
        return Valued(self.bias.value - self.earth_rate, self.bias.sd)


@dataclass(frozen=True)
class RateTest:
    """One instrument's test.

    Attributes
    ----------
    manifest, title : str
    conditions : mapping of str to str
        What the manifest tells of instrument and place, as texts.
    rows, duration : int, float
        Of all runs [s].
    line : RateLineResult, optional
        None: the table never turned.
    static : StaticResult, optional
        Of the longest run at rest; None: there is no rest of a second.
    bias_of_power_ups : tuple of float
        B_0 of every power-up of every run [rad/s].
    bias_repeatability : Valued
        Their standard deviation [rad/s].
    remarks : tuple of str
    filing : Filing
        Head of the page, and the data files.
    """

    manifest: str
    title: str
    conditions: Mapping[str, str]
    rows: int
    duration: float
    line: RateLineResult | None
    static: StaticResult | None
    bias_of_power_ups: tuple[float, ...] = ()
    bias_repeatability: Valued = field(default_factory=Valued)
    remarks: tuple[str, ...] = ()
    filing: Filing = Filing()
