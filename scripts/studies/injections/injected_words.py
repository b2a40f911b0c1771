"""What the loop says of a recording with an effect in it, beside what it says of the same without.

*right* names what was put in, nothing new that is not there, and a coefficient in tolerance; *honest* has it among the
rivals, or says that something is left or unexplained where it did not before; *silent* says the same as before under a
verdict that held a doubt; *missed* under one that holds none; *wrong value* and *wrong name* are stated or flagged:
under a verdict without a doubt, or with one. What was named of the untouched recording is not false.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SURE = ("effects-found", "nothing-significant")
GENERIC = ("spline_time", "spline_rate", "spline_angle", "spline_temperature", "formula")
#: Where one of these is among the rivals of a name, nothing is said to be there.
NOISE = ("bias_instability", "rate_random_walk", "angle_random_walk")
GOOD = ("right", "honest")
#: Two coefficients make one amplitude.
WAVES = ("encoder_harmonic", "angle_locked_rate", "tone")
#: Below this probability an effect that was refused is called for all the same.
ASKED = 1e-3
#: A coefficient off by more standard deviations, and by more than this share.
FAR, SHARE = 3.0, 0.25


@dataclass(frozen=True)
class Word:
    """The judgement, what was said, why."""

    word: str
    said: str
    why: str = ""

    @property
    def good(self) -> bool:
        """Whether it is right, or honest."""
        return self.word in GOOD


@dataclass(frozen=True)
class Named:
    """One added effect of a target."""

    target: str
    effect: str
    rivals: tuple[str, ...]
    parameters: Mapping[str, tuple[float, float]]


def answer(stem: Path) -> tuple[Mapping[str, Any] | None, str]:
    """The report, or None, and what was written to standard error."""
    path, errors = stem.with_suffix(".json"), stem.with_suffix(".err")
    told = errors.read_text(encoding="utf-8", errors="replace").strip() if errors.exists() else ""
    return (json.loads(path.read_text(encoding="utf-8")) if path.exists() else None), told


def named(report: Mapping[str, Any]) -> list[Named]:
    """What a report added."""
    only = next(iter(verdicts(report)))
    out = []
    for one in report["added"]:
        rivals = tuple(r.partition(":")[0] for r in one.get("confounded_with", ()))
        parameters = {p["name"]: (float(p["value"]), float(p["sd"] or 0.0)) for p in one["parameters"]}
        out.append(Named(one.get("target", only), one["effect"].partition(":")[0], rivals, parameters))
    return out


def verdicts(report: Mapping[str, Any]) -> Mapping[str, str]:
    """The verdict on each target."""
    target = report.get("target", "gyro")
    return report.get("verdicts") or {str(target[0] if isinstance(target, list) else target): report["verdict"]}


def judge(truth: Mapping[str, Any], before: Path, after: Path) -> Word:
    """The word for a case: its truth and the stems of two answers."""
    was, _ = answer(before)
    now, told = answer(after)
    if "Traceback" in told:
        return Word("crashed", told.splitlines()[-1][:160])
    if now is None:
        last = told.replace("\r", "\n").splitlines()[-1] if told else "no answer"
        said = last[max(last.find("insenv:"), 0) :][:240]
        return Word("honest" if _told(truth, last) else "refused", said)
    if was is None:
        return Word("refused", "the untouched recording is refused")
    return compared(truth, was, now)


def compared(truth: Mapping[str, Any], was: Mapping[str, Any], now: Mapping[str, Any]) -> Word:
    """The word for two reports: without the effect, and with it."""
    said = "; ".join(dict.fromkeys(f"{n.target}: {n.effect}" for n in named(now))) or "nothing"
    said += f" ({verdicts(now).get(truth['target'], now['verdict'])})"
    return Word(*_judged(truth, was, now, said))


def _judged(
    truth: Mapping[str, Any], was: Mapping[str, Any], now: Mapping[str, Any], said: str
) -> tuple[str, str, str]:
    target, right = truth["target"], set(truth["names"]) | set(truth["alike"])
    verdict = verdicts(now).get(target, now["verdict"])
    doubt = "flagged" if verdict not in SURE else "stated"
    own = [n for n in named(now) if n.target == target]
    false = list(dict.fromkeys(_false(truth, was, now, right)))
    old = {n.effect for n in named(was) if n.target == target}
    hit = [n for n in own if n.effect in right and (n.effect not in old or truth["parameter"] or _moved(n, was))]
    beside = [n for n in own if right & set(n.rivals)]
    told = _said_of(truth, was, now)
    if false:
        sure = any(verdicts(now).get(t, "") in SURE for t, _ in false)
        text = ", ".join(f"{t}: {n}" for t, n in false)
        return (
            f"wrong name, {'stated' if sure else 'flagged'}",
            said,
            f"{text} is not there" + ("" if hit else ", not named"),
        )
    if hit or told == "named" or _declared(truth, was):
        off = _off(truth, was, now, hit)
        return (f"wrong value, {doubt}", said, off) if off else ("right", said, "")
    if _cancels(truth, was, now):
        return "right", said, "it takes away what was there before"
    before = verdicts(was).get(target, was["verdict"])
    told = told or ("" if verdict in SURE else _untestable(truth, now))
    why = "among the rivals" if beside else f"says: {told}" if told else ""
    if not why and verdict in SURE:
        return "missed", said, ""
    same = not why and before == verdict and _same(was, now, target)
    return ("silent" if same else "honest"), said, why or f"before: {before}"


def _untestable(truth: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """What is said of an effect that this recording cannot show."""
    for one in now["not_testable"]:
        if one["effect"] == truth["law"] or one["effect"] == f"{truth['law']}:1":
            return f"{one['effect']} is not testable" + (f": {one['reason']}" if one.get("reason") else "")
    return ""


def _same(was: Mapping[str, Any], now: Mapping[str, Any], target: str) -> bool:
    return {n.effect for n in named(was) if n.target == target} == {n.effect for n in named(now) if n.target == target}


def _declared(truth: Mapping[str, Any], was: Mapping[str, Any]) -> bool:
    return bool(truth["parameter"]) and any(_effect(e) in truth["names"] for e in was["declared"])


def _effect(entry: Any) -> str:
    return str(entry["effect"] if isinstance(entry, dict) else entry).partition(":")[0]


def _false(
    truth: Mapping[str, Any], was: Mapping[str, Any], now: Mapping[str, Any], right: set[str]
) -> Iterator[tuple[str, str]]:
    """Names on targets that are neither right nor were there before, nor are told from what is, or from noise."""
    for n in named(now):
        here = {e for m in named(was) if m.target == n.target for e in (m.effect, *m.rivals)} | _asked(was, n.target)
        if n.effect in here | right | set(GENERIC) or (right | here | set(NOISE)) & set(n.rivals):
            continue
        yield n.target, n.effect


def _asked(report: Mapping[str, Any], target: str) -> set[str]:
    """Effects that the data called for, and that were not named for another reason than chance."""
    only = next(iter(verdicts(report)))
    refused = (r for r in report["rejected"] if r.get("target", only) == target)
    return {_effect(r) for r in refused if r["p_value"] < ASKED and r.get("reason") != "not significant"}


def _off(truth: Mapping[str, Any], was: Mapping[str, Any], now: Mapping[str, Any], hit: list[Named]) -> str:
    """How the coefficient is off, or nothing."""
    if not truth["parameter"]:
        return ""
    found = _coefficient(truth, now, hit)
    old = _coefficient(truth, was, [n for n in named(was) if n.target == truth["target"]])
    if found is None:
        return ""
    value, sd = found
    start, start_sd = old if old is not None else (0.0, 0.0)
    true = abs(truth["value"])
    own = (sd**2 + start_sd**2 + (true / max(truth["strength"], 1.0)) ** 2) ** 0.5
    miss = min(abs(abs(value - start) - true), abs(abs(value + start) - true), abs(abs(value) - true))
    if miss <= max(FAR * own, SHARE * true):
        return ""
    return f"{truth['parameter']} = {value:.4g} +- {sd:.2g} against {start:.4g} before, put in {truth['value']:.4g}"


def _moved(n: Named, was: Mapping[str, Any]) -> bool:
    """Whether a coefficient of what was named before is another now."""
    for before in (m for m in named(was) if (m.target, m.effect) == (n.target, n.effect)):
        for name, (value, sd) in n.parameters.items():
            old, old_sd = before.parameters.get(name, (value, sd))
            if abs(value - old) > FAR * (sd**2 + old_sd**2) ** 0.5 and abs(value - old) > SHARE * abs(old):
                return True
    return False


def _cancels(truth: Mapping[str, Any], was: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether what was named of the untouched recording is as large as what was put in, and is named no more."""
    target = truth["target"]
    mine = [n for n in named(was) if n.target == target and n.effect in truth["names"]]
    gone = mine and not any(n.target == target and n.effect in truth["names"] for n in named(now))
    old = _coefficient(truth, was, mine) if gone and truth["parameter"] else None
    return old is not None and abs(abs(old[0]) - abs(truth["value"])) <= max(FAR * old[1], SHARE * abs(truth["value"]))


def _coefficient(truth: Mapping[str, Any], report: Mapping[str, Any], hit: list[Named]) -> tuple[float, float] | None:
    names = set(truth["names"])
    for n in sorted(hit, key=lambda n: n.effect != truth["law"].partition(":")[0]):
        given = next((p for p in (truth["parameter"], "tau", "c") if p in n.parameters), "")
        if n.effect in names and given:
            value, sd = n.parameters[given]
            if "s" in n.parameters and n.effect in WAVES:
                value = (value**2 + n.parameters["s"][0] ** 2) ** 0.5
                sd = max(sd, n.parameters["s"][1])
            return value, sd
    for e in report["estimates"]["after"]:
        if e.get("target", truth["target"]) == truth["target"] and _effect(e) in names:
            return float(e["value"]), float(e["sd"] or 0.0)
    return None


def _texts(report: Mapping[str, Any]) -> list[str]:
    texts = [str(r) for r in report.get("remarks", ())]
    for key in ("reasons", "cautions"):
        given = report.get(key) or []
        texts += [str(c) for each in (given.values() if isinstance(given, dict) else [given]) for c in each]
    return texts


def _told(truth: Mapping[str, Any], text: str) -> bool:
    return any(word in text.lower() or word.replace("_", " ") in text.lower() for word in truth["names"])


def _said_of(truth: Mapping[str, Any], was: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Whether rows were rejected for the effect's cause, or a new remark tells of it."""
    for r in now.get("rows_rejected", ()):
        if str(r.get("cause")) in truth["names"] and r.get("target", truth["target"]) == truth["target"]:
            return "named"
    before = any(_told(truth, t) for t in _texts(was))  # the same doubt with another p-value says nothing new
    new = [] if before else [t for t in _texts(now) if _told(truth, t)]
    if new and truth["law"] in ("flipped", "exchanged"):
        return "named"
    return new[0][:150] if new else ""
