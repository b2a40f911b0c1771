r"""Random truths of a run: what a scenario gives with an uncertainty, drawn.

    value = mean + sd z,    z of the generator (seed, (10^6, k))

with k the place of the effect in `Scenario.planted`; what the plant and the counters draw has the places from
10^6 on. A place has a generator of its own, so that another effect at the end leaves the draws before as they
were, and none of them is one of the noise's (`insenv.rig`).

What differs from power-up to power-up is drawn for each of them: power-up p has the generator (seed, (10^6, k, p)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from insenv.core.errors import InputError
from insenv.effects.base import Effect
from insenv.plants.base import Plant
from insenv.plants.turntable import Turntable
from insenv.plants.vehicle import Vehicle
from insenv.rig import Fitted, Rig
from insenv.scenario.plant import told_by
from insenv.scenario.schema import RANDOM, ScenarioTable
from insenv.scenario.values import uncertain
from insenv.scenario.vehicle import Spread, stacked

#: First number of every generator's place.
PLACE = 10**6
#: Places of the azimuth, of the level error, and of the first counter's start phase.
AZIMUTH, LEVEL, PHASE = PLACE, PLACE + 1, PLACE + 2
#: Places of a vehicle's heading, sight, told level and sway, beyond those of all counters.
VEHICLE = tuple(PLACE + 100 + i for i in range(4))


@dataclass(frozen=True)
class Planted:
    """One effect that a scenario simulates: on which channel, with which SI values, and where it was named.

    ``origin`` is "noise" (the maker's figures), "declared" or "undeclared"; ``sd`` are the standard deviations
    of the values, zero where they are exact; ``told``: they are not given, the plant tells them. ``again`` are standard
    deviations of what is added anew at each power-up, empty where nothing is.
    """

    target: str
    effect: Effect
    values: tuple[float, ...]
    sd: tuple[float, ...]
    origin: str
    told: bool = False
    again: tuple[float, ...] = ()

    @property
    def spread(self) -> tuple[float, ...]:
        """Standard deviations of the values at any power-up."""
        return tuple(float(np.hypot(a, b)) for a, b in zip(self.sd, self.again, strict=True)) if self.again else self.sd


@dataclass(frozen=True)
class Truth:
    """What one run has: its plant and the values of every effect."""

    plant: Plant
    planted: tuple[Planted, ...]


def generator(seed: int, place: int, *power_up: int) -> np.random.Generator:
    """Generator of run ``seed`` for what stands at ``place``, and for one ``power_up`` of it where one is given.

    Raises
    ------
    InputError
        If the seed is negative.
    """
    if seed < 0:
        raise InputError(f"seed {seed} given; wanted zero or more")
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(PLACE, place, *power_up)))


def listed(seeds: int | Sequence[int]) -> tuple[int, ...]:
    """Seeds of one run or of a batch.

    Raises
    ------
    InputError
        If there is none.
    """
    found = (int(seeds),) if isinstance(seeds, int | np.integer) else tuple(int(seed) for seed in seeds)
    if not found:
        raise InputError("no seed given; wanted at least one")
    return found


def truth(
    table: ScenarioTable,
    plant: Plant,
    spreads: tuple[tuple[float, float], Spread],
    planted: Sequence[Planted],
    seed: int,
    power_up: int = 1,
) -> Truth:
    """What run ``seed`` has at a power-up; ``spreads`` are those of a table's level error [rad] and of a vehicle."""
    level_sd, spread = spreads
    if isinstance(plant, Vehicle):
        heading, sight, level, sway = (generator(seed, place) for place in VEHICLE)
        plant = spread.drawn(plant, (heading, sight, level, sway))
    if isinstance(plant, Turntable):
        plant = _turntable(table, plant, level_sd, seed)
    return Truth(plant, tuple(_effect(p, plant, (seed, power_up), k) for k, p in enumerate(planted)))


def _turntable(table: ScenarioTable, plant: Turntable, level_sd: tuple[float, float], seed: int) -> Turntable:
    """The table with its azimuth, uniform on the circle or near what is given, and its level error."""
    text = None if table.table is None else table.table.azimuth
    if text == RANDOM:
        plant = replace(plant, azimuth=float(np.pi * (1 - 2 * generator(seed, AZIMUTH).random())))
    elif sd := _deviation(text):
        plant = replace(plant, azimuth=float(plant.azimuth + sd * generator(seed, AZIMUTH).standard_normal()))
    if any(level_sd):
        z = generator(seed, LEVEL).standard_normal(2)
        east, north = (float(m + s * d) for m, s, d in zip(plant.level_error, level_sd, z, strict=True))
        plant = replace(plant, level_error=(east, north))
    return plant


@cache
def _deviation(azimuth: str | None) -> float:
    """Of an azimuth as it is written [rad]."""
    return uncertain(azimuth or "0 deg", "rad", "table.azimuth")[1]


def _effect(p: Planted, plant: Plant, run: tuple[int, int], k: int) -> Planted:
    """An effect with the values of one run and power-up."""
    seed, power_up = run
    if p.told:
        return replace(p, values=told_by(plant, p.effect) or p.values)
    values = list(p.values)
    for deviations, place in ((p.sd, (k,)), (p.again, (k, power_up))):
        if any(deviations):
            z = generator(seed, *place).standard_normal(len(values))
            values = [float(value + sd * d) for value, sd, d in zip(values, deviations, z, strict=True)]
    # Four deviations from the limit, so that a value is cut off in 3 of 100 000 runs: `values.parameters`.
    return replace(p, values=tuple(max(v, param.low) for v, param in zip(values, p.effect.params, strict=True)))


def batch(rigs: Sequence[Rig], tilted: bool) -> Rig:
    """Single runs as one batch; ``tilted``: each table has a level error of its own."""
    first, plant = rigs[0], rigs[0].plant
    if isinstance(plant, Turntable):
        tables = [rig.plant for rig in rigs if isinstance(rig.plant, Turntable)]
        plant = replace(plant, azimuth=np.array([table.azimuth for table in tables]))
        if tilted:
            east, north = np.array([table.level_error for table in tables]).T.copy()
            plant = replace(plant, level_error=(east, north))
    if isinstance(plant, Vehicle):
        plant = stacked([rig.plant for rig in rigs if isinstance(rig.plant, Vehicle)])
    instruments = tuple(
        Fitted(fitted.sensor, np.stack([rig.instruments[i].theta for rig in rigs]))
        for i, fitted in enumerate(first.instruments)
    )
    return Rig(plant, instruments, first.rate)
