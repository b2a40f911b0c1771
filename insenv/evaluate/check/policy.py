"""Whether a policy keeps the contract of `insenv.core.estimate`: what fails, in sentences.

It is asked for actions while the runs of a trial pass by, which other commands recorded: what matters here is the form
of its answers, not how good they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from insenv.core.estimate import Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.rows import row_of, rows
from insenv.evaluate.check.rules import Calls, DeclinedError, FaultError, Say, made, row, rows_of
from insenv.evaluate.trials import RUNS, TrialRuns

#: A number that was rounded to single precision may lie this share of the range beyond a bound.
_SLACK = 1e-6


def check_policy(plugin: Callable[..., Any], trial: TrialRuns, say: Say = lambda doing, share: None) -> list[str]:
    """What is wrong with a policy on the runs of a trial: one sentence for each fault, none where it is sound.

    Raises
    ------
    DeclinedError
        If it says that it is not for such recordings, or the plant cannot do what it wants.
    """
    return _Check(plugin, trial, Calls(say)).faults()


class _Check:
    """A policy on one trial."""

    def __init__(self, plugin: Callable[..., Any], trial: TrialRuns, asked: Calls) -> None:
        self.plugin, self.trial, self.asked = plugin, trial, asked

    def faults(self) -> list[str]:
        """Each look goes on where the one before failed, unless nothing works at all."""
        said: list[str] = []
        try:
            self.one = made(self.asked, self.plugin, self.trial.datasheet, ("reset", "act"))
            self.actions, self.state = self._played(RUNS)
        except FaultError as fault:
            return [str(fault)]
        for look in (self._again, self._single, self._without, self._rows):
            try:
                look()
            except FaultError as fault:
                if str(fault) not in said:
                    said.append(str(fault))
        return said

    def _act(
        self, state: Any, chunk: Recording | None, estimate: Estimate | None, batch: int | None
    ) -> tuple[Floats, Any]:
        answer = self.asked.unchanged("act", self.one.act, state, chunk, estimate)
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise FaultError(f"act() returns a {type(answer).__name__}; wanted a tuple of an action and a state")
        return self._action(answer[0], batch), answer[1]

    def _action(self, action: Any, batch: int | None) -> Floats:
        """Real numbers within the action space, of the shape of the batch."""
        low, high = self.trial.low, self.trial.high
        shape = (len(low),) if batch is None else (batch, len(low))
        try:
            given = np.asarray(action)
        except ValueError:
            raise FaultError(f"act() returns rows of different lengths; wanted shape {shape}") from None
        if given.ndim == len(shape) and given.shape[:-1] == shape[:-1] and given.shape[-1] != len(low):
            raise DeclinedError(f"its actions have {given.shape[-1]} numbers, those of this environment {len(low)}")
        if given.shape != shape or given.dtype.kind not in "fiu":
            raise FaultError(
                f"act() returns an action of shape {given.shape} and type {given.dtype}; wanted shape {shape} and real "
                f"numbers"
            )
        if not np.isfinite(given).all():
            raise FaultError("act() returns an action that is not finite; wanted numbers")
        slack = _SLACK * (high - low)
        if np.any((given < low - slack) | (given > high + slack)):
            bad = np.argwhere((given < low - slack) | (given > high + slack))[0]
            j = int(bad[-1])
            raise DeclinedError(
                f"act() returns {given[tuple(bad)]:g} as component {j} of an action; wanted {low[j]:g} to {high[j]:g}"
            )
        return given.astype(float)

    def _played(self, batch: int | None, known: bool = True) -> tuple[list[Floats], Any]:
        """Actions of a run, or a batch of them, and the last state."""
        state, chunk = self.asked("reset", self.one.reset, batch), None
        actions = []
        for passed, estimate in zip((None, *self.trial.chunks), self.trial.estimates, strict=True):
            chunk = row_of(passed, 1) if batch is None and passed is not None else passed
            told = (row(estimate, 1) if batch is None else estimate) if known else None
            action, state = self._act(state, chunk, told, batch)
            actions.append(action)
        return actions, state

    def _again(self) -> None:
        """The same again, after a run."""
        again, _ = self._played(RUNS)
        for k, (a, b) in enumerate(zip(again, self.actions, strict=True)):
            if not np.array_equal(a, b):
                raise FaultError(
                    f"a second run gets other actions from step {k}; wanted a fresh start by reset(), all that is "
                    f"learnt in the state, and chance from a seed in the state"
                )

    def _single(self) -> None:
        """A row of a batch is the run alone."""
        alone, _ = self._played(None)
        for k, (a, b) in enumerate(zip(alone, self.actions, strict=True)):
            if not np.allclose(a, b[1], rtol=1e-9, atol=1e-12):
                raise FaultError(
                    f"in step {k} a run alone gets the action {a.tolist()}, as row of a batch {b[1].tolist()}; wanted "
                    f"the same: keep the batch in front"
                )

    def _without(self) -> None:
        """Where there is no estimator it may refuse, in a sentence."""
        try:
            self._played(RUNS, known=False)
        except DeclinedError:
            return
        except FaultError as fault:
            raise FaultError(f"without an estimate: {fault}") from None

    def _rows(self) -> None:
        """Rows of the state are runs."""
        index = [2, 0]
        chunk, estimate = self.trial.chunks[-1], self.trial.estimates[-1]
        try:
            some = rows(self.state, np.array(index))
            part = _rows_of(chunk, index)
        except Exception as error:  # whatever another author's state does
            raise FaultError(
                f"rows of its state cannot be taken ({error}); wanted arrays with the batch in front, in tuples, "
                f"mappings or dataclasses, or a method rows(index)"
            ) from None
        whole, _ = self._act(self.state, chunk, estimate, RUNS)
        found, _ = self._act(some, part, rows_of(estimate, index), len(index))
        if not np.allclose(found, whole[index], rtol=1e-9, atol=1e-12):
            raise FaultError(
                "rows of its state are not the runs; wanted the batch in front of every array of the state"
            )


def _rows_of(chunk: Recording, index: list[int]) -> Recording:
    channels = {
        name: replace(c, values=c.values[index] if c.values.ndim > 1 else c.values)
        for name, c in chunk.channels.items()
    }
    return replace(chunk, channels=channels)
