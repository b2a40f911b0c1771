"""The contract of plug-ins: those of the package keep it, and each way to break it is told in a sentence."""

from __future__ import annotations

import pickle
import struct
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Ended, run

from estimators.two_position.joint import TwoPositionJoint
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.plugins import ESTIMATORS, POLICIES, find, names
from insenv.core.recording import Recording
from insenv.core.rows import row_of, rows
from insenv.core.stateful import Adapter, adapted
from insenv.core.system import SYSTEMS, system
from insenv.evaluate.check.child import SIMULATOR
from insenv.evaluate.check.estimator import check_estimator, why_unsuited
from insenv.evaluate.check.plugin import check_plugin
from insenv.evaluate.check.policy import check_policy
from insenv.evaluate.check.rules import DeclinedError
from insenv.evaluate.trials import RUNS, TrialRuns, cut, events, trial


@cache
def recorded(name: str) -> TrialRuns:
    """The runs of an environment, once for all tests."""
    return trial(name)


def said(check: Any, plugin: Any) -> dict[str, list[str]]:
    """Faults by environment; what declines is left out."""
    found = {}
    for name in names(SYSTEMS):
        try:
            found[name] = check(plugin, recorded(name))
        except DeclinedError:
            continue
    return found


@pytest.mark.parametrize("name", names(ESTIMATORS))
def test_every_estimator_keeps_the_contract(name: str) -> None:
    found = said(check_estimator, find(ESTIMATORS, name))
    assert found and not any(found.values()), found


@pytest.mark.parametrize("name", names(POLICIES))
def test_every_policy_keeps_the_contract(name: str) -> None:
    found = said(check_policy, find(POLICIES, name))
    assert found and not any(found.values()), found


# ------------------------------------------------------------------------------------------ estimators that break it


class Mean:
    """A sound estimator: the mean of the gyro."""

    def __init__(self, datasheet: Datasheet) -> None:
        self.datasheet = datasheet

    def reset(self, batch: int | None = None) -> Any:
        return np.zeros((2,) if batch is None else (batch, 2))

    def update(self, state: Any, chunk: Recording) -> Any:
        gyro = chunk.values("gyro", "rad/s")
        return state + np.stack([gyro.sum(axis=-1), np.full(gyro.shape[:-1], float(gyro.shape[-1]))], axis=-1)

    def estimate(self, state: Any) -> Estimate:
        count = np.maximum(state[..., 1], 1.0)
        mean, variance = state[..., 0] / count, 1e-6 / count
        return Estimate(("rate",), ("rad/s",), mean[..., None], variance[..., None, None])


class NeedsMore(Mean):
    def __init__(self, datasheet: Datasheet, gain: float) -> None:
        super().__init__(datasheet)


class Raises(Mean):
    def update(self, state: Any, chunk: Recording) -> Any:
        raise RuntimeError("out of order")


class SaysNaN(Mean):
    def estimate(self, state: Any) -> Estimate:
        known = super().estimate(state)
        return Estimate(known.names, known.units, np.where(state[..., 1:] > 0, np.nan, known.mean), known.cov)


class OneShape(Mean):
    def reset(self, batch: int | None = None) -> Any:
        return np.zeros(2)


class Negative(Mean):
    def estimate(self, state: Any) -> Estimate:
        known = super().estimate(state)
        return Estimate(known.names, known.units, known.mean, -known.cov)


class Lopsided(Mean):
    cov = ((1.0, 0.5), (0.1, 1.0))

    def estimate(self, state: Any) -> Estimate:
        cov = np.broadcast_to(self.cov, (*state.shape[:-1], 2, 2))
        return Estimate(("a", "b"), ("1", "1"), np.zeros((*state.shape[:-1], 2)), cov)


class Impossible(Lopsided):
    cov = ((1.0, 1.5), (1.5, 1.0))


class CountsChunks(Mean):
    def update(self, state: Any, chunk: Recording) -> Any:
        return state + np.array([0.0, 1.0])


class MixesRuns(Mean):
    def update(self, state: Any, chunk: Recording) -> Any:
        after = super().update(state, chunk)
        return after + (0.0 * after + after.mean(axis=0) if after.ndim > 1 else 0.0)


class Mutates(Mean):
    def update(self, state: Any, chunk: Recording) -> Any:
        state += super().update(np.zeros_like(state), chunk)
        return state


class SpoilsData(Mean):
    def update(self, state: Any, chunk: Recording) -> Any:
        chunk.channels["gyro"].values[..., 0] = 0.0
        return super().update(state, chunk)


class Remembers(Mean):
    seen = 0.0

    def update(self, state: Any, chunk: Recording) -> Any:
        self.seen += 1.0
        return super().update(state, chunk)

    def estimate(self, state: Any) -> Estimate:
        known = super().estimate(state)
        return Estimate(known.names, known.units, known.mean + self.seen, known.cov)


class InDegrees(Mean):
    told = ("azimuth", "deg")

    def estimate(self, state: Any) -> Estimate:
        known = super().estimate(state)
        return Estimate(self.told[:1], self.told[1:], known.mean, known.cov)


class PerHour(InDegrees):
    told = ("rate", "deg/h")


class NoUnit(InDegrees):
    told = ("rate", "gyros")


class RateForAngle(InDegrees):
    told = ("azimuth", "rad/s")


class HasNoEstimate:
    def __init__(self, datasheet: Datasheet) -> None:
        self.datasheet = datasheet

    reset, update = Mean.reset, Mean.update


BROKEN = {
    NeedsMore: "__init__() ends with TypeError",
    Raises: "update() ends with RuntimeError: out of order",
    SaysNaN: "that is not finite",
    OneShape: "wanted (3, 1) and (3, 1, 1)",
    Negative: "a variance of -1e-06 of 'rate'",
    Lopsided: "not symmetric",
    Impossible: "not positive semidefinite",
    CountsChunks: "chunks of 7 rows give",
    MixesRuns: "a run alone gives",
    Mutates: "update() changes the state",
    SpoilsData: "update() changes the block",
    Remembers: "nothing in self",
    HasNoEstimate: "it has no method estimate()",
    InDegrees: "tells 'azimuth' in 'deg', 0.0174533 of the SI unit",
    PerHour: "tells 'rate' in 'deg/h', 4.84814e-06 of the SI unit",
    NoUnit: "tells 'rate' in 'gyros', which is no unit",
    RateForAngle: "tells 'azimuth' in 'rad/s'; wanted 'rad'",
}


def test_a_sound_estimator_has_no_fault() -> None:
    assert check_estimator(Mean, recorded("NorthFinder")) == []


@pytest.mark.parametrize("plugin", BROKEN, ids=lambda plugin: plugin.__name__)
def test_what_is_wrong_with_an_estimator_is_told(plugin: type) -> None:
    faults = check_estimator(plugin, recorded("NorthFinder"))
    assert any(BROKEN[plugin] in fault for fault in faults), faults


class LosesFirstRow(TwoPositionJoint):
    """Does not see a sighting that is the first row of a chunk, unless the run begins with it."""

    def update(self, state: Any, chunk: Recording) -> Any:
        if state.navigation is None or not len(chunk.t):
            return super().update(state, chunk)
        sight = chunk.channels["sight_heading"]
        values = sight.values.copy()
        values[..., 0] = np.nan
        return super().update(
            state, replace(chunk, channels={**chunk.channels, "sight_heading": replace(sight, values=values)})
        )


@pytest.mark.parametrize("name", names(SYSTEMS))
def test_what_a_plugin_is_tried_on_holds_neither_simulator_nor_truth(name: str) -> None:
    from insenv.evaluate.runs import task_of  # a simulator, which the plug-ins of this module must not import

    data = pickle.dumps(recorded(name))
    assert not [module for module in SIMULATOR if module.encode() in data]
    task = task_of(system(name).trial.scenario, system(name).trial.changes)
    truth = task.world.truth(task.world.cast(range(RUNS)), RUNS)
    for asked in recorded(name).asked:
        assert not [value for value in truth[asked] if struct.pack("<d", value) in data]


@pytest.mark.parametrize("name", names(SYSTEMS))
def test_who_tells_nothing_that_is_asked_for_cannot_be_judged(name: str) -> None:
    data = recorded(name)
    wanted = ", ".join(f"{asked} [{unit}]" for asked, unit in data.asked.items())
    assert why_unsuited(Mean, data) == f"it tells rate; asked for is {wanted}"
    for known in names(ESTIMATORS):
        try:
            prior = find(ESTIMATORS, known)(data.datasheet)
        except InputError:
            continue
        told = set(prior.estimate(prior.reset(1)).names)
        assert bool(why_unsuited(find(ESTIMATORS, known), data)) == (not told & set(data.asked))


def test_a_chunk_that_begins_with_an_event_is_tried() -> None:
    """The sighting after a turn begins a step, so that all steps and long chunks lose it alike."""
    chunks = recorded("TwoPosition").chunks
    whole = {name: np.concatenate([c.channels[name].values for c in chunks], axis=-1) for name in chunks[0].channels}
    sighted = np.flatnonzero(np.isfinite(whole["sight_heading"]).any(axis=0))
    assert set(sighted[1:].tolist()) <= set(events(whole))
    assert check_estimator(TwoPositionJoint, recorded("TwoPosition")) == []
    faults = check_estimator(LosesFirstRow, recorded("TwoPosition"))
    assert any("where something happens" in fault or "chunks of" in fault for fault in faults), faults


# -------------------------------------------------------------------------------------------- policies that break it


class Steady:
    """A sound policy."""

    rate: Any = 0.1

    def __init__(self, datasheet: Datasheet) -> None:
        self.datasheet = datasheet

    def reset(self, batch: int | None = None) -> Any:
        return np.zeros(batch or ())

    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> Any:
        return np.stack([np.full_like(state, self.rate), np.zeros_like(state)], axis=-1), state + 1.0


class NoPair(Steady):
    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> Any:
        return super().act(state, chunk, estimate)[0]


class Undefined(Steady):
    rate = np.nan


class FlatAction(Steady):
    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> Any:
        return np.array([0.1, 0.0]), state


class Chance(Steady):
    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> Any:
        action, after = super().act(state, chunk, estimate)
        return action * np.random.default_rng().random(), after


class NeedsEstimate(Steady):
    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> Any:
        assert estimate is not None, "no estimate"
        return super().act(state, chunk, estimate)


BROKEN_POLICIES = {
    NoPair: "wanted a tuple of an action and a state",
    Undefined: "not finite",
    FlatAction: "wanted shape (3, 2)",
    Chance: "a second run gets other actions from step 0",
    NeedsEstimate: "without an estimate: act() ends with AssertionError",
}


def test_a_sound_policy_has_no_fault() -> None:
    assert check_policy(Steady, recorded("RateTable")) == []


@pytest.mark.parametrize("plugin", BROKEN_POLICIES, ids=lambda plugin: plugin.__name__)
def test_what_is_wrong_with_a_policy_is_told(plugin: type[Steady]) -> None:
    faults = check_policy(plugin, recorded("RateTable"))
    assert any(BROKEN_POLICIES[plugin] in fault for fault in faults), faults


def test_a_policy_that_wants_too_much_is_not_for_the_plant() -> None:
    class Fast(Steady):
        rate = 100.0

    with pytest.raises(DeclinedError, match="returns 100 as component 0 of an action; wanted -0.87"):
        check_policy(Fast, recorded("RateTable"))


# ------------------------------------------------------------------------------------ classes that keep their state


class KeepsItself:
    """The mean of the gyro, as one would write it for one run."""

    def __init__(self, datasheet: Datasheet) -> None:
        self.total, self.count = 0.0, 0

    def update(self, block: Recording) -> None:
        gyro = block.values("gyro", "rad/s")
        self.total, self.count = self.total + float(gyro.sum()), self.count + gyro.size

    def estimate(self) -> Estimate:
        count = max(self.count, 1)
        return Estimate(("rate",), ("rad/s",), np.array([self.total / count]), np.array([[1e-6 / count]]))


class CountsItself:
    """A policy that turns over after ten steps."""

    def __init__(self, datasheet: Datasheet) -> None:
        self.steps = 0

    def act(self, block: Recording | None, estimate: Estimate | None = None) -> Any:
        self.steps += 1
        return np.array([0.1 if self.steps <= 10 else -0.1, 0.0])


def test_a_stateful_class_is_adapted_and_a_stateless_one_is_not() -> None:
    assert isinstance(adapted(KeepsItself), Adapter) and isinstance(adapted(CountsItself), Adapter)
    for plugin in (Mean, Steady, *(find(g, n) for g in (ESTIMATORS, POLICIES) for n in names(g))):
        assert adapted(plugin) is plugin


def test_an_adapted_class_keeps_the_contract_and_says_what_the_stateless_one_says() -> None:
    data = recorded("NorthFinder")
    assert check_estimator(adapted(KeepsItself), data) == []
    assert check_policy(adapted(CountsItself), data) == []
    told = []
    for plugin in (Mean, adapted(KeepsItself)):
        made = plugin(data.datasheet)
        state = made.reset(RUNS)
        for chunk in data.chunks:
            state = made.update(state, chunk)
        told.append(made.estimate(rows(state, np.array([2, 0]))))
    np.testing.assert_allclose(told[0].mean, told[1].mean, rtol=1e-12)
    np.testing.assert_allclose(told[0].cov, told[1].cov, rtol=1e-12)


def test_pieces_of_a_record_are_the_record() -> None:
    chunks = recorded("RateTable").chunks
    pieces = cut(chunks, 7)
    for name in chunks[0].channels:
        whole = np.concatenate([c.channels[name].values for c in chunks], axis=-1)
        assert np.array_equal(np.concatenate([c.channels[name].values for c in pieces], axis=-1), whole)
    assert row_of(pieces[0], 1).channels["gyro"].values.shape == (7,)


# ---------------------------------------------------------------------------------------------------- the command

STRANGERS = """
import os, time
from insenv.core.estimate import Estimate
from test_check_plugin import KeepsItself, Mean

class Hangs(Mean):
    def update(self, state, chunk):
        while True:
            time.sleep(0.1)

class Dies(Mean):
    def update(self, state, chunk):
        os._exit(3)

class Peeks(Mean):
    def update(self, state, chunk):
        import insenv.systems.north_finder.env
        return super().update(state, chunk)

class Prints(KeepsItself):
    def update(self, block):
        print("busy")
        super().update(block)

    def estimate(self):
        known = super().estimate()
        return Estimate(("azimuth",), ("rad",), known.mean, known.cov)
"""


@pytest.fixture
def strangers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A module of plug-ins that a check can import in its own process; the runs are those that there are already."""
    monkeypatch.setattr("insenv.evaluate.check.plugin.trial", recorded)
    (tmp_path / "strangers_plugins.py").write_text(STRANGERS)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.syspath_prepend(str(Path(__file__).parent))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("Hangs", "it does not return within 2 s in update() on NorthFinder"),
        ("Dies", "it ended the process (exit status 3) in update() on NorthFinder"),
        ("Peeks", "it imports insenv.envs"),
    ],
)
@pytest.mark.usefixtures("strangers")
def test_what_would_end_the_check_is_told(name: str, sentence: str) -> None:
    # Imports alone may take long on a busy machine, and those of `Peeks` are within a call.
    limit = 60.0 if name == "Peeks" else 2.0
    found = check_plugin(f"strangers_plugins:{name}", ["NorthFinder"], limit)
    assert not found.kept and sentence in str(found)


@pytest.mark.slow
@pytest.mark.usefixtures("strangers")
def test_the_command_says_what_it_found(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    ended = run(capsys, monkeypatch, "check-plugin", "strangers_plugins:Prints", "--env", "NorthFinder")
    assert ended.status == 0
    assert "keeps its state in itself" in ended.out and ended.out.endswith("OK: it keeps the contract.\n")
    assert "busy" not in ended.out
    ended = run(capsys, monkeypatch, "check-plugin", "levelling", "--env", "NorthFinder")
    assert ended.status == 1 and "it tells level_c, level_s; asked for is azimuth [rad]" in ended.out
    ended = run(capsys, monkeypatch, "check-plugin", "two_position", "--env", "RateTable")
    assert ended.status == 1 and "no channel 'sight_heading'" in ended.out


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["north_glls"], "plug-in 'north_glls' is not installed; did you mean 'north_gls'"),
        (["no_such_module:X"], "cannot be imported"),
        (["json:loads"], "has neither estimate() nor act()"),
        (["north_gls", "--env", "Sea"], "environment 'Sea' given; there are NorthFinder"),
        (["north_gls", "--limit", "long"], "--limit"),
    ],
)
def test_bad_input_ends_in_one_sentence(
    options: list[str], sentence: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    ended: Ended = run(capsys, monkeypatch, "check-plugin", *options)
    assert ended.status == 2 and sentence in ended.err and ended.err.count("\n") == 1
