"""Errors of a triad, which show when it is held still in many attitudes.

    accel_bias           c
    accel_scale_factor   c f                          specific force f along the input axis
    accel_asymmetry      c |f|                        a scale that differs between the two senses
    accel_second_order   c f^2                        a scale that grows with the force
    non_orthogonality    c_x v_x + c_y v_y + c_z v_z  what the other two axes see
    misalignment         c_x v_x + c_y v_y + c_z v_z
    accel_third_order    c f^3                        a scale that grows with the square of the force
    accel_misalignment   c f_p                        the input axis is turned by c in the plane of a tumble
    accel_cross_coupling c f f_p                      what the force across the input axis does to its scale

f_p is the specific force across the input axis in the plane in which an accelerometer is turned through gravity
(`insenv.data.cells.tumble`). v is the input of the other axes: specific forces of an accelerometer, rates of a gyro. On
a single axis non-orthogonality and misalignment are one form. On a triad they differ in how the coefficients of two
axes belong together (`symmetry`): with c_ij that of axis j on axis i,

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
from insenv.effects.forms import along_axes, columns, known


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
    bend = True

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
    bend = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Square of the specific force along the input axis, shape (..., n, 1)."""
        return columns(u, u * u)


@final
@dataclass(frozen=True)
class AccelThirdOrder(LinearEffect):
    """The third-order term K3 of an accelerometer: c f^3; the mean force stands for the force."""

    id = "accel_third_order"
    title = "third-order term of an accelerometer"
    meaning = "the output follows the cube of the force"
    linear = (Param("c", "1/({y})^2", sd=1e-5, bound=1e-3),)
    source = "IEEE Std 1293-2018: third-order coefficient K3"
    instruments = ("accelerometer",)
    of_rate = True
    unusual = True
    bend = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Cube of the specific force along the input axis, shape (..., n, 1)."""
        return columns(u, u * u * u)


@final
@dataclass(frozen=True)
class AccelMisalignment(LinearEffect):
    """An input axis that is turned by c in the plane of a tumble: c f_p."""

    id = "accel_misalignment"
    title = "misalignment of an accelerometer"
    meaning = "the input axis is turned in the plane in which the accelerometer is tumbled, or the head's zero is"
    linear = (Param("c", "rad", sd=0.01, bound=0.5),)
    needs = ("across",)
    source = "IEEE Std 1293-2018: misalignment of the input axis"
    instruments = ("accelerometer",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Specific force across the input axis, shape (..., n, 1)."""
        return columns(u, known(motion, "across", self.id))


@final
@dataclass(frozen=True)
class AccelCrossCoupling(LinearEffect):
    """A scale of an accelerometer that the force across its input axis changes: c f f_p."""

    id = "accel_cross_coupling"
    title = "cross-coupling of an accelerometer"
    meaning = "the output follows the product of the forces along and across the input axis"
    linear = (Param("c", "1/({y})", sd=1e-4, bound=1e-2),)
    needs = ("across",)
    source = "IEEE Std 1293-2018: cross-coupling coefficient Kip"
    instruments = ("accelerometer",)
    of_rate = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Product of the specific forces along and across the input axis, shape (..., n, 1)."""
        return columns(u, u * known(motion, "across", self.id))


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
