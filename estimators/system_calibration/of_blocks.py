"""Estimators of a unit on axes that gather the blocks of a run, rests and turns, and solve when they are asked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from insenv.core.estimate import Datasheet
from insenv.core.recording import Recording
from insenv.information.unit.calibration import Gathered, UnitModel, gathered, nothing


@dataclass(frozen=True)
class Seen:
    """State: what was gathered, and whether there is a batch in front."""

    data: Gathered
    batched: bool


@dataclass(frozen=True)
class OfBlocks:
    """Gathers blocks; what they tell is left to the estimator.

    Raises
    ------
    InputError
        If the datasheet tells of no axes, no gravity or no noise.
    """

    datasheet: Datasheet

    def __post_init__(self) -> None:
        _ = self.model

    @cached_property
    def model(self) -> UnitModel:
        """The linear model."""
        return UnitModel(self.datasheet)

    def reset(self, batch: int | None = None) -> Seen:
        """No row yet."""
        return Seen(nothing(self.model, batch or 1), batch is not None)

    def update(self, state: Seen, chunk: Recording) -> Seen:
        """State after a chunk."""
        return Seen(gathered(self.model, state.data, chunk), state.batched)
