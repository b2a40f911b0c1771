"""Estimates as text: a parameter with its standard deviation, and the parameters before and after."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from insenv.core.quantities import ShownUnit, instability_unit, number, unit_for, with_sd
from insenv.core.series.allan import FLICKER
from insenv.core.units import ARCSEC, DEG
from insenv.identify.findings import Added, Estimate, TargetFindings

#: A found curve with more coefficients than this is shown by their range: one by one they say nothing.
_MOST_SHOWN = 4

#: What a derived quantity is.
_DERIVED = {"azimuth": "Azimuth of the input axis at table angle 0"}

#: Stands for an estimate that one of the two models does not have, and what that means.
NONE = "—"
NONE_MEANS = f"{NONE}: that model has no estimate of its own, because another of its effects looks just like it."


@dataclass(frozen=True)
class EstimatePair:
    """An estimate before and after as text, in one ``unit``; ``large`` marks a shift beyond three sigma."""

    effect: str
    parameter: str
    unit: str
    before: str
    after: str
    shift: str
    large: bool

    @property
    def stated(self) -> str:
        """The estimate where nothing was added: as sure as parts of the recording, held-out rows and noise bear out."""
        return self.before if self.after == NONE else self.after


def value(estimate: Estimate) -> str:
    """``value ± sd`` with the unit that suits it; the azimuth's deviation in arcsec too where it is small."""
    if estimate.parameter == "azimuth" and estimate.sd < 0.5 * DEG:
        shown = with_sd(estimate.value / DEG, estimate.sd / DEG)
        return f"{shown} deg (± {number(estimate.sd / ARCSEC, 2)} arcsec)"
    return _unit(estimate, estimate).show_with_sd(estimate.value, estimate.sd)


def parameters(added: Added) -> str:
    """The parameters of a found effect; the coefficients of a curve without a cause by their range."""
    if added.generic and len(added.parameters) > _MOST_SHOWN:
        each = [p.value for p in added.parameters]
        unit = unit_for(added.parameters[0].unit, *each)
        return f"{len(each)} coefficients from {unit.number(min(each))} to {unit.show(max(each))}"
    return ", ".join(f"{p.parameter} = {value(p)}" for p in added.parameters)


def pairs(before: Sequence[Estimate], after: Sequence[Estimate]) -> list[EstimatePair]:
    """Every parameter of either model: those before in their order, then those that only came after."""
    first, later = ({(e.effect, e.parameter): e for e in side} for side in (before, after))
    return [_pair(first.get(key), later.get(key)) for key in dict.fromkeys((*first, *later))]


def derived(target: TargetFindings) -> list[str]:
    """The quantities that follow from the parameters, a sentence each; before and after where something was added."""
    said = []
    for one in target.derived:
        what = _DERIVED.get(one.name, one.name)
        first, last = value(one.before), value(one.after)
        said.append(f"{what}: {first} before, {last} after." if target.added else f"{what}: {first}.")
    return said


def _pair(before: Estimate | None, after: Estimate | None) -> EstimatePair:
    known = [e for e in (before, after) if e is not None]
    unit = _unit(*known)
    shown = [NONE if e is None else with_sd(unit.of(e.value), unit.of(e.sd)) for e in (before, after)]
    moved = shift(before, after)
    return EstimatePair(
        effect=known[0].effect,
        parameter=known[0].parameter,
        unit=unit.label,
        before=shown[0],
        after=shown[1],
        shift=(f"{moved:+.1f}" if abs(moved) >= 0.05 else "0.0") if abs(moved) < 1e4 else NONE,
        large=abs(moved) > 3,
    )


def shift(before: Estimate | None, after: Estimate | None) -> float:
    """By how many of its own standard deviations the first answer was off; NaN where that cannot be said."""
    if before is None or after is None or not before.sd > 0:
        return math.nan
    return (after.value - before.value) / before.sd


def _unit(*estimates: Estimate) -> ShownUnit:
    """The unit that suits all of ``estimates``, which share an SI unit."""
    if estimates[0].effect == FLICKER:
        return instability_unit(estimates[0].unit)
    return unit_for(estimates[0].unit, *(x for e in estimates for x in (e.value, e.sd)))
