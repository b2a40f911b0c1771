"""What was found, as running text: an effect by where it sits, effects of one kind together.

"tones at 29.93 and 9.19 Hz", "two steps of the bias (at 2214 and 2537 s)", "scale-factor asymmetry".
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from insenv.core.quantities import decimals, last_digit, p_value, percent, unit_for
from insenv.effects.bias import BiasStep
from insenv.effects.rate.scale import ScaleFactorAnomaly
from insenv.effects.tone import Tone
from insenv.identify.findings import BY_SIGNS, Added, Estimate, TargetFindings
from insenv.report.words import key_of, listing, name

#: Effect id -> the parameter that says where it sits, and its name with that place, for one and for several.
_PLACED = {
    Tone.id: ("f", "a tone at {at}", "tones at {at}"),
    BiasStep.id: ("t0", "a step of the bias at {at}", "{count} steps of the bias (at {at})"),
    ScaleFactorAnomaly.id: (
        "u0", "a local scale-factor anomaly near {at}", "{count} local scale-factor anomalies (near {at})",
    ),
}  # fmt: skip

_COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def kinds(added: Iterable[Added]) -> list[tuple[Added, ...]]:
    """Found effects with those of the same key together, in the order of the first of each."""
    groups: dict[str, list[Added]] = {}
    for one in added:
        groups.setdefault(key_of(one), []).append(one)
    return [tuple(group) for group in groups.values()]


def title(alike: Sequence[Added]) -> str:
    """Name in running text of effects that share a key."""
    if alike[0].effect == "saturation":
        return f"saturation at {_at([p for added in alike for p in added.parameters])}"
    parameter, one, several = _PLACED.get(alike[0].effect, ("", "", ""))
    places = [p for added in alike for p in added.parameters if p.parameter == parameter]
    if places and len(places) == len(alike):
        return (one if len(alike) == 1 else several).format(at=_at(places), count=count(len(alike)))
    times = {1: "", 2: " (twice)"}.get(len(alike), f" ({count(len(alike))} times)")
    return name(key_of(alike[0])) + times


def listed(added: Iterable[Added]) -> str:
    """Found effects as in a sentence."""
    return listing(title(kind) for kind in kinds(added))


def chances(added: Sequence[Added]) -> list[str]:
    """How probably noise alone would imitate each effect; one sentence for those of the same probability."""
    same: dict[str, list[Added]] = {}
    for one in added:
        same.setdefault(p_value(one.p_value), []).append(one)
    said = []
    for p, group in same.items():
        what, each = listed(group), "" if len(group) == 1 else ", each"
        said.append(f"{what[:1].upper()}{what[1:]}: chance of seeing this from noise alone{each}: p {p}.")
    return said


def evidence(one: Added) -> str:
    """The probability of a finding with looks counted, and by signs beside it: "= 0.002 (by signs 0.004)"."""
    error = one.whole()
    if error is None:
        return p_value(one.p_value)
    sign = "≤ " if error.least else ""
    return f"{p_value(one.p_value)} (by signs {sign}{error.p:.2g})"


def disagreements(added: Sequence[Added], reasons: Sequence[str]) -> list[str]:
    """A sentence for each finding that the same search makes in noise more often than its p-value says.

    None where that is a reason of the verdict, which says it.
    """
    if any(BY_SIGNS in reason for reason in reasons):
        return []
    said = []
    for one in added:
        error = one.whole()
        if error is not None and not error.agrees:
            what = title([one])
            said.append(
                f"{what[:1].upper()}{what[1:]}: with signs by chance the search finds as much in the residual in "
                f"{percent(error.p)} of {error.draws} draws, more often than p {p_value(one.p_value)} says; "
                "take the larger."
            )
    return said


def together(one: Added, added: Sequence[Added]) -> str:
    """A note where the held-out error of ``one`` is that of several taken out at once, else nothing."""
    both = (one.held_out_before, one.held_out_after)
    alike = [a for a in added if a.effect == one.effect and (a.held_out_before, a.held_out_after) == both]
    return {1: "", 2: " (both together)"}.get(len(alike), f" (all {count(len(alike))} together)")


def count(number: int) -> str:
    """A small number as a word."""
    return _COUNTS[number] if number < len(_COUNTS) else str(number)


def _at(places: Sequence[Estimate]) -> str:
    """Values in one unit, each to three digits or more but not beyond what its sd supports."""
    unit = unit_for(places[0].unit, *(p.value for p in places))
    values = [unit.of(p.value) for p in places]
    common = decimals(max(values, key=abs), 4)
    shown = []
    for value, place in zip(values, places, strict=True):
        sd = unit.of(place.sd)
        supported = -last_digit(sd) if sd > 0 and math.isfinite(sd) else common
        shown.append(f"{value:.{max(0, min(max(common, decimals(value, 3)), supported))}f}")
    return f"{listing(shown)} {unit.label}".rstrip()


def as_before(target: TargetFindings, targets: Sequence[TargetFindings]) -> str:
    """The first target that shares its one measurement with this one, if it is another: what is left is the same."""
    for other in targets:
        if other is target:
            return ""
        pairs = ((getattr(one.traces, name) for one in (target, other)) for name in ("t", "before", "after"))
        if other.held_out == target.held_out and all(np.array_equal(a, b) for a, b in pairs):
            return other.target
    return ""
