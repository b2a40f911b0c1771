"""The verdict in sentences that the text and the HTML report share."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import groupby

from insenv.core.quantities import ShownUnit, number, p_value, percent, span, unit_for
from insenv.core.series.allan import FLICKER, WALK
from insenv.effects.bias import Bias
from insenv.effects.tone import Tone
from insenv.identify.findings import (
    Added,
    Findings,
    HeldOut,
    NotTestable,
    Rejected,
    RejectedRows,
    TargetFindings,
)
from insenv.report import estimates, formula
from insenv.report.found import chances, disagreements, listed
from insenv.report.words import key_of, listing, name, names, noise_name

#: Share by which lines alone must lower the held-out error of means to be worth more than a word.
_GAIN = 0.02
#: Bursts that are told one by one.
_BURSTS = 4
#: Noise that wanders, and from how many deviations on it is told.
WANDERING, WANDERS = (FLICKER, WALK), 2.0
#: Excess of the held-out error over the noise floor from which it is worth a sentence.
_EXCESS = 1.05


def headline(target: TargetFindings, who: str = "") -> str:
    """The verdict on one target (or on ``who``, targets alike) in one or two plain sentences."""
    who = who or target.target
    found = listed(target.added)
    if target.verdict == "effects-found" and lines_only(target):
        return f"Nothing but {found} is missing from the declared model of {who}, and the means are as good without."
    return {
        "effects-found": f"The declared model of {who} lacked {found}.",
        "effects-found-incomplete": f"The declared model of {who} lacked {found}, and something is still unexplained.",
        "confounded": _ambiguous(target, who),
        "generic-only": f"The declared model of {who} lacks something that no physical effect explains; "
        f"what describes it is generic: {found or 'a smooth curve'}.",
        "unexplained-structure": f"The residual of {who} is not noise, and no effect explains it.",
        "nothing-significant": f"Nothing significant is missing from the declared model of {who}.",
    }.get(target.verdict, f"{who}: {target.verdict}.")


def _ambiguous(target: TargetFindings, who: str) -> str:
    sets = rival_sets(target)
    told = "; and ".join(listing(rivals(target, keys), "or") for keys in sets)
    within = {key for keys in sets for key in keys}
    sure = [one for one in target.added if key_of(one) not in within]
    if sure:
        lacked = f"The declared model of {who} lacked {listed(sure)}"
        return f"{lacked}, and something else that this recording cannot tell: {told}."
    return f"The declared model of {who} lacks something, and this recording cannot tell what: {told}."


def rivals(target: TargetFindings, keys: Sequence[str]) -> list[str]:
    """Names of a set's members; a bias that was declared for all runs together can only be another in each of them."""
    declared = {e.effect for e in target.estimates_before}
    anew = [key for key in keys if key in declared and key == Bias.id]
    return names(key for key in keys if key not in anew) + [f"{name(key)} of each run" for key in anew]


def overall(findings: Findings) -> str:
    """The verdicts on all targets, one sentence for targets that share one."""
    alike: dict[str, list[TargetFindings]] = {}
    for target in findings.targets:
        alike.setdefault(headline(target, "\0"), []).append(target)
    verdicts = [headline(group[0], listing(t.target for t in group)) for group in alike.values()]
    return " ".join([*verdicts, *bursts(findings)])


def lines_only(target: TargetFindings) -> bool:
    """Whether nothing but lines was found, and held-out means are no better for it."""
    held_out = target.held_out
    return all(a.effect == Tone.id for a in target.added) and held_out.after > (1 - _GAIN) * held_out.before


def bursts(findings: Findings) -> list[str]:
    """What was left out as an event, on several channels together: rows and size."""
    units = {target.target: target.unit for target in findings.targets}
    events: list[list[RejectedRows]] = []
    for one in sorted((r for r in findings.rows_rejected if r.cause == "burst"), key=lambda r: (r.run, r.start)):
        last = events[-1] if events else []
        if last and last[0].run == one.run and one.start < max(r.stop for r in last):
            last.append(one)
        else:
            events.append([one])
    said = []
    for event in events[:_BURSTS]:
        rows = f"rows {min(r.start for r in event)} to {max(r.stop for r in event) - 1}"
        run = f" of run {event[0].run + 1}" if len(findings.runs) > 1 else ""
        sizes = [
            f"{unit_for(units[r.target], r.size).show(r.size, 2)} on {r.target}" if r.size else f"on {r.target}"
            for r in event
        ]
        said.append(f"{event[0].reason} in {rows}{run} ({', '.join(dict.fromkeys(sizes))})")
    if not said:
        return []
    more = f", and {len(events) - _BURSTS} more" if len(events) > _BURSTS else ""
    return [f"Left out as events, not laws: {'; '.join(said)}{more}."]


def cautions(findings: Findings) -> list[str]:
    """What stands in doubt, each once, with the targets where it is not of all."""
    of: dict[str, list[str]] = {}
    for target in findings.targets:
        for caution in target.cautions:
            of.setdefault(caution, []).append(target.target)
    every = len(findings.targets)
    return [text if len(names) == every else f"{listing(names)}: {text}" for text, names in of.items()]


def sureness(target: TargetFindings, alpha: float) -> list[str]:
    """How sure the verdict is: sentences with the figures that stand behind it, and what would settle it."""
    said = [
        *chances(target.added),
        *disagreements(target.added, target.reasons),
        *map(_sentence, target.reasons),
        _outcome(target),
        *formula.sentences(target),
    ]
    if target.verdict == "nothing-significant":
        said.append(
            f"A false alarm of the whole search was allowed in {percent(alpha)} of recordings; "
            "an effect too weak for this recording, or not testable with it, would not show."
        )
        said += _wandering(target)
    if target.verdict == "effects-found-incomplete":
        said += _excess(target.held_out)
    return said + _settling(target)


def _wandering(target: TargetFindings) -> list[str]:
    """That noise of which nobody said how much there is may hide a cause, where it wanders beyond doubt."""
    slow = [n for n in target.noise if n.effect in WANDERING and n.value > WANDERS * n.sd]
    if not slow or target.spectra.allan_declared is not None:
        return []
    names = listing([f"{noise_name(n.effect, target.unit)} of {estimates.value(n)}" for n in slow])
    return [
        f"What is left wanders, and is taken for the instrument's own {names}, for no [noise] says how much it has: a "
        "cause that was not recorded and changes as slowly would not show either."
    ]


def _sentence(text: str) -> str:
    """``text`` with a capital and a full stop, unless it opens with an identifier; p-values as elsewhere."""
    text = re.sub(r"\bp = (\d[\d.]*(?:e[-+]?\d+)?)(?=\))", lambda m: f"p {p_value(float(m[1]))}", text.strip())
    first = text.split(" ", 1)[0]
    opened = text if "_" in first or ":" in first else text[:1].upper() + text[1:]
    return opened if opened.endswith((".", "!", "?")) else opened + "."


def _outcome(target: TargetFindings) -> str:
    """What happened on the data that no fit saw."""
    held_out = target.held_out
    unit = held_out_unit(target)
    before, after, floor = (unit.show(x) for x in (held_out.before, held_out.after, held_out.noise_floor))
    means = scored(held_out)
    alone = f"the fitted noise alone leaves {floor}"
    if not target.added:
        return f"On data that no fit saw, {means} scatter by {after} rms; {alone}."
    if held_out.before == held_out.after:
        return f"No residual shows it: on data that no fit saw, {means} scatter by {after} rms either way; {alone}."
    went = f"the error of {means} went from {before} to {after} rms ({change(held_out)}); {alone}."
    sets = rival_sets(target)
    if target.verdict == "confounded" and sets:
        fitted = listing(name(keys[0]) for keys in sets)
        return f"Whichever it is (fitted as {fitted}), on data that no fit saw {went}"
    return f"On data that no fit saw, {went}"


def change(held_out: HeldOut) -> str:
    """Relative change of the held-out error: "-94%"."""
    share = held_out.after / held_out.before - 1 if held_out.before > 0 else math.nan
    if not math.isfinite(share):
        return "—"
    return ("-" if share < 0 else "+") + percent(abs(share))


def _excess(held_out: HeldOut) -> list[str]:
    """By how much the residual still exceeds its noise, where it does."""
    ratio = held_out.after / held_out.noise_floor if held_out.noise_floor > 0 else math.nan
    if not ratio > _EXCESS:
        return []
    return [f"What is left on held-out data is {number(ratio)} times what the fitted noise leaves."]


def _settling(target: TargetFindings) -> list[str]:
    """The experiment that would tell each set of rivals apart."""
    said = []
    for keys in rival_sets(target):
        for one in target.next_experiment:
            if set(keys) <= set(one.separates):
                said.append(f"Next experiment, to tell {listing(rivals(target, keys))} apart – {one.procedure}.")
                break
    return said


def rival_sets(target: TargetFindings) -> list[tuple[str, ...]]:
    """Sets of effects that this recording cannot tell apart, each once."""
    sets: dict[frozenset[str], tuple[str, ...]] = {}
    for added in target.added:
        members = (key_of(added), *added.confounded_with)
        if added.confounded_with:
            sets.setdefault(frozenset(members), members)
    return list(sets.values())


def by_need(target: TargetFindings) -> list[tuple[str, list[str]]]:
    """What could not be tested, grouped by what it would need."""

    def need(item: NotTestable) -> str:
        return f"needs {listing(item.needs)}" if item.needs else item.reason or "no reason given"

    ordered = sorted(target.not_testable, key=need)
    return [(key, [item.effect for item in group]) for key, group in groupby(ordered, key=need)]


def again(key: str, target: TargetFindings) -> str:
    """A note for a candidate whose like was added: what was tried is one more of it."""
    alone = any(r.effect == key and r.reason.startswith("alone") for r in target.rejected)
    return " (another)" if not alone and any(key == key_of(one) for one in target.added) else ""


def outcome(rejected: Rejected) -> str:
    """Why a candidate was not added, and how small an effect would have been."""
    least = rejected.smallest_detectable
    if least is None:
        return rejected.reason
    at = "".join(f" at {name} = {unit_for(unit, value).show(value, 2)}" for name, (value, unit) in least.at.items())
    size = unit_for(least.unit, least.value).show(least.value, 2)
    return f"{rejected.reason}; {size} or more would have been detected{at}"


def scored(held_out: HeldOut) -> str:
    """Of what the held-out error is: "means over 5 s"."""
    return held_out.of or f"means over {span(held_out.averaging)}"


def held_out_unit(target: TargetFindings, added: Added | None = None) -> ShownUnit:
    """The one unit of all held-out errors of a target; of an added effect, that of its own where it has one."""
    if added is not None and added.unit:
        return unit_for(added.unit, added.held_out_before, added.held_out_after)
    return unit_for(target.held_out.unit, target.held_out.before, target.held_out.after)


def rest(p_values: list[float]) -> str:
    """What to say of candidates that are only counted: "not significant (all p > 0.1)"."""
    least = min(p_values)
    return f"not significant ({'all p > 0.1' if least > 0.1 else f'smallest p {p_value(least)}'})"
