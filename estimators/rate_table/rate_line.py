r"""Scale factor, bias, nonlinearity, asymmetry and repeatability of a rate table's dwells, on line.

    F_j = K Omega_j + F_0 + nu_j

F_j is the mean output of a dwell over whole turns, less the static output; Omega_j the table's mean rate over the same
turns, as the axis sees it. `estimators.rate_table.rate_dwells` finds the dwells and their sums;
`estimators.rate_table.rate_line_fits` has the lines, `estimators.rate_table.rate_line_result` what a report shows.

Static output ("zeros"): dwells at rest. With "ends" the mean of the first and the last of a power-up is taken off, and
rests in between are points at rate zero; with "interleaved" the line between the two nearest in time; "auto" takes the
ends unless the rests of a power-up scatter more than their noise (chi-square, probability 1 %).

Source: Zhang, DOI 10.11857/j.issn.1674-5124.2016.12.001.
"""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from functools import cached_property
from math import sin
from typing import Literal, final

import numpy as np
from numpy.typing import NDArray

from estimators.rate_table import rate_dwells, rate_line_drift, rate_line_fits, rate_line_reference, rate_line_result
from estimators.rate_table.rate_dwells import OUTPUT, POWER, RATE, START, TEMPERATURE, TIME, DwellSums
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.rate_test import RateLineResult
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG, PPM
from insenv.effects.bias import Bias
from insenv.effects.rate.scale import ScaleFactor

Zeros = Literal["auto", "ends", "interleaved", "none"]

#: A dwell's blocks keep to its rate within this [rad/s], and this share of it.
TOLERANCE, RELATIVE = 0.02 * DEG, 2e-3
#: Differences of means that the noise is taken from; with fewer, the datasheet's.
FEWEST = 10
#: Standard deviation of a bias that nothing is known of [rad/s], and of what repeats of the scale factor.
ANY_BIAS, ANY_RATIO = 0.1 * DEG, 1e4 * PPM
_LABEL = re.compile(r"\s*rate\s*([+-]?\d+(?:\.\d*)?)\s*deg/s", re.IGNORECASE)
_NUMBER = re.compile(r"#\s*(\d+)\s*$")
_RESTS = ("zero", "static", "rest")
NAMES = (ScaleFactor.id, Bias.id, "asymmetry", "nonlinearity", "repeatability")


@dataclass(frozen=True)
class LineProgress:
    """Dwells so far, and the table's angle where only its rate is recorded [rad], shape (...)."""

    found: DwellSums
    angle: Floats


@final
@dataclass(frozen=True)
class RateLine:
    """The scale-factor line of a rate test.

    Needs "gyro" [rad/s] and one of "table_angle" [rad], "table_rate" [rad/s], or segments labelled "zero" and
    "rate +20 deg/s #3". Of a chunk with segments only these rows are taken, each segment as one dwell. Power-ups are
    told by the channel "power", else by the number after "#"; else there is one.

    Attributes
    ----------
    datasheet : Datasheet
    zeros : "auto", "ends", "interleaved" or "none"
    power_ups : "last" or "all"
        Which ones an `Estimate` is of: what differs between them has no part in the error of the last alone.
    tolerance : float
        By which the rate of a tenth of a second may differ from its dwell's [rad/s].

    Raises
    ------
    InputError
        If a setting has no meaning, or the input axis lies in the table plane.
    """

    datasheet: Datasheet
    zeros: Zeros = "auto"
    power_ups: Literal["all", "last"] = "last"
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        if self.zeros not in ("auto", "ends", "interleaved", "none"):
            raise InputError(f"rate_line: zeros = {self.zeros!r}; wanted 'auto', 'ends', 'interleaved' or 'none'")
        if self.power_ups not in ("all", "last"):
            raise InputError(f"rate_line: power_ups = {self.power_ups!r}; wanted 'all' or 'last'")
        if not self.tolerance > 0:
            raise InputError(f"rate_line: tolerance = {self.tolerance:g} rad/s; wanted more than zero")
        if abs(self.share) < 1e-6:
            raise InputError("rate_line: the input axis lies in the table plane and sees nothing of its turning")

    @property
    def share(self) -> float:
        """Of the table's rate on the input axis."""
        return sin(self.datasheet.mounting.tilt)

    @property
    def earth_rate(self) -> float:
        """Vertical Earth rate on the input axis [rad/s]; NaN where no latitude is told."""
        latitude = self.datasheet.site.latitude
        return float("nan") if latitude is None else EARTH_RATE * sin(latitude) * self.share

    def reset(self, batch: int | None = None) -> LineProgress:
        """No dwell yet."""
        return LineProgress(rate_dwells.nothing(batch), np.zeros(() if batch is None else (batch,)))

    def update(self, state: LineProgress, chunk: Recording) -> LineProgress:
        """After a chunk.

        Raises
        ------
        InputError
            If there is neither a channel of the table nor a label that tells its rate.
        """
        if not len(chunk):
            return state
        t, y = np.asarray(chunk.t, float), chunk.values("gyro", "rad/s")
        angle = self._angle(state, chunk, y.shape)
        warmth = chunk.values("temperature", "K") if "temperature" in chunk.channels else np.full(len(t), np.nan)
        power = chunk.values("power", "1") if "power" in chunk.channels else _numbered(chunk)
        found = rate_dwells.follow(state.found, t, (y, angle, warmth, power), _segments(chunk), self._settings)
        return LineProgress(found, np.broadcast_to(angle[..., -1], state.angle.shape).copy())

    def estimate(self, state: LineProgress) -> Estimate:
        """Relative error of the scale factor, bias [rad/s], asymmetry, nonlinearity ("largest_output"), repeatability.

        From the robust line through the dwells of the last power-up, by variance, at the reference temperature, as far
        as an effect of the temperature is declared. The repeatability is over power-ups, with n - 1.

        Shapes (..., 5) and (..., 5, 5); what is not yet known is 0 with a wide variance.
        """
        found = rate_dwells.finished(state.found, self._settings)
        x, y, white, there = self._points(found)
        y, white = rate_line_reference.at_reference(y, white, x, found.dwells[..., TEMPERATURE], self.datasheet)
        power = found.dwells[..., POWER]
        last = np.where(there, power, 0.0).max(axis=-1, initial=0.0)[..., None]
        used = there & (power == last) if self.power_ups == "last" else there
        slow = self._slow(found, used)
        weights, d = rate_line_fits.robust(x, y, white, used, weighed=True, slow=slow)
        variance = white + d[..., None]
        fit = rate_line_fits.line(x, y, weights, variance, slow)
        sd = np.sqrt(variance + rate_line_fits.of_residuals(x, weights, slow))
        worst, worst_sd = rate_line_fits.largest(fit.residual(x, y), sd, used & (weights > 0))
        full = np.maximum(np.where(used, np.abs(x), 0.0).max(axis=-1, initial=0.0), 1e-12)
        halves = rate_line_fits.halves(x, y, weights, variance, slow)
        spread = self._repeats((x, y, weights), variance, power)
        known = np.isfinite(fit.k) & (used.sum(axis=-1) > 2)
        return self._estimate(fit, known, (halves, (worst / full, worst_sd / full), spread))

    def result(self, state: LineProgress) -> RateLineResult | None:
        """All that a report shows, of a single run, without a batch; None where there are no two rates."""
        found = rate_dwells.finished(state.found, self._settings)
        noise = np.sqrt(self._noise(found))
        return rate_line_result.result(
            found.dwells[: int(found.count)] * self._seen, float(noise), self.zeros, self.earth_rate
        )

    @property
    def _seen(self) -> Floats:
        """Factors of a dwell's columns: the table's rate as the axis sees it."""
        factors = np.ones(rate_dwells.WIDTH)
        factors[RATE] = self.share
        return factors

    @property
    def _settings(self) -> Floats:
        return np.array([self.datasheet.dt, self.share, self.tolerance, RELATIVE])

    def _angle(self, state: LineProgress, chunk: Recording, shape: tuple[int, ...]) -> Floats:
        """The table's angle, shape (..., n)."""
        if "table_angle" in chunk.channels:
            return chunk.values("table_angle", "rad")
        told = "table_rate" in chunk.channels
        rate = chunk.values("table_rate", "rad/s") if told else _nominal(chunk)
        return state.angle[..., None] + np.cumsum(np.broadcast_to(rate * self.datasheet.dt, shape), axis=-1)

    def _noise(self, found: DwellSums) -> Floats:
        """Square of the white noise [rad^2/s], shape (...)."""
        measured, count = rate_dwells.white_noise(found)
        told = self.datasheet.white("gyro") ** 2
        return np.where((count >= FEWEST) | (told == 0), measured, told)

    def _points(self, found: DwellSums) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
        """Rates, outputs, variances of the white noise, and which are there, each of shape (..., m)."""
        d = found.dwells
        there = np.arange(d.shape[-2]) < found.count[..., None]
        time = np.where(there, d[..., TIME], np.inf)
        return d[..., RATE] * self.share, d[..., OUTPUT], self._noise(found)[..., None] / time, there

    def _slow(self, found: DwellSums, used: NDArray[np.bool_]) -> Floats:
        """Covariance that flicker and walks give the dwells of each power-up that is used, shape (..., m, m)."""
        d = found.dwells
        total = np.zeros((*used.shape, used.shape[-1]))
        for q in range(1, int(np.where(used, d[..., POWER], 0.0).max(initial=0.0)) + 1):
            mine = used & (d[..., POWER] == q)
            every = np.where(d[..., POWER] == q, d[..., START], np.inf)
            began = every.min(axis=-1, initial=np.inf)
            total += rate_line_drift.drift(self._covariance, d[..., START], d[..., TIME], mine, began)
        return total

    @cached_property
    def _covariance(self) -> rate_line_drift.Covariance | None:
        return rate_line_drift.covariance_of(self.datasheet)

    def _repeats(self, points: tuple[Floats, Floats, Floats], variance: Floats, power: Floats) -> tuple[Floats, Floats]:
        """Standard deviation of K over the power-ups and its own, relative, each of shape (...)."""
        x, y, weights = points
        each = [
            rate_line_fits.line(x, y, np.where(power == q, weights, 0.0), variance).k
            for q in range(1, int(power.max(initial=0.0)) + 1)
        ]
        k = np.array(each) if each else np.full((1, *x.shape[:-1]), np.nan)
        n = np.isfinite(k).sum(axis=0)
        mean = np.nansum(k, axis=0) / np.maximum(n, 1)
        spread = np.sqrt(np.nansum((k - mean) ** 2, axis=0) / np.maximum(n - 1, 1)) / np.where(mean != 0, mean, 1.0)
        sd = np.where(n > 1, spread / np.sqrt(2 * np.maximum(n - 1, 1)), np.nan)
        return spread, sd

    def _estimate(
        self, fit: rate_line_fits.FittedLine, known: NDArray[np.bool_], ratios: tuple[tuple[Floats, Floats], ...]
    ) -> Estimate:
        """The estimate from its parts; the prior where nothing is known."""
        k = np.where(known, fit.k, 1.0)
        earth = 0.0 if np.isnan(self.earth_rate) else self.earth_rate
        told = self.datasheet.told(ScaleFactor.id, "gyro")
        prior = (told.mean[0], told.sd[0] ** 2) if told and told.sd[0] > 0 else (0.0, ScaleFactor.linear[0].sd ** 2)
        mean = [np.where(known, k - 1, prior[0]), np.where(known, fit.f0 / k - earth, 0.0)]
        cov = np.zeros((*known.shape, 5, 5))
        cov[..., 0, 0] = np.where(known, fit.var_k, prior[1])
        cov[..., 1, 1] = np.where(known, fit.var_f0 / k**2, ANY_BIAS**2)
        cov[..., 0, 1] = cov[..., 1, 0] = np.where(known, fit.cov / k, 0.0)
        for j, (value, sd) in enumerate(ratios, start=2):
            good = known & np.isfinite(value) & np.isfinite(sd)
            mean.append(np.where(good, value, 0.0))
            cov[..., j, j] = np.where(good, sd**2, ANY_RATIO**2)
        return Estimate(NAMES, ("1", "rad/s", "1", "1", "1"), np.stack(mean, axis=-1), cov)


def _segments(chunk: Recording) -> Floats:
    """Number of the labelled stretch of each row, the same in every chunk; 0: in none, -1: nothing is labelled."""
    if not chunk.segments:
        return np.full(len(chunk), -1.0)
    numbers = np.zeros(len(chunk))
    for segment in chunk.segments:
        numbers[segment.start : segment.stop] = 1.0 + zlib.crc32(segment.label.encode())
    return numbers


def _numbered(chunk: Recording) -> Floats:
    """Power-up of each row by the numbers in the labels."""
    power = np.ones(len(chunk))
    for segment in chunk.segments:
        if number := _NUMBER.search(segment.label):
            power[segment.start : segment.stop] = float(number[1])
    return power


def _nominal(chunk: Recording) -> Floats:
    """Rate that the labels tell [rad/s], shape (n,)."""
    rate, told = np.zeros(len(chunk)), False
    for segment in chunk.segments:
        if match := _LABEL.match(segment.label):
            rate[segment.start : segment.stop] = float(match[1]) * DEG
        elif not segment.label.strip().lower().startswith(_RESTS):
            wanted = "wanted 'zero', or one such as 'rate +20 deg/s #3'"
            raise InputError(f"{chunk.label}: the label {segment.label!r} tells no rate; {wanted}")
        told = True
    if not told:
        wanted = "wanted table_angle, table_rate, or labels such as 'rate +20 deg/s #3'"
        raise InputError(f"{chunk.label}: nothing tells the table's rate; {wanted}")
    return rate
