"""Figures of the blind bench: counts with exact intervals beside what was asked, and the cases that went wrong."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import studies.result_page as result_page
from scipy.stats import beta

Kept = dict[str, Any]
Fault = tuple[str, list[str]]
HEAD = """# Blind bench

Made by `{command}`: {count} recordings by the generator in `tests/blind`, which shares no code with insenv, and the
damaged files of the same folder.

* **Tests**: laser, fibre-optic and MEMS gyros at rest or on a table (one rate, reversals, ladders, ladders with stops,
  sines, sweeps, positions), 5 min to 2 h at 1 to 400 Hz; accelerations are limited. White noise, flicker and random
  walk within the figures of each grade; counts, digital rates and encoders are rounded; the encoder jitters by its own
  step. Half of the manifests declare the noise. Two in five have two or three runs of one programme, in files of their
  own or in one file with the number of the power-up; a third of the recordings with a clock has gaps, or rows that the
  logger dropped one by one.
* **Strength** of a cause: norm of its whitened samples beside the declared model, with the true noise, on the fitted
  rows (of each of two causes: beside the other too).
* **Exact**: the contract's formula. **Realistic**: two exponentials, bent temperature curves behind a lag, a Lorentzian
  anomaly, several harmonics, steps that relax, a lock width that warms up, two tones close together, a cubic with a
  fifth power.
* **Unknown**: a hump, a ripple of five per turn that grows with temperature, a relay, a motor's heat, a telegraph, a
  chirp, a sawtooth, a toothed belt, a loose encoder, bursts.
* A name counts as **right** if it is the cause's, or if beside the named effect's best curve less than 3 of the cause's
  strength is left: then nobody could tell. Other rows count the cause's own name alone.
* **Systematic error**: residual minus the noise that the generator put in, on held-out bins.
* Intervals are exact (Clopper and Pearson), 95 %.
"""
KINDS = ("null", "exact", "realistic", "pair", "unknown", "confounded", "triad", "student")
FLAGS = ("effects-found-incomplete", "generic-only", "unexplained-structure", "confounded")


def interval(count: int, of: int) -> str:
    """``count/of = share [low, high]``, the exact interval of 95 %."""
    if not of:
        return "-"
    low = beta.ppf(0.025, count, of - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, of - count) if count < of else 1.0
    return f"{count}/{of} = {count / of:.1%} [{low:.1%}, {high:.1%}]"


def names(kept: Kept) -> list[str]:
    return [a["key"] for a in kept.get("added", [])]


def physical(kept: Kept) -> list[str]:
    return [a["key"] for a in kept.get("added", []) if not a["generic"]]


def truths(kept: Kept) -> list[Kept]:
    return list(kept["case"]["truths"])


def right(truth: Kept, name: str) -> bool:
    """A name that does the cause justice, or one that this procedure cannot tell from it."""
    return name in truth["accepted"] or name in truth["rivals"]


def detected(kept: Kept) -> bool:
    return bool(names(kept))


def first(kept: Kept) -> bool:
    """The first effect found is the cause, or one that nobody could tell from it."""
    return bool(names(kept)) and right(truths(kept)[0], names(kept)[0])


def strictly_first(kept: Kept) -> bool:
    return bool(names(kept)) and names(kept)[0] in truths(kept)[0]["accepted"]


def among(kept: Kept) -> bool:
    """The cause itself is among what was added and the rivals of that."""
    reported = {n for a in kept.get("added", []) for n in (a["key"], *a["rivals"])}
    return all(bool(reported & set(t["accepted"])) for t in truths(kept))


def exact_set(kept: Kept) -> bool:
    """Every cause has a right name, and there is no name without a cause."""
    found = names(kept)
    each = all(any(right(t, n) for n in found) for t in truths(kept))
    return each and all(any(right(t, n) for t in truths(kept)) for n in found) and len(found) >= len(truths(kept))


def no_worse(kept: Kept) -> bool:
    before, after, _ = kept["held_out"]
    return bool(after <= 1.02 * before)


def flagged(kept: Kept) -> bool:
    return kept["verdict"] != "nothing-significant"


def cautious(kept: Kept) -> bool:
    """Flagged by a verdict that does not claim to have explained everything."""
    return kept["verdict"] in FLAGS


def full_set(kept: Kept) -> bool:
    required = set(kept["case"]["required"])
    return any(required <= {a["key"], *a["rivals"]} for a in kept.get("added", []))


def all_named(kept: Kept) -> bool:
    """Every cause has its name, or is among the rivals of one."""
    return among(kept)


def unfounded(kept: Kept) -> bool:
    """A name that no cause has, and that is no rival of one that is there."""
    may = {name for t in truths(kept) for name in (*t["accepted"], *t["rivals"])} | set(kept["case"]["facts"]["may"])
    return any(not may & {a["key"], *a["rivals"]} for a in kept["added"] if not a["generic"])


def settled(kept: Kept) -> bool:
    """After the proposed experiment the cause is named and has no rival of those that it had to be told from."""
    after = kept.get("settled") or {"added": []}
    cause, required = truths(kept)[0]["key"], set(kept["case"]["required"])
    named = {name for name, _ in after["added"]} & required
    left = {rival for _, rivals in after["added"] for rival in rivals} & required
    return named == {cause} and not left


def wanted(kept: Kept) -> bool:
    """Whether a case went as its kind asks."""
    if "error" in kept:
        return False
    tests: dict[str, Callable[[Kept], bool]] = {
        "null": lambda k: not names(k) and not flagged(k),
        "exact": lambda k: first(k) and exact_set(k) and no_worse(k),
        "realistic": lambda k: first(k) and no_worse(k),
        "pair": lambda k: exact_set(k) and no_worse(k),
        "unknown": lambda k: flagged(k) and no_worse(k),
        "confounded": full_set,
        "student": lambda k: all_named(k) and not unfounded(k) and no_worse(k),
        "triad": lambda k: first(k) and no_worse(k) if truths(k) else not flagged(k),
    }
    return tests[kept["kind"]](kept)


def _share(rows: Sequence[Kept], test: Callable[[Kept], bool]) -> str:
    return interval(sum(map(test, rows)), len(rows))


def _spread(values: Iterable[float]) -> str:
    data = list(values)
    if not data:
        return "-"
    rms = math.sqrt(statistics.fmean(v * v for v in data))
    return f"rms {rms:.2f}, median |z| {statistics.median(map(abs, data)):.2f}, {len(data)} cases"


def _ratio(rows: Sequence[Kept]) -> str:
    pairs = [k["systematic"] for k in rows if k["systematic"][0] > 0]
    return f"median {statistics.median(a / b for b, a in pairs):.2f}, {len(pairs)} cases" if pairs else "-"


def _null_rows(nulls: Sequence[Kept]) -> Iterator[tuple[str, str, str]]:
    yield "null: something added", "<= 2 %", _share(nulls, detected)
    yield "null: any verdict but nothing-significant", "", _share(nulls, flagged)
    for label, runs in (("one run", (1,)), ("several runs", (2, 3))):
        rows = [k for k in nulls if k["case"]["facts"]["runs"] in runs]
        yield f"null, {label}: something added", "<= 2 %", _share(rows, detected)
    gaps = [k for k in nulls if k["case"]["facts"]["gaps"] or k["case"]["facts"]["dropped"]]
    yield "null, gaps or dropped rows: something added", "<= 2 %", _share(gaps, detected)


def _student_rows(rows: Sequence[Kept]) -> Iterator[tuple[str, str, str]]:
    """Student tables with a real encoder: half of them with an error of the gyro beside skew and hold."""

    def has(key: str) -> Callable[[Kept], bool]:
        return lambda k: any(t["key"] == key for t in truths(k))

    def named(key: str) -> Callable[[Kept], bool]:
        return lambda k: key in names(k)

    held = [k for k in rows if has("sample_hold")(k)]
    more = [k for k in rows if k["case"]["number"] % 2]
    yield "student table: skew named", ">= 95 %", _share(rows, named("timing_skew"))
    yield "student table: hold named where there is one", ">= 95 %", _share(held, named("sample_hold"))
    others = [k for k in rows if k not in held]
    yield "student table: hold named where there is none", "0", _share(others, named("sample_hold"))
    yield "student table, one error more: named or among the rivals", ">= 80 %", _share(more, all_named)
    yield "student table: a name without a cause", "<= 5 %", _share(rows, unfounded)
    z = [k["z"] for k in rows if k["z"] is not None]
    yield "student table: gain within 2 sd", ">= 93 %", interval(sum(abs(v) <= 2 for v in z), len(z))


def table_rows(kept: Sequence[Kept]) -> Iterator[tuple[str, str, str]]:
    """What is measured, what was asked, what came out."""
    whole = [k for k in kept if "error" not in k]
    kinds = {kind: [k for k in whole if k["kind"] == kind] for kind in KINDS}
    yield "ended with an error", "0", interval(len(kept) - len(whole), len(kept))
    yield from _null_rows(kinds["null"])
    for kind, asked in (("exact", ">= 95 %"), ("realistic", ">= 90 %")):
        for strength in sorted({round(truths(k)[0]["strength"]) for k in kinds[kind]}):
            rows = [k for k in kinds[kind] if round(truths(k)[0]["strength"]) == strength]
            found = [k for k in rows if detected(k)]
            label = f"{kind}, strength {strength}"
            yield f"{label}: detected", ">= 95 %" if strength == 10 else "", _share(rows, detected)
            yield f"{label}: first name right, of detected", asked if strength == 10 else "", _share(found, first)
            yield f"{label}: first name is the cause's own, of detected", "", _share(found, strictly_first)
            yield f"{label}: cause among names and rivals, of detected", "", _share(found, among)
            yield f"{label}: exact set, of detected", "", _share(found, exact_set)
            limit = {10: "<= 0.2", 20: "<= 0.1"}.get(strength, "") if kind == "exact" else ""
            yield f"{label}: systematic held-out error after/before", limit, _ratio([k for k in found if first(k)])
            z = [k["z"] for k in found if k["z"] is not None and first(k)]
            yield f"{label}: z of the scale factor", "0.9-1.1" if kind == "exact" else "< 2", _spread(z)
    yield "two causes: exact set", ">= 90 %", _share(kinds["pair"], exact_set)
    yield "unknown: flagged by some verdict", ">= 90 %", _share(kinds["unknown"], flagged)
    yield "unknown: flagged as not (fully) explained", "", _share(kinds["unknown"], cautious)
    yield "unknown: held-out error worse by > 2 %", "0", _share(kinds["unknown"], lambda k: not no_worse(k))
    yield "all: held-out error worse by > 2 %", "0", _share(whole, lambda k: not no_worse(k))
    for name in sorted({str(k["case"]["facts"]["procedure"]) for k in kinds["confounded"]}):
        rows = [k for k in kinds["confounded"] if k["case"]["facts"]["procedure"] == name]
        yield f"confounded, {name}: full set", "every time" if "one per turn" in name else "", _share(rows, full_set)
    once = [k for k in kinds["confounded"] if k["case"]["facts"]["procedure"] == "one per turn at one rate"]
    yield "one per turn at one rate: settled by the proposed experiment", ">= 95 %", _share(once, settled)
    triads = [k for k in kinds["triad"] if truths(k)]
    yield "unit at rest, one cause on a channel: detected", "", _share(triads, detected)
    yield "unit at rest: first name right, of detected", "", _share([k for k in triads if detected(k)], first)
    rests = [k for k in kinds["triad"] if not truths(k)]
    yield "unit at rest, null: something added", "<= 2 %", _share(rests, detected)
    yield from _student_rows(kinds["student"])
    z = [k["z"] for k in kinds["null"] if k["z"] is not None]
    yield "null: z of the scale factor", "0.9-1.1", _spread(z)
    seconds = [k["seconds"] for k in kept]
    if seconds:
        yield (
            "seconds of one processor",
            "median <= 3, max <= 10",
            f"median {statistics.median(seconds):.1f}, max {max(seconds):.1f}",
        )


def figures(kept: Sequence[Kept], faults: Sequence[Fault] = ()) -> tuple[str, ...]:
    good = interval(sum(not short for _, short in faults), len(faults))
    last = ("damaged files: exit status 2 and one sentence that names file and fault", "all", good)
    return result_page.table(("figure", "asked", "reached"), [*table_rows(kept), last])


def failures(kept: Sequence[Kept], everything: bool = False) -> str:
    return "\n".join(_story(k) for k in kept if everything or not wanted(k))


def _story(k: Kept) -> str:
    facts = k["case"]["facts"]
    lines = [f"## {k['name']}  ({k['seconds']:.1f} s)  {k['command']}"]
    lines.append("  test: " + ", ".join(f"{name}={value}" for name, value in facts.items()))
    for t in truths(k):
        lines.append(
            f"  true: {t['key'] or facts.get('stranger')} strength {t['strength']:.1f}; not told from {t['rivals']}"
        )
    if k["case"]["required"]:
        lines.append(f"  required set: {k['case']['required']}")
    if "error" in k:
        return "\n".join([*lines, f"  ERROR {k['error']}"])
    lines.append(f"  verdict: {k['verdict']}; {k['reasons']}")
    for a in k["added"]:
        lines.append(f"  added {a['key']} p={a['p']:.2g} lr={a['lr']:.1f} rivals={a['rivals']} {a['remark']}")
    rejected = [f"{name} p={p:.2g} lr={lr:.1f} ({why})" for name, p, lr, why in k["rejected"][:5]]
    lines.append("  rejected: " + "; ".join(rejected))
    if "settled" in k:
        lines.append(f"  after the proposed experiment: {k['settled']}")
    before, after, floor = k["held_out"]
    s0, s1 = k["systematic"]
    z = "-" if k["z"] is None else f"{k['z']:.2f}"
    lines.append(f"  held out after/before {after / before:.3f}, floor/before {floor / before:.3f}; "
                 f"systematic after/before {s1 / max(s0, 1e-300):.3f}; z {z}")  # fmt: skip
    return "\n".join(lines)


def page(path: Path, kept: Sequence[Kept], faults: Sequence[Fault], command: str) -> None:
    """Write the page of results."""
    head = HEAD.format(command=command, count=len(kept))
    section = result_page.Section("Figures", figures(kept, faults), _verdict(kept))
    result_page.write(path, head, iter([section]), 1)


def _verdict(kept: Sequence[Kept]) -> str:
    good = sum(map(wanted, kept))
    return f"{good} of {len(kept)} cases came out as their kind asks."
