"""Errors that follow the square of an acceleration: at a lever arm on a table, and in vibration.

    centripetal_acceleration   c u^2 (order 1), c u^4 (order 2)
    vibration_rectification    c_x v_x + c_y v_y + c_z v_z
    lever_arm                  c W^2 + s dW/dt                on an accelerometer that turns with a table at the rate W
    size_effect                [W x (W x r) + dW/dt x r]_i    on axis i of a unit that turns at the rate vector W

Off the axis of a table by r the specific force is r u^2 towards it: a g-sensitivity is then proportional to u^2, a
g^2-sensitivity to u^4; an accelerometer there feels W x (W x r) + dW/dt x r itself. On axis i
this is, with i, j, k in cyclic order,

    -(W_j^2 + W_k^2) r_i + (W_i W_j - dW_k/dt) r_j + (W_i W_k + dW_j/dt) r_k.

v is the mean square of the specific force about its own mean over a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from insenv.core.motion import Motion, interval_product, interval_slope
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, LinearEffect, Param
from insenv.effects.forms import along_axes, checked_order, columns, cyclic, known


@final
@dataclass(frozen=True)
class CentripetalAcceleration(LinearEffect):
    """A bias that follows the centripetal acceleration, or (order 2) its square."""

    order: int = 1

    id = "centripetal_acceleration"
    title = "centripetal acceleration"
    meaning = (
        "off the table's axis the bias follows the square of the rate (order 2: its fourth power), through a "
        "sensitivity to acceleration; a response that is bent evenly looks the same"
    )
    source = "IEEE Std 952-1997: acceleration and acceleration-squared sensitivity, at a lever arm"
    instruments = ("gyro",)
    of_rate = True
    unusual = True

    def __post_init__(self) -> None:
        checked_order(self.id, self.order, 2)

    @property
    def linear(self) -> tuple[Param, ...]:
        """One coefficient, whose unit is that of the power."""
        unit = f"1/({OUTPUT})" if self.order == 1 else f"1/({OUTPUT})^3"
        return (Param("c", unit, sd=1e-4, bound=1.0),)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Even power of the input, shape (..., n, 1); the mean rate stands for the rate."""
        square = u * u
        return columns(u, square if self.order == 1 else square * square)


@final
@dataclass(frozen=True)
class VibrationRectification(LinearEffect):
    """A bias that follows the mean square of the vibration."""

    id = "vibration_rectification"
    title = "vibration rectification"
    meaning = "the bias follows the mean square of the vibration"
    linear = tuple(Param(f"c_{axis}", OUTPUT + "/(m/s^2)^2", sd=1e-4, bound=1e-2) for axis in "xyz")
    needs = ("vibration",)
    source = "IEEE Std 1293-2018: vibration rectification error; IEEE Std 952-1997: acceleration-squared sensitivity"
    unusual = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Mean square of the vibration along x, y and z, shape (..., n, 3)."""
        return columns(u, *along_axes(motion.vibration))


@final
@dataclass(frozen=True)
class LeverArm(LinearEffect):
    """An accelerometer off the axis of a table: centripetal and tangential acceleration."""

    id = "lever_arm"
    title = "lever arm"
    meaning = "off the axis of the table the accelerometer feels the turn itself"
    linear = (Param("c", "m", sd=0.1, bound=5.0), Param("s", "m", sd=0.1, bound=5.0))
    needs = ("turn_rate",)
    source = "Titterton and Weston, section 9.6: size effect; kinematics of a rotating frame"
    instruments = ("accelerometer",)
    belongs = "place"

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Mean square and mean slope of the table's rate, shape (..., n, 2)."""
        rate = known(motion, "turn_rate", self.id)
        first, last = rate[..., :-1], rate[..., 1:]
        return columns(u, (first * first + first * last + last * last) / 3, interval_slope(rate, motion.dt))


@final
@dataclass(frozen=True)
class SizeEffect(LinearEffect):
    """An accelerometer of a unit at the place r from the point about which the unit turns."""

    id = "size_effect"
    title = "lever arm in the unit"
    meaning = "an accelerometer off the point of turning feels the turn itself"
    linear = tuple(Param(f"c_{axis}", "m", sd=0.1, bound=5.0) for axis in "xyz")
    needs = ("body_rate",)
    source = "Titterton and Weston, section 9.6: size effect; kinematics of a rotating frame"
    on_axes = ("accelerometer",)
    instruments = ("accelerometer",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """What a metre along x, y and z adds, shape (..., n, 3); rates are straight within an interval."""
        rate, (own, j, k) = motion.body_rate, cyclic(motion, self.id)
        slope = {axis: interval_slope(rate[axis], motion.dt) for axis in (j, k)}
        arms = {axis: interval_product(rate[own], rate[axis]) for axis in (j, k)}
        arms[j] -= slope[k]
        arms[k] += slope[j]
        arms[own] = -interval_product(rate[j], rate[j])
        arms[own] -= interval_product(rate[k], rate[k])
        return columns(u, *along_axes(arms))
