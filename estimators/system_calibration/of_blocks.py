"""Estimators of a unit on axes that gather the blocks of a run, rests and turns, and solve when they are asked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.information.unit.anew import FIRST, after, products_show
from insenv.information.unit.calibration import (
    Blocks,
    GatheredBlocks,
    UnitModel,
    begun,
    gathered,
    joined,
    linearised,
    nothing,
)


@dataclass(frozen=True)
class BlocksSeen:
    """State: what was gathered, whether there is a batch in front, and at how many blocks the model is made anew."""

    data: GatheredBlocks
    batched: bool
    due: int = FIRST


@dataclass(frozen=True)
class OfBlocks:
    """Gathers blocks and solves them; where products of two errors show, about what was found before.

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

    @cached_property
    def estimated(self) -> NDArray[np.bool_]:
        """Which of the model's parameters are, shape (p,): all."""
        return np.ones(len(self.model.parameters), bool)

    def reset(self, batch: int | None = None) -> BlocksSeen:
        """No row yet."""
        return BlocksSeen(nothing(self.model, batch or 1, products_show(self.datasheet)), batch is not None)

    def update(self, state: BlocksSeen, chunk: Recording) -> BlocksSeen:
        """State after a chunk."""
        data, due = gathered(self.model, state.data, chunk), state.due
        while data.point is not None and data.passed >= due:
            blocks = joined(data)
            assert blocks is not None
            data = linearised(self.model, data, self.solved(begun(blocks, due), data.point)[0])
            due = after(due)
        return BlocksSeen(data, state.batched, due)

    def estimate(self, state: BlocksSeen) -> Estimate:
        """What is known; before there is a block of data, what the datasheet tells."""
        own, runs, blocks = self.estimated, len(state.data.past), joined(state.data)
        parameters = [q for q, used in zip(self.model.parameters, own, strict=True) if used]
        if blocks is None:
            mean = np.tile([q.mean for q in parameters], (runs, 1))
            cov = np.tile(np.diag([q.sd**2 for q in parameters]), (runs, 1, 1))
        else:
            mean, cov = self.solved(blocks, state.data.point)
            mean, cov = mean[:, own], cov[:, own][:, :, own]
        if not state.batched:
            mean, cov = mean[0], cov[0]
        return Estimate(tuple(q.name for q in parameters), tuple(q.unit for q in parameters), mean, cov)

    def solved(self, blocks: Blocks, point: Floats | None) -> tuple[Floats, Floats]:
        """Mean and covariance of all parameters, (R, p) and (R, p, p), of blocks that are linear about a point."""
        return self.model.posterior(blocks, point)
