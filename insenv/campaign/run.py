"""A campaign: the loop on the recording of each unit, then all units together.

Every effect that was tried on a target of a unit is a hypothesis, with the p-value of its own test, looks at its shapes
counted and those at other effects not: of all these the false discovery rate is held. An effect that is a discovery on
any unit has its coefficients told for all of them, where they have it and where they have not: then fitted beside all
else, at the shape (a time constant, say) that the others have.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from insenv.campaign.pool import FEWEST, Pool, discoveries, pool
from insenv.close import close, opened
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.identify.findings import Added, Estimate, Findings, TargetFindings

#: Names of lines and holds, which are no coefficients of an instrument's model.
NO_COEFFICIENT = ("tone", "sample_hold", "quantization", "saturation")


@dataclass(frozen=True)
class Discovery:
    """An effect on a target of a unit: p-value of its own test, and whether the unit's own search names it."""

    unit: int
    target: str
    effect: str
    p_value: float
    named: bool


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of all units that tell it.

    ``units`` are their indices, ``how`` says of each whether it is "declared", "named" by its own search or "fitted"
    beside all else; ``pool`` is None where they are fewer than three. ``outlying`` units are no part of it.
    """

    target: str
    effect: str
    parameter: str
    si_unit: str
    units: tuple[int, ...]
    how: tuple[str, ...]
    value: Floats
    sd: Floats
    pool: Pool | None
    outlying: tuple[int, ...] = ()

    @property
    def kept(self) -> list[int]:
        """Places of the units that the pool is of."""
        return [i for i, unit in enumerate(self.units) if unit not in self.outlying]


@dataclass(frozen=True)
class Outlier:
    """A unit that is further off than the others foretell, with the probability of that, all looks counted."""

    unit: int
    coefficient: Coefficient
    p_value: float


@dataclass(frozen=True)
class Campaign:
    """All units together.

    Attributes
    ----------
    units : tuple of str
    findings : tuple of Findings
    rate : float
        False discovery rate, and level of outliers.
    hypotheses : int
    found : tuple of Discovery
    doubted : tuple of Discovery
        Named by a unit's own search, and no discovery among all.
    coefficients : tuple of Coefficient
    outliers : tuple of Outlier
    """

    units: tuple[str, ...]
    findings: tuple[Findings, ...]
    rate: float
    hypotheses: int
    found: tuple[Discovery, ...]
    doubted: tuple[Discovery, ...]
    coefficients: tuple[Coefficient, ...]
    outliers: tuple[Outlier, ...]


def campaign(
    manifests: Sequence[str | Path],
    effects: Sequence[str] | None = None,
    alpha: float = 0.01,
    seed: int = 0,
    progress: Callable[[str], None] = lambda text: None,
    allow_code: bool = False,
) -> Campaign:
    """Close the loop on the recording of each of several units, and judge them together.

    Parameters
    ----------
    manifests : sequence of str or Path
        One for each unit, each as of `insenv.close.close`.
    effects, alpha, seed, progress, allow_code
        As of `insenv.close.close`; ``alpha`` is the false discovery rate too.

    Raises
    ------
    InputError
        If anything given cannot be used.
    """
    names = unit_names(manifests)

    def say(unit: str) -> Callable[[str], None]:
        return lambda text: progress(f"{unit}: {text}")

    for name, manifest in zip(names, manifests, strict=True):
        opened(manifest, say(name), allow_code)  # what cannot be used is refused before the work on the others
    found = [
        close(manifest, effects, alpha, seed, say(name), allow_code=allow_code)
        for name, manifest in zip(names, manifests, strict=True)
    ]
    return judged(names, found, alpha)


def unit_names(manifests: Sequence[str | Path]) -> tuple[str, ...]:
    """What units are called: the names of their files, with folders where those are alike.

    Raises
    ------
    InputError
        If a manifest is named twice.
    """
    if len({str(Path(m)) for m in manifests}) < len(manifests):
        twice = next(m for k, m in enumerate(manifests) if m in manifests[:k])
        raise InputError(f"{twice}: given twice; wanted one manifest for each unit")
    stems = [Path(m).stem for m in manifests]
    return tuple(
        s if stems.count(s) == 1 else str(Path(m).with_suffix("")) for s, m in zip(stems, manifests, strict=True)
    )


def judged(units: Sequence[str], findings: Sequence[Findings], rate: float) -> Campaign:
    """What was found on each of the ``units``, taken together."""
    tested = [one for k, found in enumerate(findings) for target in found.targets for one in _tested(k, target)]
    kept = discoveries(np.array([one.p_value for one in tested]), rate)
    found = sorted((one for one, is_one in zip(tested, kept, strict=True) if is_one), key=lambda d: d.p_value)
    doubted = tuple(one for one, is_one in zip(tested, kept, strict=True) if one.named and not is_one)
    told = _coefficients(findings, found)
    looks = sum(len(c.units) for c in told if c.pool is not None)
    parted = [_without_outliers(c, rate, looks) for c in told]
    outliers = sorted((o for _, off in parted for o in off), key=lambda o: o.p_value)
    return Campaign(
        tuple(units),
        tuple(findings),
        rate,
        len(tested),
        tuple(found),
        doubted,
        tuple(c for c, _ in parted),
        tuple(outliers),
    )


def _tested(unit: int, target: TargetFindings) -> list[Discovery]:
    """The hypotheses of a target: each effect once, by its best p-value without the looks at the others."""
    named = [a for a in target.added if not a.generic and not a.indirect]
    best: dict[str, tuple[float, bool]] = {_key(a): (a.p_value, True) for a in reversed(named)}
    for r in target.rejected:
        if r.effect not in best and not r.effect.startswith("spline_"):
            best[r.effect] = (r.p_value if r.reason == "not significant" else 1.0, False)
    # A p-value of a search counts every effect that was tried; one that reached 1 says nothing more.
    return [
        Discovery(unit, target.target, effect, p / len(best) if p < 1 else 1.0, by_itself)
        for effect, (p, by_itself) in best.items()
    ]


def _key(added: Added) -> str:
    return added.effect if added.order is None else f"{added.effect}:{added.order}"


def _coefficients(findings: Sequence[Findings], found: Sequence[Discovery]) -> list[Coefficient]:
    """Declared coefficients, and those of what was discovered on any unit."""
    rows: dict[tuple[str, str, str, str], list[tuple[int, str, Estimate]]] = defaultdict(list)
    wanted = list(dict.fromkeys((d.target, d.effect) for d in found if d.effect not in NO_COEFFICIENT))
    for unit, one in enumerate(findings):
        for target in one.targets:
            for estimate in target.estimates_after:
                rows[target.target, estimate.effect, estimate.parameter, estimate.unit].append(
                    (unit, "declared", estimate)
                )
    for name, effect in wanted:
        shape = _shape(findings, name, effect)
        for unit, one in enumerate(findings):
            for target in (t for t in one.targets if t.target == name):
                how, estimates = _of_unit(target, effect, shape)
                for estimate in estimates:
                    rows[name, effect, estimate.parameter, estimate.unit].append((unit, how, estimate))
    return [_coefficient(key, each) for key, each in rows.items() if len(each) > 1]


def _of_unit(target: TargetFindings, effect: str, shape: dict[str, float]) -> tuple[str, tuple[Estimate, ...]]:
    """How a unit tells the coefficients of an effect, and the coefficients."""
    own = next((a for a in target.added if _key(a) == effect), None)
    if own is not None:
        return "named", own.parameters
    return "fitted", target.beside(effect, shape)


def _shape(findings: Sequence[Findings], name: str, effect: str) -> dict[str, float]:
    """The shape that units have which name an effect: the median of each of its parameters."""
    values: dict[str, list[float]] = defaultdict(list)
    for one in findings:
        for target in one.targets:
            for added in target.added if target.target == name else ():
                for p in added.parameters if _key(added) == effect else ():
                    values[p.parameter].append(p.value)
    return {parameter: float(np.median(each)) for parameter, each in values.items()}


def _coefficient(key: tuple[str, str, str, str], each: list[tuple[int, str, Estimate]]) -> Coefficient:
    value, sd = np.array([e.value for *_, e in each]), np.array([e.sd for *_, e in each])
    units, how = tuple(unit for unit, *_ in each), tuple(how for _, how, _ in each)
    told = len(each) >= FEWEST and len(set(units)) == len(units) and bool(np.all(sd > 0) and np.isfinite(sd).all())
    return Coefficient(*key, units, how, value, sd, pool(value, sd) if told else None)


def _without_outliers(one: Coefficient, rate: float, looks: int) -> tuple[Coefficient, list[Outlier]]:
    """A coefficient whose population is without units that the others do not foretell, the furthest first."""
    found: list[Outlier] = []
    while one.pool is not None:
        kept = one.kept
        worst = int(np.argmin(one.pool.outlying))
        p_value = looks * float(one.pool.outlying[worst])
        if p_value >= rate:
            break
        out = (*one.outlying, one.units[kept[worst]])
        rest = [i for i in kept if i != kept[worst]]
        one = replace(one, outlying=out, pool=pool(one.value[rest], one.sd[rest]))
        found.append(Outlier(out[-1], one, p_value))
    return one, [replace(o, coefficient=one) for o in found]
