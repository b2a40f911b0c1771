"""Whether an estimator keeps the contract of `insenv.core.estimate`: what fails, in sentences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from insenv.core.estimate import Estimate
from insenv.core.recording import Recording
from insenv.core.rows import row_of, rows
from insenv.evaluate.check.rules import Calls, DeclinedError, FaultError, Say, alike, made, row, rows_of, sound
from insenv.evaluate.trials import RUNS, TrialRuns, cut, cut_at_events

#: Rows of a chunk, which no step of an environment has; the last: all at once.
_CUTS = (7, 333, 10**9)
#: Rows that are cut into chunks of 7: enough to tell, and soon done.
_SHORT = 700
_METHODS = ("reset", "update", "estimate")


def check_estimator(plugin: Callable[..., Any], trial: TrialRuns, say: Say = lambda doing, share: None) -> list[str]:
    """What is wrong with an estimator on the runs of a trial: one sentence for each fault, none where it is sound.

    Raises
    ------
    DeclinedError
        If it says that it is not for such recordings.
    """
    return _Check(plugin, trial, Calls(say)).faults()


def why_unsuited(plugin: Callable[..., Any], trial: TrialRuns) -> str:
    """Why a sound estimator cannot be judged on such runs: it tells nothing that is asked for; empty: it can."""
    one = plugin(trial.datasheet)
    told = one.estimate(one.reset(1)).names
    if set(told) & set(trial.asked):
        return ""
    wanted = ", ".join(f"{name} [{unit}]" for name, unit in trial.asked.items())
    return f"it tells {', '.join(told)}; asked for is {wanted}"


class _Check:
    """An estimator on one trial."""

    def __init__(self, plugin: Callable[..., Any], trial: TrialRuns, asked: Calls) -> None:
        self.plugin, self.trial, self.asked = plugin, trial, asked

    def faults(self) -> list[str]:
        """Each look goes on where the one before failed, unless nothing works at all."""
        said: list[str] = []
        try:
            self.one = made(self.asked, self.plugin, self.trial.datasheet, _METHODS)
            self.prior = self._prior()
            self.state, self.final = self._steps(RUNS, self.trial.chunks)
        except FaultError as fault:
            return [str(fault)]
        for look in (self._chunks, self._single, self._kept, self._fresh, self._rows):
            try:
                look()
            except (FaultError, DeclinedError) as fault:
                if str(fault) not in said:
                    said.append(str(fault))
        return said

    def _estimate(self, state: Any, batch: int | None, prior: bool = False) -> Estimate:
        return sound(self.asked.unchanged("estimate", self.one.estimate, state), batch, prior)

    def _prior(self) -> Estimate:
        """Before any data: of a batch, of one run, and of a batch of one."""
        found = [self._estimate(self.asked("reset", self.one.reset, batch), batch, True) for batch in (RUNS, 1, None)]
        if not (alike(row(found[0], 1), found[2]) and alike(row(found[1], 0), found[2])):
            raise FaultError("before any data a run of a batch is told other than a run alone; wanted the same prior")
        self._units(found[0])
        return found[0]

    def _units(self, prior: Estimate) -> None:
        """What is asked for is told in the unit in which it is judged."""
        for name, unit in zip(prior.names, prior.units, strict=True):
            wanted = self.trial.asked.get(name, unit)
            if unit != wanted:
                raise FaultError(f"estimate() tells {name!r} in {unit!r}; wanted {wanted!r}")

    def _steps(self, batch: int | None, chunks: Sequence[Recording]) -> tuple[Any, Estimate]:
        """State and estimate after chunks; estimates on the way are looked at now and then."""
        state = self.asked("reset", self.one.reset, batch)
        for k, chunk in enumerate(chunks):
            state = self.asked.unchanged("update", self.one.update, state, chunk)
            if k % 8 == 0:
                names = self._estimate(state, batch).names
                if names != self.prior.names:
                    raise FaultError(
                        f"estimate() tells {', '.join(names)} after data and {', '.join(self.prior.names)} before; "
                        f"wanted the same names"
                    )
        return state, self._estimate(state, batch)

    def _chunks(self) -> None:
        """How a record is cut makes no difference."""
        for n in _CUTS:
            given = cut(self.trial.chunks, n)
            wanted = self.final
            if n < 10:
                given = given[: _SHORT // n]
                wanted = self._updated(cut(given, 10**9))
            if not alike(found := self._updated(given), wanted):
                raise FaultError(
                    f"chunks of {n if n < 10**6 else 'all'} rows give {_shown(found)}, others {_shown(wanted)}; "
                    f"wanted the same: carry in the state what an interval that is cut needs"
                )

        given = cut_at_events(self.trial.chunks)
        if not alike(found := self._updated(given), self.final):
            raise FaultError(
                f"chunks that begin or end where something happens (a reading appears, a turn begins) give "
                f"{_shown(found)}, others {_shown(self.final)}; wanted the same: the first and the last row of a chunk "
                f"count like any other"
            )

    def _updated(self, chunks: Sequence[Recording]) -> Estimate:
        state = self.asked("reset", self.one.reset, RUNS)
        for chunk in chunks:
            state = self.asked("update", self.one.update, state, chunk)
        return self._estimate(state, RUNS)

    def _single(self) -> None:
        """A row of a batch is the run alone."""
        _, alone = self._steps(None, [row_of(chunk, 1) for chunk in self.trial.chunks])
        if not alike(alone, row(self.final, 1)):
            raise FaultError(
                f"a run alone gives {_shown(alone)}, as row of a batch {_shown(row(self.final, 1))}; wanted the same: "
                f"sum over the last axis, and keep the batch in front"
            )

    def _kept(self) -> None:
        """What another run does changes no state that was kept."""
        self._updated(self.trial.chunks[:3])
        if not alike(self._estimate(self.state, RUNS), self.final, 0.0):
            raise FaultError(
                "after another run a kept state gives another estimate; wanted all that is learnt in the state, "
                "nothing in self"
            )

    def _fresh(self) -> None:
        """A reset knows nothing of what was before."""
        if not alike(self._estimate(self.asked("reset", self.one.reset, RUNS), RUNS, True), self.prior, 0.0):
            raise FaultError("reset() after a run does not give the prior; wanted a fresh start")

    def _rows(self) -> None:
        """Rows of the state are runs."""
        index = [2, 0]
        try:
            some = rows(self.state, np.array(index))
        except Exception as error:  # whatever another author's state does
            raise FaultError(
                f"rows of its state cannot be taken ({error}); wanted arrays with the batch in front, in tuples, "
                f"mappings or dataclasses, or a method rows(index)"
            ) from None
        if not alike(self._estimate(some, len(index)), rows_of(self.final, index)):
            raise FaultError(
                "rows of its state are not the runs; wanted the batch in front of every array of the state"
            )


def _shown(estimate: Estimate) -> str:
    """The first quantity, in words."""
    mean, sd = estimate.of(estimate.names[0])
    return f"{estimate.names[0]} = {np.ravel(mean)[0]:.6g} +- {np.ravel(sd)[0]:.3g}"
