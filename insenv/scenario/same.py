"""A further run of one instrument: another procedure and other noise, the same truths."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

from insenv.scenario.build import Scenario
from insenv.scenario.cast import Truth
from insenv.scenario.plant import known_parameters


@dataclass(frozen=True)
class SameInstrument(Scenario):
    """A scenario whose every run is the instrument of one seed.

    Attributes
    ----------
    instrument : int
        Seed of its truths; that of a run is the seed of its noise.
    base_turned : float
        How far the base was turned since the first run, clockwise from above [rad].
    """

    instrument: int = 0
    base_turned: float = 0.0

    @classmethod
    def of(cls, scenario: Scenario, instrument: int, base_turned: float = 0.0) -> SameInstrument:
        """The instrument of a seed in a scenario."""
        given: dict[str, Any] = {f.name: getattr(scenario, f.name) for f in fields(Scenario)}
        return cls(**given, instrument=instrument, base_turned=base_turned)

    def truth(self, seed: int, power_up: int = 1) -> Truth:
        """What the instrument has, on the base as it was turned; ``seed`` says nothing of it."""
        del seed
        found = super().truth(self.instrument, power_up)
        if not self.base_turned:
            return found
        plant = found.plant.turned(self.base_turned)
        told = (
            replace(p, values=known_parameters(plant, p.effect) or p.values) if p.told else p for p in found.planted
        )
        return Truth(plant, tuple(told))
