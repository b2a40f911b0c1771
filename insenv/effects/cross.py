"""Errors from the other axes.

    g_sensitivity   c_x f_x + c_y f_y + c_z f_z        specific force along the body axes
    cross_axis      c_x w_x + c_y w_y + c_z w_z        rate about the other body axes

An axis that was not measured has a column of zeros: its coefficient stays unknown. To a level gyro the table's own rate
is that about the vertical axis (`insenv.data.exposure`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, LinearEffect, Param
from insenv.effects.forms import along_axes, columns


@final
@dataclass(frozen=True)
class GSensitivity(LinearEffect):
    """A rate that acceleration and gravity feign."""

    id = "g_sensitivity"
    title = "g-sensitivity"
    meaning = "the bias follows the specific force along an axis"
    linear = tuple(Param(f"c_{axis}", OUTPUT + "/(m/s^2)", sd=1e-4, bound=5e-3) for axis in "xyz")
    needs = ("force",)
    source = "IEEE Std 1431-2004: acceleration sensitivity; Titterton and Weston, section 4"
    on_axes = ("gyro",)
    instruments = ("gyro",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Specific force along x, y and z, shape (..., n, 3)."""
        return columns(u, *along_axes(motion.force))


@final
@dataclass(frozen=True)
class CrossAxis(LinearEffect):
    """An input axis that is not quite where it is thought to be."""

    id = "cross_axis"
    part = "others"
    title = "cross-axis coupling"
    meaning = "the input axis sees a part of the rate about another axis"
    linear = tuple(Param(f"c_{axis}", "1", sd=0.01, bound=0.2) for axis in "xyz")
    needs = ("cross_rate",)
    source = "IEEE Std 952-1997: input axis misalignment"
    on_axes = ("gyro",)
    instruments = ("gyro",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Rates about the other axes, shape (..., n, 3)."""
        return columns(u, *along_axes(motion.cross_rate))
