r"""Random truths of a run: what a scenario gives with an uncertainty, drawn.

    value = mean + sd z,    z of the generator (seed, (10^6, k))

with k the place of the effect in `Scenario.planted`; what the plant and the counters draw has the places from
10^6 on (`insenv.scenario.draws`).

What differs from power-up to power-up is drawn for each of them: power-up p has the generator (seed, (10^6, k, p)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.effects.base import Effect
from insenv.plants.base import Plant
from insenv.rig import Fitted, Rig
from insenv.scenario.draws import Spread, generator
from insenv.scenario.plant import known_parameters


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


def truth(plant: Plant, spread: Spread, planted: Sequence[Planted], seed: int, power_up: int = 1) -> Truth:
    """What run ``seed`` has at a power-up."""
    plant = spread.drawn(plant, seed)
    return Truth(plant, tuple(_effect(p, plant, (seed, power_up), k) for k, p in enumerate(planted)))


def _effect(p: Planted, plant: Plant, run: tuple[int, int], k: int) -> Planted:
    """An effect with the values of one run and power-up."""
    seed, power_up = run
    if p.told:
        return replace(p, values=known_parameters(plant, p.effect) or p.values)
    values = list(p.values)
    for deviations, place in ((p.sd, (k,)), (p.again, (k, power_up))):
        if any(deviations):
            z = generator(seed, *place).standard_normal(len(values))
            values = [float(value + sd * d) for value, sd, d in zip(values, deviations, z, strict=True)]
    # Four deviations from the limit, so that a value is cut off in 3 of 100 000 runs: `values.parameters`.
    return replace(p, values=tuple(max(v, param.low) for v, param in zip(values, p.effect.params, strict=True)))


def batch(rigs: Sequence[Rig], spread: Spread) -> Rig:
    """Single runs as one batch."""
    first = rigs[0]
    instruments = tuple(
        Fitted(fitted.sensor, np.stack([rig.instruments[i].theta for rig in rigs]))
        for i, fitted in enumerate(first.instruments)
    )
    return Rig(spread.stacked([rig.plant for rig in rigs]), instruments, first.rate)
