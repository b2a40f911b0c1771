"""The scale factor that a run at one rate shows: all that adds to the gyro in the table's turning, over the input.

At one rate u a bias b is a scale factor b / u, and lock-in is one of -W^2 / 2 u^2. Nothing in a run one way tells them
apart, so an estimator's belief is of their sum, less the lock-in that the datasheet tells of and the estimator
subtracts. The threshold's rise and walk are in the sum.
"""

from __future__ import annotations

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import DrivenEffect
from insenv.effects.bias import Bias
from insenv.effects.noise import RateRandomWalk
from insenv.effects.rate.lock_in import LockIn
from insenv.information.rate_noise import lock_in
from insenv.plants.turntable import Turntable
from insenv.rig import Fitted, Rig, RigState

#: First words of what is a scale factor at one rate.
_SEEN = ("scale_factor", Bias.id, "lock_in", RateRandomWalk.id)
#: Below this input there is none [rad/s].
_REST = 10 * EARTH_RATE


def scale_factor(rig: Rig, state: RigState, u: Floats, sheet: Datasheet) -> Floats:
    """True error of the scale factor where ``state`` stands, for inputs ``u`` [rad/s] of shape (R,); NaN at rest."""
    plant = rig.plant
    assert isinstance(plant, Turntable)
    t = state.samples * sheet.dt + np.array([-sheet.dt, 0.0])
    (gyro,) = ((f, s) for f, s in zip(rig.instruments, state.sensors, strict=True) if f.sensor.target == "gyro")
    motion = Motion(
        t=t,
        rate=u[:, None],
        temperature=plant.temperature.at(t),
        reference_temperature=plant.reference_temperature,
    )
    told = lock_in(sheet)
    known = LockIn().curve(motion.rate, motion, np.array([told])) if told else 0.0
    added = (_added(*gyro, motion) - known)[:, 0]
    turns = np.abs(u) > _REST
    return np.where(turns, added / np.where(turns, u, 1.0), np.nan)


def _added(gyro: Fitted, states: tuple[object, ...], motion: Motion) -> Floats:
    """What the effects of the scale factor and of the bias add to the rate, shape (R, 1)."""
    total, first = np.zeros(motion.rate.shape), 0
    for effect, state in zip(gyro.sensor.effects, states, strict=True):
        theta = gyro.theta[..., first : first + len(effect.params)]
        first += len(effect.params)
        if effect.id.startswith(_SEEN) and not effect.missing(motion):
            # Without a step of its own a walk stays where it stands.
            walks = isinstance(effect, DrivenEffect)
            before = state if walks else effect.begin(motion, theta)
            total = total + effect.apply(motion.rate, motion, theta, before, _still(motion) if walks else None)[0]
    return total


def _still(motion: Motion) -> Floats:
    return np.zeros((len(motion.rate), DrivenEffect.draws, 1))
