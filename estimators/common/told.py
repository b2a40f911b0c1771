"""What a data sheet tells of the errors of a channel: noise density, and columns of the declared effects."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from estimators.common.turns import Axis
from insenv.core.estimate import Datasheet, Declared
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.angle import AngleLockedRate, EncoderHarmonic
from insenv.effects.base import CurveEffect, LinearEffect
from insenv.effects.bias import Bias, BiasDrift, BiasWarmUp
from insenv.effects.catalogue import by_key
from insenv.effects.rate.lock_in import LockIn, LockInWander
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorDrift, ScaleFactorWarmUp
from insenv.information.rate_noise import density, pulses, white_angle

#: Cells of time in which a declared effect is tabulated.
CELLS = 512
_OF_SCALE = (ScaleFactor.id, ScaleFactorDrift.id, ScaleFactorWarmUp.id)
_OF_BIAS = (Bias.id, BiasDrift.id, BiasWarmUp.id)
_OF_ANGLE = (EncoderHarmonic(1).key, AngleLockedRate(1).key)
_OF_LOCK_IN = (LockIn.id, LockInWander.id)
#: Declared effects that the covariance knows of.
KNOWN = (*_OF_SCALE, *_OF_BIAS, *_OF_ANGLE, *_OF_LOCK_IN)


@dataclass(frozen=True)
class Errors:
    """What a data sheet tells of the errors of one channel.

    Attributes
    ----------
    datasheet : Datasheet
    target : str
        "gyro", "accel_x".
    axis : Axis
        Input axis of that channel.
    angle_error : float
        White error of the integrated reading, one standard deviation: rad for a gyro.
    """

    datasheet: Datasheet
    target: str
    axis: Axis
    angle_error: float = 0.0

    def density(self, turning: Floats) -> Floats:
        """Two-sided density of the noise at one cycle a turn, for table rates [rad/s]; a walk's twice."""
        sheet = self.datasheet
        n, b, k = (told(self.target) ** 2 for told in (sheet.white, sheet.flicker, sheet.walk))
        if self.target == "gyro":
            walk = density(self.datasheet, turning, self.axis.share) - b / turning
        else:
            walk = k / turning**2
        return n + b / turning + 2 * walk

    def inside(self, rate: Floats) -> Floats:
        """Variance of the white angle error as whole turns at steady table rates [rad/s] see it, of their shape."""
        sheet = self.datasheet
        variance = np.full(np.shape(rate), self.angle_error**2)
        if self.target != "gyro" or not sheet.pulse or sheet.encoder_noise:  # a rate that is known to no 1e-6 averages
            return variance
        found = np.round(rate, 9)
        for one in np.unique(found):
            if one not in self._pulsed:
                self._pulsed[one] = pulses(sheet, float(one)) - 1
            variance[found == one] += self._pulsed[one] * sheet.pulse**2 / 12
        return variance

    @cached_property
    def _pulsed(self) -> dict[float, float]:
        return {}

    @cached_property
    def told(self) -> tuple[Floats, Floats, float]:
        """Columns of the declared effects.

        Scale-factor error, bias and square of the lock-in threshold over time, shape (columns, 3, CELLS); amplitudes
        of the errors that repeat with the angle, shape (columns, 4): of the angle reading's cosine and sine [rad],
        of the rate's; length of a cell [s]. The first column is the mean of all.
        """
        means, parts = [_Column()], []
        for declared in self.datasheet.declared:
            if declared.target == self.target and declared.effect in KNOWN:
                mean, deviations = self._columns(declared)
                means.append(mean)
                parts += [deviation for deviation in deviations if deviation.any]
        every = [sum(means[1:], means[0]), *parts]
        curves = np.array([c.curves for c in every])
        return curves, np.array([c.harmonic for c in every]), self.datasheet.duration / CELLS

    def _columns(self, declared: Declared) -> tuple[_Column, list[_Column]]:
        """Mean of one effect, and each parameter's derivative times its deviation."""
        mean, sd = np.asarray(declared.mean, float), np.asarray(declared.sd, float)
        if declared.effect in _OF_ANGLE:
            place = 2 * _OF_ANGLE.index(declared.effect)
            ways = (np.eye(4)[place + j] * value for values in (mean, sd) for j, value in enumerate(values))
            c, s, *parts = (_Column(harmonic=way) for way in ways)
            return c + s, parts
        motion = Motion(t=np.linspace(0.0, self.datasheet.duration, CELLS + 1), rate=np.ones(CELLS))
        if declared.effect in _OF_LOCK_IN:
            return _Column.of(2, _threshold(motion, mean)), [
                _Column.of(2, 0.5 * (_threshold(motion, mean + step) - _threshold(motion, mean - step)))
                for step in np.diag(np.minimum(sd, 0.5 * np.abs(mean)) if len(sd) > 1 else sd)
            ]
        effect = by_key(declared.effect)
        assert isinstance(effect, LinearEffect | CurveEffect)
        place = 0 if declared.effect in _OF_SCALE else 1
        curves = np.moveaxis(effect.jacobian(motion.rate, motion, mean), -1, 0) * sd[:, None]
        return _Column.of(place, effect.apply(motion.rate, motion, mean)[0]), [_Column.of(place, c) for c in curves]


def _threshold(motion: Motion, values: Floats) -> Floats:
    """Square of the threshold of "lock_in" (one value) or "lock_in_wander", shape (CELLS,)."""
    if len(values) == 1:
        return np.full(motion.n, values[0])
    threshold, rise, tau, _ = values
    square: Floats = (threshold * (1 + rise * (1 - np.exp(-motion.middle / tau)))) ** 2
    return square


@dataclass(frozen=True)
class _Column:
    curves: Floats = field(default_factory=lambda: np.zeros((3, CELLS)))
    harmonic: Floats = field(default_factory=lambda: np.zeros(4))

    @classmethod
    def of(cls, place: int, curve: Floats) -> _Column:
        curves = np.zeros((3, CELLS))
        curves[place] = curve
        return cls(curves)

    @property
    def any(self) -> bool:
        return bool(self.curves.any() or self.harmonic.any())

    def __add__(self, other: _Column) -> _Column:
        return _Column(self.curves + other.curves, self.harmonic + other.harmonic)


def gyro_errors(datasheet: Datasheet, axis: Axis) -> Errors:
    """Errors of the gyro on its increments: pulses, or the quantization that is told of, and the encoder's noise."""
    return Errors(datasheet, "gyro", axis, white_angle(datasheet))
