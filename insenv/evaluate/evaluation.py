"""Estimators under policies, on the same runs of one scenario, in processes of their own.

Runs under a policy that looks at no estimate are simulated once for all estimators (`insenv.evaluate.panel`). A plug-in
that raises, says NaN, ends its process or does not return is a fault, by name; the others go on: where a process is
lost, the estimators that are not to blame are played again. The errors are those of the runs' seeds alone: neither the
number of processes nor how the runs are shared out changes them.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.plugins import ESTIMATORS, POLICIES, find, names
from insenv.core.system import kinds, system
from insenv.evaluate.child import Child, Ended, Say
from insenv.evaluate.play import Answers, PlayedRuns, Work, play_on
from insenv.evaluate.remote import InProcess
from insenv.evaluate.runs import Table, task_of
from insenv.evaluate.scores import Paired, Scored, nees, paired, quantities, score
from insenv.scenario import load

#: Longest time of one step of a pair's runs [s].
LIMIT = 60.0
#: Runs that are played together, at least, where those of a policy are shared out to several processes.
_LEAST = 64
#: So many pieces for each process are as good as a number that divides evenly.
_FAIR = 4
_LOOK = 0.1


@dataclass(frozen=True)
class Evaluation:
    """What was found.

    Attributes
    ----------
    environment, scenario : str
    first, count : int
        Seeds of the runs.
    every : int
        Steps after which the estimators were asked.
    scored : tuple of Scored
        Policy by policy, in the order that was given.
    paired : tuple of Paired
        Each pair against the first that worked.
    errors : mapping of (estimator, policy) to mapping of str to ndarray
        Errors by quantity [SI], shape (R,); for figures.
    """

    environment: str
    scenario: str
    first: int
    count: int
    every: int
    scored: tuple[Scored, ...]
    paired: tuple[Paired, ...]
    errors: Mapping[tuple[str, str], Table]

    @property
    def faults(self) -> tuple[str, ...]:
        """Of the pairs that gave nothing."""
        return tuple(one.fault for one in self.scored if one.fault)


def evaluate(  # noqa: PLR0913 -- what is judged, and how the work is done
    environment: str,
    estimators: Sequence[str],
    policies: Sequence[str],
    seeds: range = range(400),
    scenario: str | None = None,
    jobs: int = 1,
    limit: float | None = LIMIT,
    every: int = 1,
    changes: Mapping[str, Any] | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Evaluation:
    """Play the runs ``seeds`` with every estimator under every policy.

    Parameters
    ----------
    environment : str
        Name of a system: "NorthFinder".
    estimators, policies : sequence of str
        Names of entry points, or "module:Name".
    seeds : range
    scenario : str, optional
        Name of a packaged scenario, or path.
    jobs : int
        Processes at a time.
    limit : float, optional
        Longest time of one step of all runs that are stepped together [s]. None: the plug-ins are trusted, and played
        in this process, one piece after the other.
    every : int
        Steps after which the estimators are asked; what a policy is told is the last estimate.
    changes : mapping, optional
        Other values of the scenario's entries.
    say : callable
        Told what is being done.

    Raises
    ------
    InputError
        If something that was named does not exist, the scenario is not one of the environment, or no pair works.
    """
    name = _scenario(environment, scenario, changes or {})
    pairs = _pairs(estimators, policies, limit)
    if len(seeds) < 2 or seeds.start < 0 or jobs < 1 or every < 1 or not (limit is None or limit > 0):
        raise InputError(
            f"{len(seeds)} seeds from {seeds.start}, {jobs} jobs, every = {every} and a limit of {limit} s given; "
            f"wanted two seeds or more, from 0, one job or more, every step or fewer, and a limit above zero"
        )
    jobs = jobs if limit is not None else 1
    text = json.dumps(dict(changes or {}))
    work = [
        Work(name, tuple(estimators), policy, int(some[0]), len(some), text, every, k == 0)
        for policy in policies
        for k, some in enumerate(np.array_split(np.array(seeds), _parts(len(policies), len(seeds), jobs)))
    ]
    answers = _worked(work, jobs, limit, say)
    found = {pair: _joined([each[pair] for each in answers if pair in each]) for pair in pairs}
    scored = tuple(_scored(pair, one) for pair, one in found.items())
    if all(one.fault for one in scored):
        raise InputError(scored[0].fault)
    played = {pair: one for pair, one in found.items() if isinstance(one, PlayedRuns)}
    errors = {pair: {q: one.table[f"error.{q}"] for q in quantities(one.table)} for pair, one in played.items()}
    return Evaluation(environment, name, seeds.start, len(seeds), every, scored, _compared(played), errors)


def _scenario(environment: str, scenario: str | None, changes: Mapping[str, Any]) -> str:
    asked = system(environment)
    name = asked.scenario if scenario is None else scenario
    loaded = load(name, changes)
    if loaded.task is not None and (its := kinds()[loaded.task.kind][0]) is not asked:
        raise InputError(f"{name}: a scenario of {its.name}; wanted one of {environment}")
    if not task_of(name, changes).quantities:
        raise InputError(f"{name}: its task asks for nothing that could be wrong; wanted one with a quantity to find")
    return name


def _pairs(estimators: Sequence[str], policies: Sequence[str], limit: float | None) -> list[tuple[str, str]]:
    for kind, some in (("estimator", estimators), ("policy", policies)):
        if not some or len(set(some)) < len(some):
            raise InputError(f"{kind} {', '.join(some) or 'none'} given; wanted one or more, each once")
    named = [(group, name) for group, some in ((ESTIMATORS, estimators), (POLICIES, policies)) for name in some]
    # What is not installed under a name is code that this process does not run, for it will hold errors and truths.
    code = tuple(
        (group, name) for group, name in named if limit is not None and name not in names(group) and ":" in name
    )
    for group, name in named:
        if (group, name) not in code and (limit is None or name not in names(group)):
            find(group, name)
    if code and (fault := Child("insenv.evaluate.host:found", code, limit or LIMIT).wait().fault):
        raise InputError(fault)
    return [(estimator, policy) for policy, estimator in product(policies, estimators)]


def _parts(policies: int, seeds: int, jobs: int) -> int:
    """How often the runs of a policy are divided: no process shall wait long, and each has some to play."""
    most = max(1, seeds // _LEAST)
    fair = (n for n in range(1, most + 1) if n * policies % jobs == 0 or n * policies >= _FAIR * jobs)
    return next(fair, most)


#: What was found, or a fault, by estimator and policy.
_Found = dict[tuple[str, str], PlayedRuns | str]


def _worked(work: Sequence[Work], jobs: int, limit: float | None, say: Callable[[str], None]) -> list[_Found]:
    """Every piece of work, some at a time; what failed in one is not begun in another."""
    stop, share, failed = threading.Event(), [0.0] * len(work), dict[tuple[str, str], str]()

    def one(k: int, piece: Work) -> _Found:
        def told(doing: str, done: float) -> None:
            share[k] = done
            if stop.is_set():
                raise KeyboardInterrupt

        found: _Found = {}
        waiting = [piece.estimators]
        while waiting and not stop.is_set():
            left = tuple(name for name in waiting.pop(0) if (name, piece.policy) not in failed)
            answers, again = _answered(replace(piece, estimators=left), limit, told) if left else ({}, [])
            waiting += again
            for name, answer in answers.items():
                found[name, piece.policy] = answer
                if isinstance(answer, str):
                    failed.setdefault((name, piece.policy), answer)
        share[k] = 1.0
        return found

    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(one, k, piece) for k, piece in enumerate(work)]
        try:
            left = set(futures)
            while left:
                _, left = wait(left, _LOOK, FIRST_COMPLETED)
                say(f"{sum(share) / len(work):4.0%} of {len(work)} parts, {len(work) - len(left)} done")
        except BaseException:
            stop.set()
            raise
    return [future.result() for future in futures]


def _answered(piece: Work, limit: float | None, told: Say) -> tuple[Answers, list[tuple[str, ...]]]:
    """What the runs of a piece gave, and estimators that are to be played again."""
    if limit is None:
        return play_on(InProcess(), piece, told), []
    ended = Child("insenv.evaluate.play:play", piece, limit).wait(lambda child: told(child.doing, child.share))
    return _blamed(ended, piece.estimators, piece.policy) if ended.fault else (ended.result, [])


def _blamed(ended: Ended, estimators: tuple[str, ...], policy: str) -> tuple[Answers, list[tuple[str, ...]]]:
    """Whose fault it is that a process came to no end of its own, and who is to be played again."""
    if not ended.doing:  # a sentence that names what it is about
        return dict.fromkeys(estimators, ended.fault), []
    named = next((name for name in estimators if f"estimator {name!r}" in ended.doing), None)
    if named is not None:
        rest = tuple(name for name in estimators if name != named)
        text = ended.fault.replace(f", estimator {named!r}", "")
        return {named: f"estimator {named!r} {text}"}, [rest] if rest else []
    if f"policy {policy!r}" in ended.doing:
        text = ended.fault.replace(f" of policy {policy!r}", "")
        return dict.fromkeys(estimators, f"policy {policy!r} {text}"), []
    if len(estimators) > 1:
        return {}, [(name,) for name in estimators]
    return {estimators[0]: f"policy {policy!r} with estimator {estimators[0]!r} {ended.fault}"}, []


def _joined(parts: Sequence[PlayedRuns | str]) -> PlayedRuns | str:
    """The parts of a pair in the order of their seeds, or what failed first."""
    played = []
    for part in parts:
        if isinstance(part, str):
            return part
        played.append(part)
    table = {name: np.concatenate([one.table[name] for one in played]) for name in played[0].table}
    cpu, own = sum(one.cpu for one in played), sum(one.cpu_estimator for one in played)
    return replace(played[0], table=table, cpu=cpu, cpu_estimator=own)


def _scored(pair: tuple[str, str], one: PlayedRuns | str) -> Scored:
    estimator, policy = pair
    if isinstance(one, str):
        return Scored(estimator, policy, fault=one)
    table, names = one.table, quantities(one.table)
    runs = len(table["seed"])
    return Scored(
        estimator,
        policy,
        runs,
        tuple(score(table, q, one.units[q], one.bounds.get(q)) for q in names),
        nees(table, names),
        float(table["time"].mean()),
        float(table["stopped"].mean()),
        one.cpu / runs,
        one.cpu_estimator / runs,
    )


def _compared(played: Mapping[tuple[str, str], PlayedRuns]) -> tuple[Paired, ...]:
    (first, base), *others = played.items()
    return tuple(
        paired(q, pair, one.table, first, base.table)
        for pair, one in others
        for q in quantities(base.table)
        if q in quantities(one.table)
    )
