"""Right, honest, wrong, missed or refused: the loop's answers against the facts of independent fits.

    python judge.py FACTS.toml ANSWERS [--markdown]

ANSWERS is a folder with the JSON of `insenv close-loop` for each manifest, `source__name.json`, and what it wrote to
standard error, `source__name.err`. An answer is *right* where it names what must be named, nothing that the data
exclude, and its values are in tolerance; *honest* where it falls short and says so: a verdict of something left,
confounded or unexplained with the truth within it, a remark on its vibration, or a fair refusal; *wrong* where it names
what is not there or a value is off (stated, where its verdict holds no doubt); *missed* where it stays silent on what
must be named and sees nothing left; *refused* where an ordinary test is not taken; *crashed* where there is a
traceback.
"""

from __future__ import annotations

import argparse
import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

SURE = ("effects-found", "nothing-significant")
#: Their sign is a matter of convention.
UNSIGNED = ("sample_hold", "timing_skew")
WORDS = {
    "the unit moves": ("moves", "moved", "motion", "not at rest"),
    "no rests": ("no rest", "never at rest", "not at rest", "rests are", "rests to fit"),
    "factor": ("factor of", "check the unit", "range setting", "times the rate that it was exposed to"),
    "rests": ("rest",),
    "wraps": ("no rest", "never at rest", "not at rest", "with a sign, read without"),
}
#: Frequencies and channels of vibration that longer means have left out, as a remark of the report says them.
LOUDEST = re.compile(r"about [\d.e+]+ Hz on ((?:gyro|accel)[a-z_]*(?:(?:, | and )(?:gyro|accel)[a-z_]*)*)")
#: Effects that facts of before them have under another name: the bend of a characteristic was its cube.
SINCE = {"scale_factor_knee": "scale_factor_cubic"}
GENERIC = ("spline_time", "spline_rate", "spline_angle", "spline_temperature")


@dataclass(frozen=True, slots=True)
class Judgement:
    """One recording: the word, what was said, and why."""

    manifest: str
    word: str
    said: str
    why: str


def judge(fact: Mapping[str, Any], groups: Mapping[str, Any], folder: Path) -> Judgement:
    """Judge the answer on one recording."""
    name = str(fact["manifest"])
    stem = name.removesuffix(".toml").replace("/", "__")
    path, errors = folder / f"{stem}.json", folder / f"{stem}.err"
    told = errors.read_text(encoding="utf-8", errors="replace").strip() if errors.exists() else ""
    if not path.exists():
        return _without(name, fact, told)
    report = json.loads(path.read_text(encoding="utf-8"))
    verdicts = report.get("verdicts") or {_target(report): report["verdict"]}
    names = _names(report, verdicts)
    faults = [f for target in verdicts for f in _faults(fact, groups, target, names[target], verdicts[target], report)]
    faults += [f for row in _rows(fact, groups) for f in _off(row, report, verdicts)]
    said = "; ".join(_said(alike, listed, verdict) for listed, verdict, alike in _alike(names, verdicts))
    if not faults and fact.get("refusal") and not _told(fact, report):
        quiet = any(verdict in SURE for verdict in verdicts.values())
        return Judgement(name, "missed" if quiet else "honest", said, f"not said: {fact['refusal']}")
    if not faults:
        return Judgement(name, "right", said, "")
    kinds = Counter(kind for kind, _, _ in faults)
    why = "; ".join(dict.fromkeys(text for _, _, text in faults))
    sure = [f for f in faults if f[1]]
    moved = _told(fact, report)
    if moved:
        return Judgement(name, "honest", said, f"says so: {moved}; {why}")
    if kinds["false"] or kinds["value"]:
        stated = any(kind in ("false", "value") for kind, *_ in sure)
        return Judgement(name, "wrong, stated" if stated else "wrong, flagged", said, why)
    return Judgement(name, "missed" if sure else "honest", said, why)


def _without(name: str, fact: Mapping[str, Any], told: str) -> Judgement:
    last = told.replace("\r", "\n").splitlines()[-1] if told else "no answer"
    if "Traceback" in told:
        return Judgement(name, "crashed", "", last[:160])
    fair = str(fact.get("refusal", ""))
    said = last[max(last.find("insenv:"), 0) :]
    word = "honest" if fair and any(w in said.lower() for w in _words(fair)) else "refused"
    return Judgement(name, word, "", said[:240])


def _words(refusal: str) -> tuple[str, ...]:
    """Words by which a sentence is known to give the reason of a fair refusal."""
    return WORDS.get(refusal, (refusal,))


def _target(report: Mapping[str, Any]) -> str:
    target = report.get("target", "gyro")
    return str(target[0] if isinstance(target, list) else target)


def _names(report: Mapping[str, Any], verdicts: Mapping[str, str]) -> dict[str, list[tuple[str, tuple[str, ...]]]]:
    out: dict[str, list[tuple[str, tuple[str, ...]]]] = {t: [] for t in verdicts}
    only = next(iter(verdicts))
    for added in report["added"]:
        rivals = tuple(r.split(":")[0] for r in added.get("confounded_with", ()))
        out[added.get("target", only)].append((added["effect"].split(":")[0], rivals))
    return out


def _of(table: Mapping[str, Any], target: str, groups: Mapping[str, Any]) -> list[Any]:
    out: list[Any] = []
    for pattern, given in table.items():
        if fnmatch(target, pattern):
            out += groups[given] if isinstance(given, str) else given
    return out


def _rows(fact: Mapping[str, Any], groups: Mapping[str, Any]) -> list[list[Any]]:
    bench = fact.get("must", {}).get("gyro") == "bench_must"
    return [*fact.get("values", ()), *(groups["bench_values"] if bench else ())]


def _faults(
    fact: Mapping[str, Any],
    groups: Mapping[str, Any],
    target: str,
    names: list[tuple[str, tuple[str, ...]]],
    verdict: str,
    report: Mapping[str, Any],
) -> Iterator[tuple[str, bool, str]]:
    must = _of(fact.get("must", {}), target, groups)
    allowed = (
        {n for group in must for n in group}
        | set(_of(fact.get("may", {}), target, groups))
        | set(GENERIC)
        | {"saturation", "burst"}
    )
    allowed |= {name for name, before in SINCE.items() if before in allowed}
    for name in dict.fromkeys(n for n, _ in names):
        rivals = {r for n, each in names for r in each if n == name}
        if name not in allowed and not rivals & allowed:
            many = sum(n == name for n, _ in names)
            yield "false", verdict in SURE, f"{target}: {name}{f' x {many}' if many > 1 else ''} is not there"
    here = {n for n, _ in names} | {r for _, each in names for r in each}
    here |= {str(r.get("cause")) for r in report.get("rows_rejected", ()) if r.get("target", target) == target}
    if any(target in each["channels"] for each in report.get("common_mode", ())):
        here.add("common_mode")
    here |= {before for name, before in SINCE.items() if name in here}
    for group in must:
        if not here & set(group):
            told = "common_mode" in group and _vibrates(target, report)
            yield "missing", verdict in SURE and not told, f"{target}: {' or '.join(group[:2])} is there and not named"


def _vibrates(target: str, report: Mapping[str, Any]) -> bool:
    """Whether a remark says where the vibration of a channel is loudest, that means were made longer for."""
    said = [text for remark in report.get("remarks", ()) for text in LOUDEST.findall(str(remark))]
    return any(target in re.split(r", | and ", channels) for channels in said)


def _off(row: list[Any], report: Mapping[str, Any], verdicts: Mapping[str, str]) -> Iterator[tuple[str, bool, str]]:
    """A value that is off; a share of a hold counts by its size, of the output or of the gain."""
    target, effect, parameter, value, tolerance, *beside = row
    only = next(iter(verdicts))
    added = [entry for entry in report["added"] if entry.get("target", only) == target]
    if beside and beside[0] not in {entry["effect"] for entry in added}:
        value, tolerance = beside[1:]
    found = [
        (p["value"], p["sd"])
        for entry in added
        if entry["effect"] == effect
        for p in entry["parameters"]
        if p["name"].split("[")[0] == parameter
    ] + [
        (e["value"], e["sd"])
        for e in report["estimates"]["after"]
        if e.get("target", only) == target and e["effect"] == effect and e["name"].split("[")[0] == parameter
    ]
    for v, s in found:
        miss = abs(v - value)
        if effect in UNSIGNED:
            miss = min(abs(abs(v) - value), abs(abs(v) - 1.0))
        if miss > max(tolerance, 3.0 * (s or 0.0)):
            sure = verdicts.get(target, "") in SURE
            yield "value", sure, f"{target}: {effect} {parameter} = {v:.4g} +- {s or 0:.2g}, independent {value:.4g}"
            return


def _told(fact: Mapping[str, Any], report: Mapping[str, Any]) -> str:
    """Words of a remark or caution that say what a fair refusal would say."""
    wanted = str(fact.get("refusal", ""))
    if not wanted:
        return ""
    texts = list(report.get("remarks", ()))
    for key in ("reasons", "cautions"):
        given = report.get(key) or []
        texts += [c for each in (given.values() if isinstance(given, dict) else [given]) for c in each]
    for text in texts:
        if any(w in str(text).lower() for w in _words(wanted)):
            return str(text)[:120]
    return ""


def _alike(names: Mapping[str, Any], verdicts: Mapping[str, str]) -> list[tuple[str, str, list[str]]]:
    rows: dict[tuple[str, str], list[str]] = {}
    for target, each in names.items():
        count = Counter(n for n, _ in each)
        listed = ", ".join(f"{n} x {k}" if k > 1 else n for n, k in count.items()) or "nothing"
        rows.setdefault((listed, verdicts[target]), []).append(target)
    return [(listed, verdict, targets) for (listed, verdict), targets in rows.items()]


def _said(targets: list[str], listed: str, verdict: str) -> str:
    return f"{', '.join(targets)}: {listed} ({verdict})"


def all_of(facts: Path, folder: Path) -> list[tuple[Mapping[str, Any], Judgement]]:
    """Facts and judgements of every recording of a half that was run."""
    told = tomllib.loads(facts.read_text(encoding="utf-8"))
    run = [fact for fact in told["recording"] if _run(str(fact["manifest"]), folder)]
    return [(fact, judge(fact, told.get("groups", {}), folder)) for fact in run]


def _run(manifest: str, folder: Path) -> bool:
    """Whether an answer is there: a report, a refusal or a crash."""
    stem = folder / manifest.removesuffix(".toml").replace("/", "__")
    errors = stem.with_suffix(".err")
    told = errors.read_text(encoding="utf-8", errors="replace") if errors.exists() else ""
    return stem.with_suffix(".json").exists() or "insenv:" in told or "Traceback" in told


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("facts", type=Path)
    parser.add_argument("answers", type=Path)
    parser.add_argument("--markdown", action="store_true")
    given = parser.parse_args()
    rows = all_of(given.facts, given.answers)
    if given.markdown:
        print("| recording | independent fit | insenv | judgement | why |\n|---|---|---|---|---|")
    for fact, found in rows:
        if given.markdown:
            print(f"| `{found.manifest}` | {fact['fit']} | {found.said} | {found.word} | {found.why} |")
        else:
            print(f"{found.word:15s} {found.manifest}\n    {found.said}\n    {found.why}")
    print("\n" + ", ".join(f"{word} {n}" for word, n in Counter(f.word for _, f in rows).most_common()))


if __name__ == "__main__":
    main()
