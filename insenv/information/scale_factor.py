r"""What a record of a rate table tells of a gyro's scale factor, under any noise of its datasheet.

    y = u + X theta + e,    K - 1 = sum_j g_j theta_j + sin(tilt) - 1,    g_j = sum(u x_j(u)) / sum(u^2), u = -U ... U

with u the axis's share of the table's rate, X the declared effects with their priors, and e the noise that the
datasheet tells of (`insenv.information.means`). The gyro's errors at a rate are taken warm, at the reference
temperature. The bound is that of means over cells: what single readings tell of a white error of the angle within a
cell is not in it, which is nothing where the angle random walk rules from reading to reading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import CurveEffect, Effect, LinearEffect
from insenv.effects.bias import Bias
from insenv.effects.catalogue import by_key
from insenv.effects.rate.scale import ScaleFactor
from insenv.information.means import Means, means, stated_noises
from insenv.sensors.chain import Sensor

#: Rates of the line whose slope is the scale factor.
RATES = 1401
#: Interval of the motion [s]; cells are made of these.
INTERVAL = 0.1
#: Most cells, and the share of the largest rate by which the rate of a cell may differ from its first.
CELLS, STEADY = 1500, 0.03


@dataclass(frozen=True)
class ScaleFactorLine:
    """What a scale factor is: slope of the line through a warm gyro's outputs at table rates evenly spread.

    Attributes
    ----------
    share : float
        Of the table's rate that the input axis sees.
    largest : float
        Table rate [rad/s] at which the line ends; it begins at its negative.
    temperature, reference : float
        Of the warm gyro, and of its declared effects of temperature [K].
    """

    share: float
    largest: float
    temperature: float
    reference: float

    @cached_property
    def table(self) -> Floats:
        """Rates of the table [rad/s]."""
        return np.linspace(-self.largest, self.largest, RATES)

    @cached_property
    def motion(self) -> Motion:
        """What the gyro is exposed to, one interval a rate."""
        return Motion(
            t=np.arange(RATES + 1.0),
            rate=self.table * self.share,
            temperature=np.full(RATES + 1, self.temperature),
            reference_temperature=self.reference,
        )

    def counts(self, effect: Effect) -> bool:
        """Whether an effect has a part in the slope: of rate and temperature alone, and no local fault."""
        return effect.steady(self.motion) and not effect.local

    def slope(self, outputs: Floats) -> Floats:
        """Slope through ``outputs``, shape (..., RATES) [rad/s], shape (...)."""
        return np.asarray(np.sum(outputs * self.table, axis=-1) / np.sum(self.table * self.table))

    def error(self, effects: Sequence[Effect], theta: Floats) -> Floats:
        """Slope less one of a gyro with these ``effects``, parameters of shape (..., p), shape (...)."""
        found = np.full(np.shape(theta)[:-1], self.share - 1.0)
        first = 0
        for effect in effects:
            last = first + len(effect.params)
            if self.counts(effect):
                found = found + self.slope(effect.apply(self.motion.rate, self.motion, theta[..., first:last])[0])
            first = last
        return found


@dataclass(frozen=True)
class DeclaredGyro:
    """The gyro as its datasheet declares it.

    Attributes
    ----------
    sensor : Sensor
        A scale factor and a bias are always among its effects.
    mean : ndarray, shape (p,)
    sd : mapping of str to float
        Of each parameter; infinite: nothing is told.
    """

    sensor: Sensor
    mean: Floats
    sd: dict[str, float]


def declared(datasheet: Datasheet, motion: Motion) -> DeclaredGyro:
    """The declared effects that ``motion`` has what it takes for."""
    effects: list[Effect] = []
    mean: list[float] = []
    sd: list[float] = []
    for told in datasheet.declared:
        effect = by_key(told.effect)
        if told.target == "gyro" and isinstance(effect, LinearEffect | CurveEffect) and not effect.missing(motion):
            effects.append(effect)
            mean += told.mean
            sd += told.sd
    for free in (ScaleFactor(), Bias()):
        if free.key not in [effect.key for effect in effects]:
            effects.append(free)
            mean, sd = [*mean, 0.0], [*sd, np.inf]
    sensor = Sensor("gyro", tuple(effects))
    return DeclaredGyro(sensor, np.array(mean), dict(zip(sensor.names, sd, strict=True)))


def motion_of(datasheet: Datasheet, angle: Floats, dt: float, temperature: Floats | None = None) -> Motion:
    """The motion of a table's gyro since it was switched on.

    Parameters
    ----------
    datasheet : Datasheet
    angle, temperature : ndarray, shape (n + 1,)
        Of the table [rad] and of the gyro [K] at the edges of even intervals.
    dt : float
        Their length [s].
    """
    share = float(np.sin(datasheet.mounting.tilt))
    vertical = EARTH_RATE * float(np.sin(datasheet.site.latitude or 0.0)) * share
    rate = np.diff(angle) * (share / dt) + vertical
    t: Floats = np.arange(len(angle), dtype=np.float64) * dt
    return Motion(
        t=t,
        rate=rate,
        angle=angle,
        rate_edges=np.concatenate([rate[:1], 0.5 * (rate[1:] + rate[:-1]), rate[-1:]]),
        temperature=temperature,
        projection=share,
        reference_temperature=datasheet.reference_temperature,
        step=dt,
    )


def model(datasheet: Datasheet, motion: Motion) -> tuple[Means, DeclaredGyro]:
    """The record's means over cells of nearly one rate, and what is declared.

    Raises
    ------
    InputError
        If the datasheet tells of no noise.
    """
    told = declared(datasheet, motion)
    edges = cells(motion.rate)
    return means(motion, told.sensor, stated_noises(datasheet, "gyro"), edges, theta=told.mean), told


def cells(rate: Floats) -> NDArray[np.int64]:
    """Edges of at most `CELLS` cells of intervals whose rates, shape (n,), are near that of the cell's first."""
    n = len(rate)
    if n < 1:
        raise InputError("no interval of a record given; wanted one at least")
    longest, steady = max(1, -(-n // CELLS)), STEADY * float(np.abs(rate).max(initial=0.0)) + 1e-12
    while len(edges := _cells(rate, longest, steady)) > CELLS + 1:
        longest, steady = longest + 1, 1.5 * steady
    return edges


def _cells(rate: Floats, longest: int, steady: float) -> NDArray[np.int64]:
    edges, first = [0], rate[0]
    for k, value in enumerate(rate.tolist()):
        if k - edges[-1] >= longest or abs(value - first) > steady:
            edges.append(k)
            first = value
    return np.unique([*edges, len(rate)])


def slope(told: DeclaredGyro, datasheet: Datasheet, largest: float) -> tuple[dict[str, float], float]:
    """Weight of each parameter in K - 1 for table rates up to ``largest`` [rad/s], and what a perfect gyro has of it.

    The slope is per table rate, so that a gyro that leans has the sine of its tilt.
    """
    share = float(np.sin(datasheet.mounting.tilt))
    line = ScaleFactorLine(share, largest, datasheet.reference_temperature, datasheet.reference_temperature)
    weights, first = dict.fromkeys(told.sensor.names, 0.0), 0
    for effect in told.sensor.effects:
        last = first + len(effect.params)
        if line.counts(effect):
            columns = effect.jacobian(line.motion.rate, line.motion, told.mean[first:last])
            of_rate = line.slope(np.moveaxis(columns, -1, 0))
            weights |= dict(zip(told.sensor.names[first:last], of_rate.tolist(), strict=True))
        first = last
    return weights, share - 1.0
