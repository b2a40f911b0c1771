"""Taking the errors of a whole triad out: its axes see each other, and what moves it is not known from elsewhere.

    y = x + E x + o,      x = (I + E)^-1 (y - o)

E holds what goes with the input of the axis itself or of its neighbours, o everything else (biases, g-sensitivity);
both may follow the temperature or the time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Recording
from insenv.data.exposure import Exposure
from insenv.effects.base import Effect
from insenv.effects.cross import GSensitivity

_TABLE = {"table_angle", "table_rate"}


class CarriedEffect(Protocol):
    """An effect with its parameters."""

    @property
    def effect(self) -> Effect:
        """The effect."""

    @property
    def theta(self) -> Floats:
        """Its parameters, shape (p,)."""

    def addition(self, u: Floats, motion: Motion) -> Floats:
        """What it adds."""


def whole_triads(
    recording: Recording, held: Mapping[str, tuple[Sequence[CarriedEffect], Exposure]]
) -> dict[str, Channel]:
    """Corrected channels of those triads of ``recording`` that are to be corrected as a whole.

    These have three targets in ``held``, nothing but effects of a triad, at least one that goes with the input, and no
    table that would show the input.

    Raises
    ------
    InputError
        If the coefficients make the axes of a triad one.
    """
    channels: dict[str, Channel] = {}
    for prefix in ("accel", "gyro"):
        names = [f"{prefix}_{axis}" for axis in "xyz"]
        if _TABLE & recording.channels.keys() or not all(name in held for name in names):
            continue
        terms = [held[name][0] for name in names]
        effects = [one.effect for row in terms for one in row]
        if all(map(_linear, effects)) and any(_of_input(effect) for effect in effects):
            values = _solved(recording, names, terms, [held[name][1] for name in names])
            channels |= {name: replace(recording.channels[name], values=values[:, i]) for i, name in enumerate(names)}
    return channels


def _linear(effect: Effect) -> bool:
    """Whether it is part of the linear model of a triad; what gravity does to gyros is known beforehand."""
    slow = effect.of_time or "temperature" in effect.needs
    offset = slow and not (effect.of_rate or effect.line)
    return bool(effect.part) or effect.of_force or offset or effect.id == GSensitivity.id


def _of_input(effect: Effect) -> bool:
    """Whether a linear one goes with the input of the axes."""
    return effect.part in ("gain", "others") or effect.of_force


def _solved(
    recording: Recording, names: Sequence[str], terms: Sequence[Sequence[CarriedEffect]], exposures: Sequence[Exposure]
) -> Floats:
    """Corrected readings of a triad, shape (rows, 3)."""
    readings = np.stack([recording.channels[name].values for name in names], axis=1)
    matrix = np.tile(np.eye(3), (len(readings), 1, 1))
    for axis, (row, exposure) in enumerate(zip(terms, exposures, strict=True)):
        motion, cell_of_row = exposure.motion, np.maximum(exposure.cell_of_row, 0)
        for one in row:
            if one.effect.part == "others":
                matrix[:, axis] += np.where(np.arange(3) == axis, 0.0, one.theta)
            elif _of_input(one.effect):
                ones = np.ones(motion.n)
                matrix[:, axis, axis] += (one.addition(ones, motion) - one.addition(0 * ones, motion))[cell_of_row]
            else:
                readings[:, axis] -= one.addition(exposure.u, motion)[cell_of_row]
    if not np.all(np.linalg.cond(matrix) < 1e6):
        raise InputError(f"{recording.label}: {', '.join(names)}: the calibration makes these axes one")
    return np.asarray(np.linalg.solve(matrix, readings[..., None])[..., 0], np.float64)
