"""Closing the loop on copies of a recording: a function of seeds, so that a sweep works it off and resumes it.

Even seeds are copies in which nothing is to be found. The odd ones have an effect, each of those that were tried and
not found in its turn, at each of `SIZES` times the smallest amplitude that the loop said it would find.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.close import close_on
from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.effects.base import Effect
from insenv.effects.catalogue import by_key, plug_in_of
from insenv.identify.findings import Added, Findings, TargetFindings
from insenv.identify.fit.problem import NOISE_TERMS
from insenv.sweep import Table
from insenv.trust.copies import Base, with_effect, without_effects
from insenv.trust.screen import Screen

#: In the place of a verdict, where a copy was not closed: nothing in it comes near to being significant.
SCREENED = "not-closed"
#: Sizes of injected effects, in smallest detectable amplitudes.
SIZES = (0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True)
class Injection:
    """An effect that the recording would show: of ``amplitude`` [``unit``] at the ``shape`` is the smallest.

    ``plug_in`` says where one of another author is from: a process of its own has not loaded it yet.
    """

    target: str
    effect: str
    parameter: str
    amplitude: float
    unit: str
    shape: tuple[float, ...]
    plug_in: str = ""

    def theta(self, size: float, rng: np.random.Generator) -> tuple[Effect, Floats]:
        """The effect and its parameters, for ``size`` times the smallest amplitude, of a sign that it may have."""
        effect = by_key(self.effect, self.plug_in)
        direction = rng.standard_normal(len(effect.linear))
        direction = np.where([p.low >= 0 for p in effect.linear], np.abs(direction), direction)
        values = size * self.amplitude * direction / np.linalg.norm(direction)
        return effect, np.array([*values, *self.shape])


@dataclass(frozen=True)
class Answer:
    """What the loop said of one target of a copy.

    Attributes
    ----------
    target, verdict : str
    added : tuple of str
        Keys of the effects.
    rivals : tuple of str
        Keys of those that one of them was not told from.
    value, sd : float, optional
        Of the injected parameter, where its effect was named.
    beside_noise : tuple of str
        Keys of the effects that were not told from the target's own noise: one of a set with it.
    """

    target: str
    verdict: str
    added: tuple[str, ...]
    rivals: tuple[str, ...] = ()
    value: float | None = None
    sd: float | None = None
    beside_noise: tuple[str, ...] = ()

    @property
    def quiet(self) -> bool:
        """Whether it named nothing."""
        return not self.added


@dataclass(frozen=True)
class Row:
    """One copy: what was injected, if anything was, and the answers."""

    injection: int | None
    size: float
    value: float
    answers: tuple[Answer, ...]


@dataclass(frozen=True)
class Trials:
    """The job of a sweep; ``screen`` says of which copies the loop would name nothing, if it is there."""

    given: Base
    injections: tuple[Injection, ...]
    alpha: float
    seed: int
    screen: Screen | None = None

    def __call__(self, seeds: Sequence[int]) -> Table:
        """A row for each copy: its JSON."""
        return {"copy": np.array([json.dumps(_plain(self.row(seed))) for seed in seeds])}

    def row(self, number: int) -> Row:
        """Copy ``number``."""
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(number,)))
        if number % 2 == 0 or not self.injections:
            copy = without_effects(self.given, rng)
            if self.screen is not None and self.screen.quiet(copy):
                return Row(None, 0.0, 0.0, (Answer(self.screen.target, SCREENED, ()),))
            return Row(None, 0.0, 0.0, tuple(_answer(t) for t in self._closed(copy, None).targets))
        index, size = self._turn(number // 2)
        injection = self.injections[index]
        effect, theta = injection.theta(size, rng)
        copy = with_effect(self.given, injection.target, effect, theta)
        if self.screen is not None and self.screen.sees(effect.id) and self.screen.quiet(copy):
            answer = Answer(injection.target, SCREENED, ())
        else:
            answer = _answer(self._closed(copy, injection.target).targets[0], injection)
        linear = theta[: len(effect.linear)]
        value = float(linear[0]) if len(linear) == 1 else float(np.linalg.norm(linear))
        return Row(index, size, value, (answer,))

    def _turn(self, count: int) -> tuple[int, float]:
        """Whose turn it is: all effects at all sizes in an order by chance, and then again."""
        each = len(self.injections) * len(SIZES)
        again, place = divmod(count, each)
        order = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(2**31, again))).permutation(each)
        index, size = divmod(int(order[place]), len(SIZES))
        return index, SIZES[size]

    def _closed(self, recordings: tuple[Recording, ...], target: str | None) -> Findings:
        read = self.given.manifest
        if target is not None:
            read = replace(read, model=replace(read.model, targets=(target,)))
        return close_on(read, recordings, None, self.alpha, self.seed)


def injections(found: Findings) -> tuple[Injection, ...]:
    """The effects that were tried on a recording and not found, and whose smallest size was said."""
    return tuple(
        Injection(
            t.target,
            r.effect,
            least.name,
            least.value,
            least.unit,
            tuple(x for x, _ in least.at.values()),
            plug_in_of(effect),
        )
        for t in found.targets
        for r in t.rejected
        if (least := r.smallest_detectable) is not None and not (effect := by_key(r.effect)).generic
    )


def key(added: Added) -> str:
    """Of an effect that was added."""
    return added.effect if added.order is None else f"{added.effect}:{added.order}"


def _answer(target: TargetFindings, injection: Injection | None = None) -> Answer:
    rivals = (name for one in target.added for name in (*one.confounded_with, *one.same_curve))
    noise = {term.id for term in NOISE_TERMS}
    unsure = tuple(key(one) for one in target.added if not noise.isdisjoint(one.confounded_with))
    names = tuple(map(key, target.added))
    answer = Answer(target.target, target.verdict, names, tuple(dict.fromkeys(rivals)), beside_noise=unsure)
    if injection is None:
        return answer
    own = (p for one in target.added if key(one) == injection.effect for p in one.parameters)
    named = next((p for p in own if p.parameter == injection.parameter), None)
    return answer if named is None else replace(answer, value=named.value, sd=named.sd)


def _plain(row: Row) -> dict[str, object]:
    return {
        "injection": row.injection,
        "size": row.size,
        "value": row.value,
        "answers": [[a.target, a.verdict, a.added, a.rivals, a.value, a.sd, a.beside_noise] for a in row.answers],
    }


def read_row(text: str) -> Row:
    """A row as a store has it.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        plain = json.loads(text)
        answers = (
            Answer(t, v, tuple(a), tuple(r), x, sd, *map(tuple, more)) for t, v, a, r, x, sd, *more in plain["answers"]
        )
        return Row(plain["injection"], plain["size"], plain["value"], tuple(answers))
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{text[:40]!r} is no copy of a recording; wanted a store of insenv trust") from None
