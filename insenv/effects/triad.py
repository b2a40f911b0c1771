"""Errors of a triad, which show when it is held still in many attitudes.

    accel_bias           c
    accel_scale_factor   c f                          specific force f along the input axis
    accel_asymmetry      c |f|                        a scale that differs between the two senses
    accel_second_order   c f^2                        a scale that grows with the force
    non_orthogonality    c_x v_x + c_y v_y + c_z v_z  what the other two axes see
    misalignment         c_x v_x + c_y v_y + c_z v_z

v is the input of the other axes: specific forces of an accelerometer, rates of a gyro. On a single axis the last two
are one form. On a triad they differ in how the coefficients of two axes belong together (`symmetry`): with c_ij that
of axis j on axis i,

    non_orthogonality    c_ij = +c_ji = half of the angle by which the axes i and j are short of a right angle
    misalignment         c_ij = -c_ji : the triad as a whole is turned against its reference

so that scale factors, non-orthogonality and misalignment together are any 3 x 3 matrix. The frame of a triad of which
the non-orthogonality is known is the one nearest to its axes: no axis is taken for the right one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, LinearEffect, Param
from insenv.effects.forms import along_axes, columns


@final
@dataclass(frozen=True)
class AccelBias(LinearEffect):
    """A constant error of an accelerometer: c."""

    id = "accel_bias"
    part = "level"
    title = "accelerometer bias"
    meaning = "a constant error of an accelerometer"
    linear = (Param("c", OUTPUT, sd=0.1, bound=10.0),)
    source = "IEEE Std 1293-1998: bias"
    on_axes = ("accelerometer",)
    instruments = ("accelerometer",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Ones, shape (..., n, 1)."""
        return columns(u, np.ones(np.shape(u)))


@final
@dataclass(frozen=True)
class AccelScaleFactor(LinearEffect):
    """A wrong scale of an accelerometer: c f."""

    id = "accel_scale_factor"
    part = "gain"
    title = "accelerometer scale factor"
    meaning = "the output is wrong in proportion to the specific force"
    linear = (Param("c", "1", sd=0.05, bound=1.0),)
    source = "IEEE Std 1293-1998: scale factor"
    on_axes = ("accelerometer",)
    instruments = ("accelerometer",)
    of_rate = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """The specific force along the input axis, shape (..., n, 1)."""
        return columns(u, u)


@final
@dataclass(frozen=True)
class AccelAsymmetry(LinearEffect):
    """A scale of an accelerometer that differs between the two senses: c |f|."""

    id = "accel_asymmetry"
    title = "accelerometer asymmetry"
    meaning = "the scale of an accelerometer differs between its two senses"
    linear = (Param("c", "1", sd=0.01, bound=0.2),)
    source = "IEEE Std 1293-1998: scale factor asymmetry"
    on_axes = ("accelerometer",)
    instruments = ("accelerometer",)
    of_rate = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Magnitude of the specific force along the input axis, shape (..., n, 1)."""
        return columns(u, np.abs(u))


@final
@dataclass(frozen=True)
class AccelSecondOrder(LinearEffect):
    """The second-order term K2 of an accelerometer: c f^2; the mean force stands for the force."""

    id = "accel_second_order"
    title = "second-order term of an accelerometer"
    meaning = "the output follows the square of the force"
    linear = (Param("c", "1/({y})", sd=1e-4, bound=1e-2),)
    source = "IEEE Std 1293-1998: second-order coefficient K2"
    on_axes = ("accelerometer",)
    instruments = ("accelerometer",)
    of_rate = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Square of the specific force along the input axis, shape (..., n, 1)."""
        return columns(u, u * u)


class _OfOtherAxes(LinearEffect):
    """What the input of the other axes adds; of a triad's coefficients c_ij = ``symmetry`` c_ji."""

    linear = tuple(Param(f"c_{axis}", "1", sd=0.01, bound=0.2) for axis in "xyz")
    part = "others"
    symmetry: ClassVar[int]

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Inputs of the other axes, shape (..., n, 3); zero along the axis itself."""
        return columns(u, *along_axes(motion.cross_rate))


@final
@dataclass(frozen=True)
class NonOrthogonality(_OfOtherAxes):
    """Axes of a triad that are not at right angles."""

    id = "non_orthogonality"
    title = "non-orthogonality"
    meaning = "the axes of the triad are not at right angles"
    needs = ("cross_rate",)
    symmetry = 1
    source = "IEEE Std 1293-1998: misalignment; Tedaldi, Pretto and Menegatti, ICRA 2014"
    on_axes = ("gyro", "accelerometer")


@final
@dataclass(frozen=True)
class Misalignment(_OfOtherAxes):
    """A gyro triad that is turned as a whole against the accelerometers' (or the mount's) axes."""

    id = "misalignment"
    title = "misalignment"
    meaning = "the triad as a whole is turned against the one that shows the attitude"
    needs = ("cross_rate",)
    symmetry = -1
    source = "Tedaldi, Pretto and Menegatti, ICRA 2014: alignment of the gyros to the accelerometers"
    on_axes = ("gyro",)
    instruments = ("gyro",)
