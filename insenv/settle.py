"""Settling a confounded recording in its environment: play, trace, run the experiment that is proposed, trace all.

Every run is one of the same instrument, with its truths, on its own clock; the runs are one recording to the loop. It
ends when nothing is confounded, when the instrument time is spent, or when no procedure is left that can be played.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from insenv.calibration import calibration
from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Recording
from insenv.core.system import kinds, part
from insenv.core.units import quantity
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.effects.rate.scale import ScaleFactor
from insenv.envs.belief import judge
from insenv.envs.follow import Follow, commanded, profile_actions
from insenv.envs.recorder import Played, save_runs
from insenv.envs.rollout import roll_out
from insenv.envs.task import Task
from insenv.identify.findings import Findings, NextExperiment
from insenv.identify.story import Chapter, Ending, FirstRun, Story, Wanted
from insenv.scenario import Scenario, check_task, load
from insenv.scenario.same import SameInstrument

#: Instrument time that may be spent where nobody says: so many times that of the first run.
BUDGET = 10.0
#: A procedure that promises fewer standard deviations is not worth the time, and one is played so often at most.
LEAST_SIGMA, MOST_TIMES = 2.0, 2
#: Distance of the seeds of the noise of one run and the next.
_SEEDS = 1_000_003

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Experiment:
    """What is done next: a profile and other changes of the scenario, and why."""

    words: str
    profile: Mapping[str, Any] | None = None
    changes: Mapping[str, Any] | None = None
    separates: tuple[str, ...] = ()
    sigma: float | None = None


@dataclass(frozen=True)
class Stage:
    """An instrument in its environment; ``changes`` are those of the caller."""

    scenario: str
    changes: Mapping[str, Any]
    seed: int

    def play(self, experiment: Experiment, number: int, say: Progress) -> tuple[Task, Played]:
        """One run: its task and what was recorded."""
        base, changes = _split(experiment.changes or {})
        given = dict(self.changes) | changes
        if experiment.profile is not None:
            given["profile"] = dict(experiment.profile)
        made = _made(self.scenario, given, self.seed, base)
        actions = profile_actions(made[0], made[1])
        noise = self.seed + number * _SEEDS

        def told(done: int, total: int) -> None:
            say(f"run {number + 1}: {done / total:4.0%} of {made[1].steps * made[1].step_s:g} s")

        runs = roll_out(made[1], Follow(actions), seeds=(noise,), progress=told)
        recording = replace(runs.recording(0), label=f"run {number + 1}")
        return made[1], Played(recording, tuple(commanded(made[1], actions)), base)

    def title(self) -> str:
        """Of the scenario, as it is written."""
        return load(self.scenario, self.changes).table.output.title or ""

    def truth(self, task: Task) -> Mapping[str, Any]:
        """True values of the instrument."""
        return task.world.truth(task.world.cast((self.seed,)), 1)


def settle(
    scenario: str | Path,
    budget: float | None = None,
    seed: int = 0,
    estimator: str | None = None,
    alpha: float = 0.01,
    changes: Mapping[str, Any] | None = None,
    progress: Progress = lambda text: None,
) -> Story:
    """Play a scenario in its environment, and settle what the loop cannot tell from its first run.

    Parameters
    ----------
    scenario : str or Path
        Of a scenario with a [task] and a [profile], or a packaged one.
    budget : float, optional
        Instrument time of all runs [s]; `BUDGET` times that of the first.
    seed : int
        Of the instrument's truths, and the first run's noise.
    estimator : str, optional
        Plug-in that finds the quantity; the usual one of the task.
    alpha : float
        Probability of a false discovery, per target and step.
    changes : mapping of str to object, optional
        Of the scenario: ``{"undeclared": {}}``.
    progress : callable
        Told what is being done.

    Raises
    ------
    InputError
        If anything given cannot be used, or the budget does not hold the first run.
    """
    if seed < 0:
        raise InputError(f"seed = {seed}; wanted zero or more")
    first = load(scenario, changes)
    asked = check_task(first)
    name = estimator or kinds()[asked.kind][1].estimator
    find(ESTIMATORS, name)
    stage = Stage(str(scenario), dict(changes or {}), seed)
    most = BUDGET * first.duration if budget is None else budget
    if not most >= first.duration:
        raise InputError(f"a budget of {most:g} s given; the first run of {first.path} takes {first.duration:g} s")
    table = first.table.profile
    profile = {} if table is None else {n: v for n in table.__struct_fields__ if (v := getattr(table, n)) is not None}
    return _played(stage, Experiment("the scenario's own procedure", profile or None), name, (most, alpha), progress)


def _played(stage: Stage, experiment: Experiment, estimator: str, limits: tuple[float, float], say: Progress) -> Story:
    """Experiment after experiment."""
    budget, alpha = limits
    runs: list[Played] = []
    chapters: list[Chapter] = []
    done: list[Experiment] = []
    first: Task | None = None
    while True:
        task, run = stage.play(experiment, len(runs), say)
        first = first or task
        runs.append(run)
        done.append(experiment)
        with TemporaryDirectory() as folder:
            manifest = save_runs(folder, first, runs)
            found = close(manifest, None, alpha, stage.seed, say, first.datasheet.limits)
            read = load_manifest(manifest)
            (saved, *_) = read_recordings(read)
            mended = _mended(runs[0].recording, calibration(found, read).found().apply(saved))
        truth = stage.truth(first)
        say(f"what {estimator} makes of it")
        elapsed = sum(_length(r.recording) for r in runs)
        chapters.append(
            Chapter(
                experiment.words,
                experiment.separates,
                experiment.sigma,
                dict(experiment.profile or {}),
                dict(experiment.changes or {}),
                _length(run.recording),
                elapsed,
                found,
                _answer(first, estimator, mended, truth),
                _own(first, found, truth),
            )
        )
        ending, following = _next(found, done, budget - elapsed)
        if following is None:
            break
        experiment = following
    raw = _answer(first, estimator, runs[0].recording, truth)
    return Story(
        stage.scenario, stage.title(), stage.seed, budget, _wanted(first, estimator), raw, tuple(chapters), ending
    )


def _next(found: Findings, done: Sequence[Experiment], left: float) -> tuple[Ending, Experiment | None]:
    """The experiment that separates most, or how the story ends."""
    sets = {
        frozenset((a.effect if a.order is None else f"{a.effect}:{a.order}", *a.confounded_with))
        for target in found.targets
        for a in target.added
        if a.confounded_with
    }
    if found.verdict != "confounded":
        return "settled", None
    proposed = [
        one
        for target in found.targets
        if target.verdict == "confounded"
        for one in target.next_experiment
        if one.profile is not None
        and (one.expected_separation_sigma or 0.0) >= LEAST_SIGMA
        and any(set(one.separates) <= keys for keys in sets)
    ]
    proposed.sort(key=lambda one: -(one.expected_separation_sigma or 0.0))
    told = [_experiment(one) for one in proposed]
    again = [(e.profile, e.changes) for e in done]
    fresh = [e for e in told if again.count((e.profile, e.changes)) < MOST_TIMES]
    if not fresh:
        return "no-procedure", None
    affordable = [e for e in fresh if _time(e) <= left * (1 + 1e-9)]
    return ("settled", affordable[0]) if affordable else ("budget", None)


def _experiment(one: NextExperiment) -> Experiment:
    return Experiment(one.procedure, one.profile, one.changes, one.separates, one.expected_separation_sigma)


def _time(experiment: Experiment) -> float:
    return quantity((experiment.changes or {})["duration"], "time", "duration of the next experiment")


def _split(changes: Mapping[str, Any]) -> tuple[float, dict[str, Any]]:
    """The angle that the base is turned by [rad], and what a scenario knows."""
    rest = {key: value for key, value in changes.items() if key != "base_turned"}
    turned = changes.get("base_turned")
    return (0.0 if turned is None else quantity(turned, "angle", "base_turned")), rest


def _made(scenario: str, changes: dict[str, Any], seed: int, base: float) -> tuple[Scenario, Task]:
    """Scenario and task of one run, its duration a whole number of steps."""
    if "duration" in changes:
        step = quantity(_step(scenario, changes), "time", "task.step")
        steps = ceil(quantity(changes["duration"], "time", "duration") / step - 1e-6)
        changes = changes | {"duration": f"{steps * step:.12g} s"}
    played = load(scenario, changes)
    same = SameInstrument.of(played, seed, base)
    task: Task = part(kinds()[check_task(played).kind][0].task)(scenario, changes)
    world: Any = task.world
    return same, replace(task, world=replace(world, scenario=same))


def _step(scenario: str, changes: Mapping[str, Any]) -> str:
    table = load(scenario, {k: v for k, v in changes.items() if k not in ("duration", "profile", "temperature")}).table
    assert table.task is not None
    return table.task.step


def _mended(recording: Recording, clean: Recording) -> Recording:
    """The first run, with what was found taken out of the channels that were saved of it."""
    kept = {name: clean.channels[name] for name in recording.channels if name in clean.channels}
    return replace(recording, channels={**recording.channels, **kept})


def _answer(task: Task, estimator: str, recording: Recording, truth: Mapping[str, Any]) -> FirstRun | None:
    """Error and standard deviation of the quantity on one run."""
    if not task.quantities:
        return None
    wanted = task.quantities[0]
    watched = judge(estimator, task.datasheet, task.quantities[:1])
    state = watched.begin(1)
    for start in range(0, len(recording), task.samples):
        rows = slice(start, start + task.samples)
        channels = {n: replace(c, values=c.values[None, rows]) for n, c in recording.channels.items()}
        state = watched.update(state, replace(recording, t=recording.t[rows], channels=channels))
    means, deviations = watched.belief(watched.estimate(state, 1))
    error = wanted.error(means[:, 0], np.asarray(truth[wanted.name]))
    return FirstRun(float(error[0]), float(deviations[0, 0]))


def _own(task: Task, found: Findings, truth: Mapping[str, Any]) -> FirstRun | None:
    """The same quantity where the loop tells it, from all runs together."""
    if not task.quantities:
        return None
    wanted = task.quantities[0]
    for target in found.targets:
        for one in target.derived:
            if one.name == wanted.name:
                error = wanted.error(np.array([one.after.value]), np.asarray(truth[wanted.name]))
                return FirstRun(float(error[0]), one.after.sd)
    return None


def _wanted(task: Task, estimator: str) -> Wanted | None:
    if not task.quantities:
        return None
    one = task.quantities[0]
    return Wanted(one.name, "1" if one.name == ScaleFactor.id else "rad", one.demanded, estimator)


def _length(recording: Recording) -> float:
    return float(len(recording) * recording.dt)
