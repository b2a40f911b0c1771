r"""What differs from run to run, drawn: generators by seed and place, and what every kind of plant has drawn for it.

A place has a generator of its own, (seed, (10^6, place)), so that another effect at the end leaves the draws before as
they were, and none of them is one of the noise's (`insenv.rig`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Sight

#: First number of every generator's place.
PLACE = 10**6
#: Places of the azimuth, of the level error, and of the first counter's start phase.
AZIMUTH, LEVEL, PHASE = PLACE, PLACE + 1, PLACE + 2
#: Places of a vehicle's heading, sight, told level and sway, beyond those of all counters.
VEHICLE = tuple(PLACE + 100 + i for i in range(4))


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


class Spread(Protocol):
    """What differs from run to run of a plant of one kind."""

    @property
    def sight_and_level(self) -> tuple[Sight | None, tuple[float, float]]:
        """What a datasheet says of a sight, and deviations of a level that is told [rad]; infinite where none is."""

    def drawn(self, plant: Any, seed: int) -> Any:
        """The plant of a run."""

    def stacked(self, plants: Sequence[Any]) -> Any:
        """Plants of single runs as one batch: what is drawn has shape (R, ...)."""

    def shown(self, plant: Any) -> Mapping[str, object]:
        """What the truth of a run says of its plant [rad]: all that a scenario does not say, or has as an error."""


@dataclass(frozen=True)
class Fixed:
    """Nothing is drawn: every run has the same plant."""

    sight_and_level: tuple[None, tuple[float, float]] = (None, (np.inf, np.inf))

    def drawn(self, plant: Any, seed: int) -> Any:
        """The plant."""
        del seed
        return plant

    def stacked(self, plants: Sequence[Any]) -> Any:
        """The plant."""
        return plants[0]

    def shown(self, plant: Any) -> Mapping[str, object]:
        """Nothing."""
        del plant
        return {}
