"""Scores answers to the challenge: how often right, wrong and silent, and what was taken for what. No other packages.

    python score.py FOLDER answers.jsonl [more.jsonl ...] [--out scores.md] [--head head.md]

An answer is a line of JSON: ``case``, ``verdict``, and ``effects``, a list of ``name`` and ``rivals`` (what it was not
told from). A program that writes the report of the contract has all three. Only cases that every file answers count.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

#: Of each case: its kind, its effects and their sizes.
Truth = dict[str, dict[str, Any]]
#: Names of which the order is part.
ORDERED = ("encoder_harmonic", "angle_locked_rate")
#: Outcomes in which an effect has the first place, alone or with rivals beside it.
FIRST = ("alone", "among rivals")
#: Verdicts that say: there is something, and no name explains it.
FLAGGED = ("generic-only", "unexplained-structure", "effects-found-incomplete")


@dataclass(frozen=True)
class Answer:
    """What a program said of a case: each name with its rivals."""

    verdict: str
    named: tuple[tuple[str, frozenset[str]], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """What was named."""
        return tuple(name for name, _ in self.named)


def plain(name: str) -> str:
    """The name without an order that is not part of it."""
    return name if name.partition(":")[0] in ORDERED else name.partition(":")[0]


def read_answers(path: Path) -> dict[str, Answer]:
    """Answers by case."""
    answers = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        named = tuple(
            (plain(one["name"]), frozenset(map(plain, one.get("rivals", ()))) - {plain(one["name"])})
            for one in row["effects"]
        )
        answers[row["case"]] = Answer(row["verdict"], named)
    return answers


def read_truth(folder: Path) -> tuple[Truth, str]:
    """The truth by case, and its sha256, which is to be the one that was published."""
    data = (folder / "truth.json").read_bytes()
    digest = hashlib.sha256(data).hexdigest()
    published = (folder / "truth.sha256").read_text().split()[0]
    if digest != published:
        raise SystemExit(f"{folder}/truth.json has sha256 {digest}; published was {published}")
    return json.loads(data)["cases"], digest


def outcome(true: str, answer: Answer) -> str:
    """What an answer makes of one effect that is there."""
    for name, rivals in answer.named:
        if name == true:
            return "among rivals" if rivals else "alone"
    if any(true in rivals for _, rivals in answer.named):
        return "as a rival"
    return "wrong" if answer.named else "nothing"


def share(count: int, of: int) -> str:
    """A share with its interval of 95 % (Wilson)."""
    if not of:
        return "-"
    p, z = count / of, 1.96
    middle, half = p + z * z / (2 * of), z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    low, high = (middle - half) / (1 + z * z / of), (middle + half) / (1 + z * z / of)
    return f"{count}/{of}, {100 * p:.0f} % ({100 * max(low, 0):.0f} to {100 * min(high, 1):.0f})"


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """A table of Markdown."""
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    return lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]


def scores(truth: Truth, answers: dict[str, Answer], cases: list[str]) -> dict[str, tuple[int, int]]:
    """Counts of one program: name of the score to (count, of)."""
    found: dict[str, tuple[int, int]] = {}
    kinds = sorted({str(truth[c]["kind"]) for c in cases})
    for kind in kinds:
        own = [c for c in cases if truth[c]["kind"] == kind]
        said = [answers[c] for c in own]
        if kind == "null":
            found["null: anything named"] = sum(bool(a.named) for a in said), len(own)
            continue
        if kind == "unknown":
            found["unknown: flagged"] = sum(a.verdict in FLAGGED for a in said), len(own)
            confounded = sum(a.verdict == "confounded" for a in said)
            found["unknown: names that are not told apart"] = confounded, len(own)
            found["unknown: a name, and sure"] = sum(a.verdict == "effects-found" for a in said), len(own)
            continue
        effects = [truth[c]["effects"] for c in own]
        right = [[outcome(e, a) not in ("wrong", "nothing") for e in es] for es, a in zip(effects, said, strict=True)]
        found[f"{kind}: anything found"] = sum(bool(a.named) for a in said), len(own)
        found[f"{kind}: named"] = sum(map(all, right)), len(own)
        first = [all(outcome(e, a) in FIRST for e in es) for es, a in zip(effects, said, strict=True)]
        found[f"{kind}: named first"] = sum(first), len(own)
        extra = [bool(set(a.names) - set(es)) for es, a in zip(effects, said, strict=True)]
        found[f"{kind}: another name beside or instead"] = sum(extra), len(own)
    return found


def confusion(truth: Truth, answers: dict[str, Answer], cases: list[str]) -> list[str]:
    """What each single effect was taken for: a matrix with its rare columns written out."""
    rows = []
    singles = [c for c in cases if str(truth[c]["kind"]).startswith("single")]
    for true in sorted({str(truth[c]["effects"][0]) for c in singles}):
        own = [c for c in singles if truth[c]["effects"][0] == true]
        outcomes = Counter(outcome(true, answers[c]) for c in own)
        wrong = [c for c in own if outcome(true, answers[c]) == "wrong"]
        others = Counter(name for c in wrong for name in answers[c].names)
        told = Counter(r for c in own for n, rivals in answers[c].named if n == true for r in rivals)
        listed = ", ".join(f"{name} {count}" for name, count in others.most_common(4))
        rivals = ", ".join(f"{name} {count}" for name, count in told.most_common(4))
        columns = (outcomes[key] for key in ("alone", "among rivals", "as a rival", "wrong", "nothing"))
        rows.append((f"`{true}`", len(own), *columns, listed, rivals))
    header = ("effect", "cases", "alone", "first of rivals", "as a rival", "wrong", "nothing", "wrong as", "rivals")
    return table(header, rows)


def report(folder: Path, paths: Sequence[Path]) -> str:
    """Scores of all programs beside each other, and what each took for what, as Markdown."""
    truth, digest = read_truth(folder)
    programs = {path.stem: read_answers(path) for path in paths}
    cases = sorted(set(truth).intersection(*programs.values()))
    each = {name: scores(truth, answers, cases) for name, answers in programs.items()}
    first, answers = next(iter(programs.items()))
    lines = [f"sha256 of the truth: `{digest}`.", ""]
    own = sorted(set(truth).intersection(answers))
    if len(own) > len(cases):
        lines += [f"## {first}, all of its {len(own)} answers", ""]
        lines += [*table(("", first), [(k, share(*v)) for k, v in scores(truth, answers, own).items()]), ""]
    lines += [f"## The {len(cases)} cases that every program answered", ""]
    keys = next(iter(each.values()))
    lines += table(("", *each), [(key, *(share(*one[key]) for one in each.values())) for key in keys])
    lines += ["", f"## What was taken for what: {first}", "", *confusion(truth, answers, own)]
    for name in list(programs)[1:]:
        lines += ["", f"## What was taken for what: {name}", "", *confusion(truth, programs[name], cases)]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("answers", type=Path, nargs="+")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--head", type=Path, help="text that stands above the scores")
    given = parser.parse_args()
    head = "" if given.head is None else given.head.read_text(encoding="utf-8").rstrip() + "\n\n"
    text = head + report(given.folder, given.answers)
    if given.out is None:
        print(text)
    else:
        given.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
