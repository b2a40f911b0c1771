r"""North by generalised least squares in the increments of a gyro on a table that turns.

Per sample, with u dt = sin(tilt) da + w sin L sin(tilt) dt what the table and the vertical Earth rate make,

    x = y dt - u dt = c I_c + s I_s + sum_j (k_j u + b_j) P_j(t) dt + sin(tilt) sum_n [C_n cos n a + S_n sin n a]_edges,

c, s = level (cos az, sin az), level = w cos L cos(tilt), I_c and I_s the integrals of cosine and sine of the table
angle, P_j Legendre polynomials over the datasheet's duration. Noise: angle random walk, and the white angle error of
pulses and encoder. `estimators.north_finder.kernel` averages blocks of at most 0.2 s and whitens their differences
exactly.

What is free, and what holds it:

* c, s: nothing. Until the worse known of them is known better than the circle's radius, the answer is the prior: mean
  0, variance pi^2 / 3. So it is where the table never turned steadily, at the pole and at a tilt of 90 deg.
* Scale factor of degree ``degree``, bias of degree ``bias_degree``: 1e-2 and 20 deg/h for each coefficient. At one rate
  the two are one parameter, which is told as ``scale_factor``. Lock-in is odd in the rate, as a scale factor is, so one
  polynomial serves both senses of rotation, and the bias takes what differs between them.
* Encoder, orders 2 to ``harmonics``: what the datasheet declares, else 20 arcsec.
* Encoder, order 1. In one direction it *is* Earth rate: an error e makes e sin(tilt) W / level of azimuth, 1804 arcsec
  per arcsec at 10 deg/s, and no residual shows it. So a declared deviation is its prior and enters the azimuth's
  covariance. Where the datasheet is silent the encoder counts as perfect, and the belief holds on that condition, until
  the run itself can tell: once a reversal lets it be free for less than ``price`` in the azimuth's deviation (1.25 asks
  for a fifth of the turning; equal halves cost nothing) it is free, and the condition is gone.

Drifts that no polynomial follows (flicker, rate random walk, a wandering lock-in threshold) enter the covariance with
their density S at one cycle per turn, 2 S / (T level^2); so does what pulses at one rate do beyond a white error of the
angle (`insenv.information.rate_noise`). The polynomial of the scale factor is behind what walks, above all a wandering
lock-in threshold, whose -W^2 / 2 u is a scale factor at one rate: the deviation of the present one holds that. A
declared lock-in is subtracted; a declared rate of order 1 that is locked to the angle (a magnetic field) is subtracted
and its deviation added, for nothing tells it from the Earth. A level error (east, north) = (dE, dN) of the table turns
the apparent azimuth by dN tan L; with an accelerometer on the datasheet it is estimated
(`estimators.north_finder.levelling`) and taken out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimators.north_finder import kernel
from estimators.north_finder.levelling import Levelling, north_error
from insenv.core.compiled import of_one_type
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.motion import Motion
from insenv.core.recording import Floats, Recording
from insenv.effects.angle import AngleLockedRate, EncoderHarmonic
from insenv.effects.bias import Bias
from insenv.effects.rate.lock_in import LockIn
from insenv.effects.rate.scale import ScaleFactor
from insenv.information.polynomial import BIAS_SD, SCALE_SD
from insenv.information.rate_noise import density, leak, lock_in, misfit, pulses, walk_density, white_angle

#: Longest block [s].
BLOCK = 0.2
#: Relative change of rate from block to block that ends a chain.
STEADY = 2e-3
#: Deviation of an encoder harmonic that nothing is declared of [rad], and one that stands for none.
FREE_SD, KNOWN_SD = EncoderHarmonic().linear[0].sd, 1e-15
#: Variance of an azimuth of which nothing is known [rad^2].
CIRCLE = np.pi**2 / 3
#: Least precision of a prior as a share of what the data tell of its parameter with all others known.
RIDGE = 1e-12
#: Turns beyond which a walk's density is all.
_MANY = 30.0
#: Angle random walk that stands for none [rad/sqrt(s)]: a datasheet without noise weighs all samples alike.
_NO_NOISE = 1e-12


@dataclass(frozen=True)
class GlsState:
    """Sums so far: see `estimators.north_finder.kernel`; the batch in front. ``level``: of the levelling, if any."""

    sums: Floats
    normal: Floats
    level: Any


class NorthGls:
    """Azimuth [rad] and scale factor (relative, at the present rate, bias included) with their covariance.

    Parameters
    ----------
    datasheet : Datasheet
    degree : int
        Of the scale factor's polynomial.
    harmonics : int
        Highest order of the encoder's error, up to 4.
    price : float
        Ratio of the azimuth's deviations up to which an undeclared encoder error of order 1 is free.
    bias_degree : int
        Of the bias's polynomial, up to ``degree``; equal to it, a run both ways has a scale factor for each sense.

    Raises
    ------
    InputError
        Without a latitude, or with a setting out of range.
    """

    names = ("azimuth", ScaleFactor.id)
    units = ("rad", "1")

    def __init__(
        self, datasheet: Datasheet, degree: int = 2, harmonics: int = 4, price: float = 1.25, bias_degree: int = 0
    ) -> None:
        if datasheet.site.latitude is None:
            raise InputError("north_gls: the datasheet has no latitude; wanted site.latitude")
        if not (0 <= bias_degree <= degree <= 10 and 0 <= harmonics <= kernel.ORDERS and price >= 1):
            raise InputError(
                f"north_gls: degree {degree}, bias_degree {bias_degree}, harmonics {harmonics}, price {price:g} given; "
                f"wanted 0 <= bias_degree <= degree <= 10, harmonics from 0 to {kernel.ORDERS}, a price of at least 1"
            )
        self.datasheet, self.degree, self.harmonics, self.price = datasheet, degree, harmonics, price
        self.bias_degree = bias_degree
        self.latitude = datasheet.site.latitude
        tilt = datasheet.mounting.tilt
        self.level = EARTH_RATE * float(np.cos(self.latitude) * np.cos(tilt))
        self.share = float(np.sin(tilt))
        self.vertical = EARTH_RATE * float(np.sin(self.latitude)) * self.share
        self.block = max(int(BLOCK * datasheet.sampling * (1 + 1e-9)), 1)
        self.span = datasheet.duration if 0 < datasheet.duration < np.inf else 300.0
        self._numbers = self._constants()
        self._precision, self._mean = self._priors()
        levelled = "accel_x" in datasheet.noise or any(d.target == "accel_x" for d in datasheet.declared)
        self._levelling = Levelling(datasheet) if levelled else None
        self._known: dict[float, float] = {}

    def reset(self, batch: int | None = None) -> GlsState:
        """No data."""
        shape = () if batch is None else (batch,)
        size = kernel.columns(self.degree, self.bias_degree)
        rows = np.zeros((*shape, kernel.width(size)))
        rows[..., kernel.TURN] = np.nan
        level = None if self._levelling is None else self._levelling.reset(batch)
        normal = np.zeros((*shape, *2 * (kernel.padded(size),)))
        return GlsState(rows, normal, level)

    def update(self, state: GlsState, chunk: Recording) -> GlsState:
        """Take in channels "gyro" [rad/s], "table_angle" [rad] and, if the datasheet has it, "accel_x" [m/s^2]."""
        rows, normal = state.sums.copy(), state.normal.copy()
        shape = (*rows.shape[:-1], len(chunk.t))
        angle = _spread(chunk.values("table_angle", "rad"), shape)
        gyro = self._unlocked(state, chunk.t, _spread(chunk.values("gyro", "rad/s"), shape), angle)
        flat = (gyro.reshape(-1, len(chunk.t)), angle.reshape(-1, len(chunk.t)))
        kernel.compiled()(
            *(of_one_type(a) for a in flat),
            of_one_type(chunk.t),
            rows.reshape(-1, rows.shape[-1]),
            normal.reshape(-1, *normal.shape[-2:]),
            self._numbers,
            self.block,
            self.degree,
            self.bias_degree,
        )
        level = None if self._levelling is None else self._levelling.update(state.level, chunk)
        return replace(state, sums=rows, normal=normal, level=level)

    def estimate(self, state: GlsState) -> Estimate:
        """Azimuth and scale factor; the prior before the table has turned enough."""
        rows = state.sums.reshape(-1, state.sums.shape[-1])
        solution, cov = self._solved(state.normal.reshape(-1, *state.normal.shape[-2:]))
        mean, spread = self._estimate(rows, solution, cov)
        shape = state.sums.shape[:-1]
        apparent = Estimate(self.names, self.units, mean.reshape(*shape, 2), spread.reshape(*shape, 2, 2))
        return apparent if self._levelling is None else self._levelled(apparent, self._levelling.estimate(state.level))

    def _constants(self) -> Floats:
        """What the kernel is told."""
        sheet, m = self.datasheet, self.block
        walk = sheet.white("gyro")
        square = white_angle(sheet) ** 2
        if not walk and not square:
            walk = _NO_NOISE
        span = walk**2 * m * sheet.dt
        c0 = span * (2 / 3 + 1 / (3 * m * m)) + 2 * square / m
        c1 = span * (1 / 6 - 1 / (6 * m * m)) - square / m
        # The turn of a block, twice: four readings, one of them counted double; six deviations are no change.
        absolute = 6 * 6**0.5 * sheet.encoder_noise
        return np.array([sheet.dt, self.share, self.vertical, self.span, c0, c1, STEADY, absolute])

    def _priors(self) -> tuple[Floats, Floats]:
        """Precision and mean of each column; an undeclared order 1 free (`_solved` may hold it)."""
        told, poly = self.datasheet.told, self.degree + 1
        sd = [np.inf, np.inf, *poly * [SCALE_SD], *(self.bias_degree + 1) * [BIAS_SD]]
        mean = np.zeros(len(sd) + 2 * kernel.ORDERS)
        for place, key in ((2, ScaleFactor.id), (2 + poly, Bias.id)):
            if (declared := told(key, "gyro")) is not None:
                sd[place], mean[place] = max(sd[place], declared.sd[0]), declared.mean[0]
        for order in range(1, kernel.ORDERS + 1):
            declared = told(EncoderHarmonic(order).key, "gyro")
            default = FREE_SD if order <= self.harmonics else KNOWN_SD
            place = len(sd)
            sd += 2 * [default] if declared is None else [max(value, KNOWN_SD) for value in declared.sd]
            if declared is not None:
                mean[place : place + 2] = declared.mean
        return np.array(sd) ** -2.0, mean

    def _unlocked(self, state: GlsState, t: Floats, gyro: Floats, angle: Floats) -> Floats:
        """Rate without a declared lock-in."""
        square = lock_in(self.datasheet)
        if not square or not len(t):
            return gyro
        dt = self.datasheet.dt
        first = np.where(state.sums[..., kernel.SEEN] > 0, state.sums[..., kernel.ANGLE], angle[..., 0])
        turn = np.diff(angle, axis=-1, prepend=first[..., None])
        u = turn * (self.share / dt) + self.vertical
        motion = Motion(t=np.concatenate([[t[0] - dt], t]), rate=u)
        return gyro - LockIn().curve(u, motion, np.array([square]))

    def _solved(self, normal: Floats) -> tuple[Floats, Floats]:
        """Solution (R, p) and covariance (R, p, p); an undeclared encoder error of order 1 held until it is cheap."""
        if not self.harmonics or self.datasheet.told(EncoderHarmonic(1).key, "gyro") is not None:
            return _posterior(normal, self._precision, self._mean)
        held = self._precision.copy()
        first = len(held) - 2 * kernel.ORDERS
        held[first : first + 2] = KNOWN_SD**-2.0
        solution, cov = _posterior(normal, np.stack([self._precision, held])[:, None], self._mean)
        free, fixed = cov[..., 0, 0] + cov[..., 1, 1]
        cheap = free <= self.price**2 * fixed
        chosen = np.where(cheap, 0, 1), np.arange(len(cheap))
        return solution[chosen], cov[chosen]

    def _estimate(self, rows: Floats, solution: Floats, cov: Floats) -> tuple[Floats, Floats]:
        """Mean (R, 2) and covariance (R, 2, 2) of the azimuth and the scale factor."""
        c, s = solution[:, 0], solution[:, 1]
        locked = self.datasheet.told(AngleLockedRate(1).key, "gyro")
        extra = 0.0
        if locked is not None:
            c, s = c - locked.mean[0], s - locked.mean[1]
            extra = float(np.mean(np.square(locked.sd)))
        gradient = np.zeros((len(rows), 2, solution.shape[1]))
        length = np.hypot(c, s)
        length, level = np.where(length > 0, length, 1.0), max(self.level, 1e-30)
        gradient[:, 0, 0], gradient[:, 0, 1] = -s / (length * level), c / (length * level)
        factors, turns = self._present(rows)
        gradient[:, 1, 2:][:, : factors.shape[1]] = factors
        spread = _sandwich(gradient, cov)
        used = np.maximum(rows[:, kernel.USED], self.datasheet.dt)
        rate = (rows[:, kernel.FORWARD] + rows[:, kernel.BACKWARD]) / used
        drift = (
            2 * (density(self.datasheet, rate, self.share) + self._leaks(rows, rate) + self._pulses(rows, rate)) / used
        )
        spread[:, 0, 0] += (extra + np.where(turns, drift, 0.0)) / level**2
        spread[:, 1, 1] += np.where(turns, self._behind(rows, rate), 0.0)
        mean = np.stack([np.arctan2(s, c), np.sum(gradient[:, 1] * solution, axis=-1)], axis=-1)
        self._before_data(turns & self._found(cov), mean, spread)
        return mean, spread

    def _leaks(self, rows: Floats, rate: Floats) -> Floats:
        """What random walks leak into few turns one way beyond their density there [(rad/s)^2 / Hz]."""
        walk = walk_density(self.datasheet, rate, self.share)
        turned = np.maximum(rows[:, kernel.FORWARD], rows[:, kernel.BACKWARD]) / (2 * np.pi)
        one_way = (np.minimum(rows[:, kernel.FORWARD], rows[:, kernel.BACKWARD]) == 0) & (turned > 0.5)
        beyond = np.zeros(len(rows))
        if np.any(walk > 0):
            each = [
                leak(round(min(n, _MANY), 2), self.degree) if w else 1.0 for n, w in zip(turned, one_way, strict=True)
            ]
            beyond = walk * (np.array(each) - 1)
        return beyond

    def _behind(self, rows: Floats, rate: Floats) -> Floats:
        """Variance of the present scale factor by random walks that its polynomial is behind."""
        walk = walk_density(self.datasheet, rate, self.share)
        turning = np.stack([rows[:, kernel.FORWARD], rows[:, kernel.BACKWARD]])
        share = np.where(rows[:, kernel.TURN] < 0, turning[1], turning[0]) / np.maximum(turning.sum(axis=0), 1e-9)
        left = np.zeros(len(rows))
        if np.any(walk > 0):
            left[:] = [misfit(round(float(x), 2), self.degree, self.bias_degree) for x in share]
        return np.asarray(walk * rows[:, kernel.USED] * left / max(self.share, 1e-9) ** 2)

    def _pulses(self, rows: Floats, rate: Floats) -> Floats:
        """Density of the pulses' error beyond that of a white one, where the table holds one rate."""
        sheet = self.datasheet
        mean = rate * self.block * sheet.dt
        apart = np.abs(np.abs(rows[:, kernel.TURN]) - mean) > 1e-6 * mean + self._numbers[-1]
        beyond = np.zeros(len(rows))
        if not sheet.pulse:
            return beyond
        ways = np.stack([rows[:, kernel.FORWARD], rows[:, kernel.BACKWARD]])
        for r in np.flatnonzero(~apart & (rows[:, kernel.USED] > 0)):
            share = ways[:, r] / ways[:, r].sum()
            beyond[r] = sum(
                w * (self._pulsed(s * float(rate[r])) - 1) for w, s in zip(share, (1, -1), strict=True) if w
            )
        return np.asarray(beyond * sheet.pulse**2 / 12 * sheet.dt * rate**2)

    def _pulsed(self, rate: float) -> float:
        key = float(f"{rate:.9g}")
        if key not in self._known:
            self._known[key] = pulses(self.datasheet, key)
        return self._known[key]

    def _present(self, rows: Floats) -> tuple[Floats, np.ndarray[Any, np.dtype[np.bool_]]]:
        """Weights of the coefficients in the scale factor at the present time and rate; whether the table turned."""
        turns = rows[:, kernel.USED] > 0
        x = 2 * rows[:, kernel.TIME] / self.span - 1
        table = _legendre(np.minimum(np.maximum(x, -1.0), 1.0), self.degree)
        turn = np.where(np.isnan(rows[:, kernel.TURN]), 0.0, rows[:, kernel.TURN])
        u = turn * self.share / (self.block * self.datasheet.dt) + self.vertical
        moves = np.abs(u) > 10 * EARTH_RATE
        inverse = np.where(moves, 1 / np.where(moves, u, 1.0), 0.0)
        return np.concatenate([table, table[:, : self.bias_degree + 1] * inverse[:, None]], -1), turns

    def _found(self, cov: Floats) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Whether c and s are known better than the circle's radius."""
        a, b, d = cov[:, 0, 0], cov[:, 0, 1], cov[:, 1, 1]
        worst = 0.5 * (a + d) + np.hypot(0.5 * (a - d), b)
        return np.asarray(worst < self.level**2)

    def _levelled(self, apparent: Estimate, level: Estimate) -> Estimate:
        """The azimuth without what the level error adds to it; the prior stays as it is."""
        error, sd = north_error(level, apparent, self.latitude)
        known = apparent.cov[..., 0, 0] < CIRCLE
        mean, cov = apparent.mean.copy(), apparent.cov.copy()
        mean[..., 0] -= np.where(known, error, 0.0)
        mean[..., 0] = np.pi - np.mod(np.pi - mean[..., 0], 2 * np.pi)
        cov[..., 0, 0] += np.where(known, sd**2, 0.0)
        return replace(apparent, mean=mean, cov=cov)

    @staticmethod
    def _before_data(found: np.ndarray[Any, np.dtype[np.bool_]], mean: Floats, spread: Floats) -> None:
        """Join the prior of the azimuth to what the data tell, in place."""
        variance = np.where(found, spread[:, 0, 0], CIRCLE)
        joined = np.where(found, 1 / (1 / variance + 1 / CIRCLE), CIRCLE)
        shrink = np.where(found, np.sqrt(joined / variance), 0.0)
        mean[:, 0] = np.where(found, mean[:, 0], 0.0)
        spread[:, 0, 1] *= shrink
        spread[:, 1, 0] *= shrink
        spread[:, 0, 0] = joined


def _spread(values: Floats, shape: tuple[int, ...]) -> Floats:
    """Samples that may be one line for all rows."""
    return values if values.shape == shape else np.broadcast_to(values, shape)


def _posterior(normal: Floats, precision: Floats, mean: Floats) -> tuple[Floats, Floats]:
    """Solution (..., R, p) and covariance (..., R, p, p) of normal equations (residual last), priors in front."""
    p = len(mean)
    matrix = normal[:, :p, :p]
    place = np.arange(p)
    information = matrix[:, place, place]
    # What one rate cannot tell apart is held by its prior; where that is too weak to be seen beside the data, by a
    # share of them above rounding and below notice. c and s have no prior but one that keeps the matrix regular.
    precision = np.maximum(precision, RIDGE * information)
    precision[..., :2] = 1e-20
    scale = 1 / np.sqrt(information + precision)
    outer = scale[..., :, None] * scale[..., None, :]
    scaled = (matrix + matrix.transpose(0, 2, 1)) * (0.5 * outer)
    scaled[..., place, place] = 1.0
    both = np.zeros((*scaled.shape[:-1], p + 1))
    both[..., place, place] = 1.0
    both[..., p] = (normal[:, :p, p] + precision * mean) * scale
    # Not the inverse times the right side: what is poorly known would drown the rest in its rounding.
    solved = np.linalg.solve(scaled, both)
    cov = solved[..., :p] * outer
    return scale * solved[..., p], 0.5 * (cov + cov.swapaxes(-1, -2))


def _legendre(x: Floats, degree: int) -> Floats:
    """P_0 to P_degree, shape (R, degree + 1)."""
    values = [np.ones_like(x), x]
    for j in range(1, degree):
        values.append(((2 * j + 1) * x * values[j] - j * values[j - 1]) / (j + 1))
    return np.stack(values[: degree + 1], axis=-1)


def _sandwich(gradient: Floats, cov: Floats) -> Floats:
    """G P G', one row at a time in the same order whatever the batch, shape (R, k, k)."""
    half = np.sum(gradient[:, :, :, None] * cov[:, None, :, :], axis=2)
    return np.asarray(np.sum(half[:, :, None, :] * gradient[:, None, :, :], axis=-1))
