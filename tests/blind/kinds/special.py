"""Causes that need a bench of their own: an Earth rate left out, a register that is refreshed late, gravity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from blind import climate, curves
from blind.files import Column
from blind.parts import Part, gyro
from blind.plan import Plan, plan
from blind.record import AZIMUTH, clean_rate, ruler
from blind.table import Floats
from blind.world import EARTH, GRAVITY, World

Rng = np.random.Generator
Wrong = tuple[Plan, tuple[str, ...], Part, float]


def earth_rate(rng: Rng, strength: float) -> Wrong:
    """A tilted gyro whose maker forgot that the table turns it through north; its noise makes that hard to see."""
    while True:
        chosen = plan(rng, ("reversal", "staircase", "constant", "with_stops"), climate.KINDS)
        if chosen.world.tilt < 1.5:
            break
    chosen = replace(chosen, level_earth=False)
    part = gyro("earth_rate", chosen.world.horizontal_earth(AZIMUTH))
    size = float(np.ptp(chosen.world.horizontal_earth(AZIMUTH)))
    for _ in range(4):
        declared = tuple(d for d in chosen.declared if d != "earth_rate")
        more = ruler(chosen, declared).beside(part.addition(size)) / strength
        chosen = replace(chosen, noise=chosen.noise.scaled(more), pulse=chosen.pulse * more,
                         encoder_step=chosen.encoder_step * more, bias=chosen.bias * more)  # fmt: skip
    return chosen, declared, part, size


def sample_hold(rng: Rng, strength: float) -> Wrong:
    """The logger asks faster than the gyro answers."""
    while True:
        chosen = plan(rng, ("sine", "staircase", "reversal"), climate.KINDS)
        if chosen.output != "rate" or chosen.world.instant:
            continue
        true = clean_rate(chosen)
        part = _register(true)
        for count in (2, 3, 4, 5, 8, 10, 16, 20, 25, 40, 50):
            slow = replace(chosen, hold=count)
            if count * chosen.world.dt > 2.0:
                break
            if ruler(slow, slow.declared).beside(part.addition(count)) >= strength:
                return slow, slow.declared, part, float(count)


def _register(true: Floats) -> Part:
    return Part("sample_hold", lambda count: curves.held(true, max(1, round(count))) - true, 2.0)


def g_sensitivity(rng: Rng, strength: float) -> Wrong:
    """A table whose axis is level: gravity turns about the gyro, an accelerometer beside it says how."""
    profiles = ("reversal", "staircase", "positions", "with_stops", "sine")
    return upended(plan(rng, profiles, climate.KINDS, encoder=True), rng, strength)


def upended(chosen: Plan, rng: Rng, strength: float) -> Wrong:
    level = replace(chosen.world, tilt=np.pi / 2, latitude=0.0)
    phase = float(rng.uniform(0, 6))
    chosen = replace(chosen, world=level, site=False, extra=(accelerometer(level, phase, rng),))
    part = gyro("g_sensitivity", curves.locked(level, 1, phase))
    size = strength / ruler(chosen, chosen.declared).beside(part.addition(1.0))
    return chosen, chosen.declared, part, size


def accelerometer(w: World, phase: float, rng: Rng, axis: str = "x") -> Column:
    """Across a level axis, turning with it: gravity as a cosine of the angle."""
    read = GRAVITY * curves.locked(w, 1, phase) + 2e-3 * rng.standard_normal(w.n)
    return Column(f"accel_{axis}", f"acc {axis}", read, 5, "m/s^2", {} if w.instant else {"covers": '"interval"'})


def cross_axis(rng: Rng, strength: float) -> Wrong:
    """A triad on a table: gyro x is level, and feels a little of the table's rate, which gyro z measures."""
    chosen = plan(rng, ("reversal", "staircase", "with_stops", "sine"), climate.KINDS, True, grades=("fibre", "mems"))
    level = replace(chosen.world, tilt=0.0)
    noise = chosen.noise
    upright = level.turned * (1 + 2e-4) + EARTH * np.sin(level.latitude)
    values = np.rad2deg(upright + noise.n / np.sqrt(level.dt) * rng.standard_normal(level.n))
    column = Column("gyro_z", "gyro up", values, 9, "deg/s", {"covers": '"interval"'})
    chosen = replace(chosen, world=level, site=True, target="gyro_x", extra=(column,))
    part = gyro("cross_axis", level.turned)
    declared = ("bias", "earth_rate")
    return chosen, declared, part, strength / ruler(chosen, declared).beside(part.addition(1.0))


SPECIAL: dict[str, Callable[[Rng, float], Wrong]] = {
    "earth_rate": earth_rate,
    "sample_hold": sample_hold,
    "g_sensitivity": g_sensitivity,
    "cross_axis": cross_axis,
}
