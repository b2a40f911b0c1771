"""How often the loop was right and wrong on copies of a recording.

Intervals of 95 % are exact (Clopper and Pearson 1934).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from scipy.special import betaincinv

from insenv.identify.findings import Findings
from insenv.trust.copies import Base
from insenv.trust.trial import SIZES, Answer, Injection, Row, key

#: Standard deviations within which 95 % of honest estimates are.
WITHIN = 1.959964


@dataclass(frozen=True)
class Rate:
    """So many of so many."""

    count: int
    of: int

    @property
    def share(self) -> float:
        """From 0 to 1; NaN of none."""
        return self.count / self.of if self.of else float("nan")

    @cached_property
    def interval(self) -> tuple[float, float]:
        """The exact 95 % interval of the share."""
        k, n = self.count, self.of
        low = float(betaincinv(k, n - k + 1, 0.025)) if k else 0.0
        high = float(betaincinv(k + 1, n - k, 0.975)) if k < n else 1.0
        return low, high


@dataclass(frozen=True)
class Reliability:
    """What was named in copies of a target in which nothing is to be found.

    Attributes
    ----------
    target : str
    wrong : Rate
        Copies in which anything was named.
    sure : Rate
        Copies in which anything was that was told from the target's own noise.
    names : tuple of (str, Rate)
        Each name that came up, most often first.
    findings : tuple of (str, Rate)
        Each effect that was found in the recording: in how many copies it is named although it is not there.
    left : tuple of str
        Found in the recording and in its copies still: not counted.
    """

    target: str
    wrong: Rate
    sure: Rate
    names: tuple[tuple[str, Rate], ...]
    findings: tuple[tuple[str, Rate], ...]
    left: tuple[str, ...]


@dataclass(frozen=True)
class Size:
    """Copies with an effect of ``size`` smallest detectable amplitudes.

    Attributes
    ----------
    size : float
    found : Rate
        Copies in which anything was named.
    named : Rate
        Those in which the effect was, alone or among rivals that were not told apart.
    honest : Rate
        Of those in which it was added: those whose estimate is within 1.96 standard deviations of what was injected.
    """

    size: float
    found: Rate
    named: Rate
    honest: Rate


@dataclass(frozen=True)
class Completeness:
    """How injected effects were found: one effect on a target, or all of them together (``effect`` empty)."""

    target: str
    effect: str
    amplitude: float
    unit: str
    sizes: tuple[Size, ...]


@dataclass(frozen=True)
class Trust:
    """What the claims of the loop on one recording are worth.

    Attributes
    ----------
    findings : Findings
        Of the recording itself.
    copies, seed : int
    reliability : tuple of Reliability
        One per target.
    whole : Completeness
        Over all effects and targets.
    effects : tuple of Completeness
    """

    findings: Findings
    copies: int
    seed: int
    reliability: tuple[Reliability, ...]
    whole: Completeness
    effects: tuple[Completeness, ...]


def trust(found: Findings, given: Base, injected: Sequence[Injection], rows: Sequence[Row], seed: int) -> Trust:
    """The rates of all copies."""
    quiet = [row for row in rows if row.injection is None]
    loud = [row for row in rows if row.injection is not None]
    reliability = tuple(
        _reliability(t.target, tuple(map(key, t.added)), given.left[t.target], [row.answers[i] for row in quiet])
        for i, t in enumerate(found.targets)
    )
    effects = tuple(
        Completeness(
            one.target,
            one.effect,
            one.amplitude,
            one.unit,
            _sizes([r for r in loud if r.injection == i], injected, given),
        )
        for i, one in enumerate(injected)
    )
    whole = Completeness("", "", float("nan"), "", _sizes(loud, injected, given))
    return Trust(found, len(rows), seed, reliability, whole, effects)


def _reliability(target: str, found: tuple[str, ...], left: tuple[str, ...], answers: list[Answer]) -> Reliability:
    false = [frozenset(answer.added) - frozenset(left) for answer in answers]
    told = [names - frozenset(answer.beside_noise) for names, answer in zip(false, answers, strict=True)]
    names = {name: Rate(sum(name in one for one in false), len(false)) for name in sorted(frozenset().union(*false))}
    ordered = sorted(names.items(), key=lambda item: -item[1].count)
    own = tuple((name, names.get(name, Rate(0, len(false)))) for name in dict.fromkeys(found) if name not in left)
    wrong, sure = (Rate(sum(map(bool, each)), len(each)) for each in (false, told))
    return Reliability(target, wrong, sure, tuple(ordered), own, left)


def _sizes(rows: list[Row], injected: Sequence[Injection], given: Base) -> tuple[Size, ...]:
    return tuple(_size(size, [row for row in rows if row.size == size], injected, given) for size in SIZES)


def _size(size: float, rows: list[Row], injected: Sequence[Injection], given: Base) -> Size:
    def found(row: Row) -> bool:
        (answer,) = row.answers
        return bool(frozenset(answer.added) - frozenset(given.left[answer.target]))

    def named(row: Row) -> bool:
        (answer,) = row.answers
        return injected[row.injection or 0].effect in (*answer.added, *answer.rivals)

    told = [row for row in rows if row.answers[0].sd]
    return Size(size, _rate(found, rows), _rate(named, rows), _rate(_honest, told))


def _honest(row: Row) -> bool:
    (answer,) = row.answers
    assert answer.value is not None and answer.sd is not None
    return abs(answer.value - row.value) <= WITHIN * answer.sd


def _rate(true: Callable[[Row], bool], rows: Iterable[Row]) -> Rate:
    said = [true(row) for row in rows]
    return Rate(sum(said), len(said))
