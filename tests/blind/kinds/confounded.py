"""Procedures that cannot tell one cause from another, whatever is done with their data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from blind import climate, curves, parts
from blind.files import Column
from blind.kinds.special import accelerometer
from blind.parts import Part
from blind.plan import Plan, plan
from blind.world import World

Rng = np.random.Generator
PHASE = 1.1


@dataclass(frozen=True)
class Procedure:
    """A plan; the true causes of which one is drawn; what a report must name together; what is not declared."""

    plan: Callable[[Rng], Plan]
    truths: tuple[str, ...]
    required: tuple[str, ...]
    undeclared: tuple[str, ...] = ("scale_factor", "earth_rate")

    def part(self, w: World, key: str, rng: Rng) -> Part:
        if key == "g_sensitivity":  # along the axis that the accelerometer of `_level` shows
            return parts.gyro(key, curves.locked(w, 1, PHASE))
        return parts.EXACT[key](w, rng)


def _one_rate(rng: Rng) -> Plan:
    drawn = plan(rng, ("constant",), ("room",), encoder=True)
    return _upright(drawn)


def _level(rng: Rng) -> Plan:
    """The table's axis lies level, and two accelerometers turn with the gyro."""
    drawn = _one_rate(rng)
    world = replace(drawn.world, latitude=0.0)
    return replace(drawn, world=world, extra=accelerometers(world, rng))


def accelerometers(world: World, rng: Rng) -> tuple[Column, ...]:
    return accelerometer(world, PHASE, rng), accelerometer(world, PHASE - np.pi / 2, rng, "y")


def _upright(drawn: Plan) -> Plan:
    """The axis along the table's: no Earth rate turns with the table."""
    return replace(drawn, world=replace(drawn.world, tilt=np.pi / 2), site=False)


def _warming(kind: str, profiles: tuple[str, ...]) -> Callable[[Rng], Plan]:
    def drawn(rng: Rng) -> Plan:
        chosen = plan(rng, profiles, climate.KINDS, thermometer=True)
        warm = replace(chosen.world, climate=climate.draw(kind, chosen.world.duration, rng))
        return _upright(replace(chosen, world=warm))

    return drawn


def _constant(rng: Rng) -> Plan:
    return _upright(plan(rng, ("constant",), climate.KINDS))


_ONCE = ("angle_locked_rate:1", "encoder_harmonic:1")

SETS = {
    "one per turn at one rate": Procedure(_one_rate, _ONCE, _ONCE),
    "two per turn at one rate": Procedure(
        _one_rate, ("angle_locked_rate:2", "encoder_harmonic:2"), ("angle_locked_rate:2", "encoder_harmonic:2")
    ),
    "one per turn at one rate, axis level": Procedure(_level, (*_ONCE, "g_sensitivity"), (*_ONCE, "g_sensitivity")),
    "drift or temperature": Procedure(
        _warming("steady ramp", ("rest", "reversal")),
        ("bias_drift", "bias_temperature:1"),
        ("bias_drift", "bias_temperature:1"),
        (),
    ),
    "warm-up or temperature": Procedure(
        _warming("own heat", ("rest", "reversal")),
        ("bias_temperature:1",),
        ("bias_temperature:1", "bias_warm_up"),
        (),
    ),
    "drift of bias or scale factor at one rate": Procedure(
        _constant, ("bias_drift", "scale_factor_drift"), ("bias_drift", "scale_factor_drift")
    ),
}
