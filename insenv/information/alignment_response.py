r"""What an undeclared error of an instrument does to a two-position calibration, without sampling.

The filter of `insenv.information.alignment` estimates x from increments z = H x + d, while the truth goes x' = F x + b
with b and d what the error makes of attitude and velocity. The mean of its error is

    e' = F e - b + K (d - H e),      b = -C w dt,      d = (C f) dt + G (-C w) dt^2 / 2,

w and f the errors of gyros and accelerometers as the effects of the catalogue write them, G phi the horizontal force.
Source: A. Gelb (ed.), Applied Optimal Estimation (1974), section 7.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import earth_rate_enu, gravity
from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import Effect
from insenv.information.alignment import AlignedUnit, Knowledge, Stretch, advance, unknowing
from insenv.information.alignment_information import NAMES
from insenv.information.sensitivity import UndeclaredResponse

#: Places of `NAMES` in the eleven states of the filter: phi at the start, biases.
_PLACES = [8, 9, 10, 3, 4, 5, 6, 7]
#: Longest step [s].
_STEP = 0.25


def responses(
    instrument: AlignedUnit,
    stretches: Sequence[Stretch],
    possible: Sequence[tuple[str, Effect, Sequence[float]]],
    heading: float = 0.0,
    turning_data: bool = False,
) -> tuple[UndeclaredResponse, ...]:
    """Bias of phi at the start [rad] and of the gyro and accelerometer biases by each of the ``possible`` effects.

    Parameters
    ----------
    instrument : AlignedUnit
    stretches : sequence of Stretch
    possible : sequence of (target, Effect, parameters)
        Target "gyro_x" ... "accel_z"; parameters in SI, in the order of ``Effect.params``.
    heading : float
        At the start, clockwise from north [rad].
    turning_data : bool
        As of `insenv.information.alignment.bound`.

    Raises
    ------
    InputError
        If there is no stretch, a target is none of the six, or an effect needs what a vehicle on a level floor does
        not give.
    """
    if not sum(stretch.duration for stretch in stretches) > 0:
        raise InputError("no stretch of any duration given; wanted a rest at least")
    t, turned, turns = _course(stretches)
    errors = np.stack([_errors(instrument, t, turned - heading, one) for one in possible], axis=-1)
    known, middle, dt = unknowing(instrument, heading), 0.5 * (turned[1:] + turned[:-1]), float(t[1] - t[0])
    cov, bias = known.cov, np.zeros((11, len(possible)))
    g = float(gravity(instrument.latitude, instrument.altitude))
    for k in range(len(middle)):
        at = heading - middle[k]
        step = advance(instrument, cov, at, dt, turning_data or not turns[k])
        c, s = np.cos(at), np.sin(at)
        C = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        tilted = -C @ errors[k, :3] * dt
        pushed = (C @ errors[k, 3:])[:2] * dt + 0.5 * dt * g * np.stack([-tilted[1], tilted[0]])
        bias = step.transition @ bias + step.gain @ (pushed - step.regressor @ bias)
        bias[:3] -= tilted
        cov = step.cov
    sd = Knowledge(cov).sd
    return tuple(
        UndeclaredResponse(f"{target}.{effect.key}", NAMES, bias[_PLACES, j], sd)
        for j, (target, effect, _) in enumerate(possible)
    )


def _course(stretches: Sequence[Stretch]) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Even edges [s], angle turned by there [rad], and the steps that lie in a turn or partly so."""
    lengths = np.array([stretch.duration for stretch in stretches])
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    t = np.linspace(0.0, ends[-1], int(np.ceil(ends[-1] / _STEP)) + 1)
    turned = np.interp(t, ends, np.concatenate([[0.0], np.cumsum([stretch.turn for stretch in stretches])]))
    return t, turned, np.abs(np.diff(turned)) > 0


def _errors(
    instrument: AlignedUnit, t: Floats, minus_heading: Floats, one: tuple[str, Effect, Sequence[float]]
) -> Floats:
    """Errors of gyros and accelerometers over each step, shape (n, 6), by one effect."""
    target, effect, theta = one
    kind, _, axis = target.partition("_")
    if kind not in ("gyro", "accel") or axis not in ("x", "y", "z"):
        raise InputError(f"effect {effect.key!r} of {target!r} given; wanted one of gyro_x ... accel_z")
    motion = _motion(instrument, t, minus_heading, kind, axis)
    if missing := effect.missing(motion):
        raise InputError(
            f"effect {effect.key!r} of {target} needs {', '.join(missing)}, which a level body does not give"
        )
    u = motion.rate if kind == "gyro" else motion.force[axis]
    values = np.asarray(theta, float)
    found = np.zeros((len(t) - 1, 6))
    found[:, "xyz".index(axis) + 3 * (kind == "accel")] = effect.apply(u, motion, values, effect.begin(motion, values))[
        0
    ]
    return found


def _motion(instrument: AlignedUnit, t: Floats, minus_heading: Floats, kind: str, axis: str) -> Motion:
    """Exposure of one axis of a level body, right-forward-up, that turns about up."""
    _, north, up = earth_rate_enu(instrument.latitude)
    at = 0.5 * (minus_heading[1:] + minus_heading[:-1])
    dt = float(t[1] - t[0])
    rates = {"x": north * np.sin(at), "y": north * np.cos(at), "z": up + np.diff(minus_heading) / dt}
    still = np.zeros(len(at))
    forces = {"x": still, "y": still, "z": still + float(gravity(instrument.latitude, instrument.altitude))}
    others = {name: (rates if kind == "gyro" else forces)[name] for name in "xyz" if name != axis}
    rate = rates[axis] if kind == "gyro" else still
    return Motion(t=t, rate=rate, force=forces, cross_rate=others)
