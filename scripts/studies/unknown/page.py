"""The page of the study of causes that no catalogue has: figures before and after, by rule and by cause."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import rules
from rules import WORDS, judge

Kept = dict[str, Any]
HEAD = """# Causes that no catalogue had

Made by `python scripts/studies/unknown/study.py STORE` (`--minutes 5` as often as it takes: what the store holds is
not run again) and `python scripts/studies/unknown/study.py STORE --out docs/results/unknown_causes.md`, from recordings
that `scripts/studies/unknown/generate.py` writes. The generator imports nothing of insenv (NumPy alone: play and stop
operators, lags, thresholds, kinematics of a base and of a table, noise from its density). The effects of the
catalogue and these recordings were written by one hand all the same; the soft, second-order and two-constant forms
are those whose shape no effect has.

* **Causes**: backlash of the encoder (sharp, and soft with a spring); hysteresis of the scale factor (stop operator,
  a loop closed at the turning points, Bouc and Wen); dead band and dead zone (sharp, and soft with noise); bandwidth
  of the output (first and second order); wobble of the table's axis at one tilt; self-heating with the rate's history
  (square, friction, two time constants); bias with the square and the fourth power of the rate at a lever arm;
  vibration rectification of a gyro and of an accelerometer; settling after each turn; a base that settles or creeps
  under a gyro, or under a unit; a lever arm in turns; a unit that leans; accelerometers that are bent (square,
  magnitude, cube), in 24 attitudes.
* **Tests**: rate tables with angle, command that jumps, or both, with and without a thermometer, one run or two;
  gyros at rest; north finder positions; units at rest, on a table, in many attitudes. Laser, fibre and MEMS grades.
  Encoders are rounded and jitter by their step.
* **Strength**: norm of the whitened addition beside the declared model, with the true noise, on the rows that are
  fitted: 8, 15 and 30; pairs with an ordinary effect at 20 each. A threshold has the nearest strength that there is.
* **Controls** are ordinary effects of the catalogue, **nulls** have no cause.
* Intervals: Wilson, 95 %.

How a case is judged (`scripts/studies/unknown/rules.py`):

"""


def wilson(good: int, n: int, z: float = 1.96) -> tuple[float, float]:
    """Interval of a share: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209."""
    if not n:
        return 0.0, 1.0
    share, more = good / n, z * z / n
    middle = (share + more / 2) / (1 + more)
    half = z / (1 + more) * float(np.sqrt(share * (1 - share) / n + more / (4 * n)))
    return max(0.0, middle - half), min(1.0, middle + half)


def page(after: list[Kept], before: list[Kept] | None = None) -> str:
    """The page; of the cases that both stores have, where there are two."""
    if before is None:
        return _single(after)
    common = {_name(k) for k in after} & {_name(k) for k in before}
    old = {_name(k): k for k in before if _name(k) in common}
    new = {_name(k): k for k in after if _name(k) in common}
    stated = str(rules.__doc__).strip().partition("\n\n")[2]
    lines = [HEAD + stated, "", "## Figures", "", "| figure | asked | before | after |", "|---|---|---|---|"]
    lines += [
        f"| {name} | {asked} | {_share(old, of, good)} | {_share(new, of, good)} |"
        for name, asked, of, good in _FIGURES
    ]
    lines += ["", "## By cause", "", f"| cause | n | {' | '.join(WORDS)} |", "|---|---|" + "---|" * len(WORDS)]
    causes = sorted({_label(k) for k in new.values()})
    lines += [_row(cause, old, new) for cause in causes]
    lines += ["", "Each cell: before → after.", "", "## What is not right after", ""]
    lines += _rest(new.values())
    return "\n".join(lines) + "\n"


def _single(kept: list[Kept]) -> str:
    """The page of one store."""
    by = dict(enumerate(kept))
    stated = str(rules.__doc__).strip().partition("\n\n")[2]
    lines = [HEAD + stated, "", "## Figures", "", "| figure | asked | reached |", "|---|---|---|"]
    lines += [f"| {name} | {asked} | {_share(by, of, good)} |" for name, asked, of, good in _FIGURES]
    lines += ["", "## By cause", "", f"| cause | n | {' | '.join(WORDS)} |", "|---|---|" + "---|" * len(WORDS)]
    for cause in sorted({_label(k) for k in kept}):
        counts = Counter(_word(k) for k in kept if _label(k) == cause)
        cells = [str(counts[w] or "") for w in WORDS]
        lines.append(f"| {cause.replace('_', ' ')} | {sum(counts.values())} | {' | '.join(cells)} |")
    lines += ["", "## What is not right", "", *_rest(kept)]
    return "\n".join(lines) + "\n"


def _name(kept: Kept) -> str:
    return str(kept["truth"]["name"])


def _word(kept: Kept) -> str:
    return judge(kept["truth"], kept["answer"])[0]


def _label(kept: Kept) -> str:
    truth = kept["truth"]
    return str(truth["cause"]) if truth["family"] == "unknown" else f"({truth['family']})"


Rule = Callable[[Kept], bool]


def _family(*names: str) -> Rule:
    return lambda k: k["truth"]["family"] in names


def _about(strength: float) -> Rule:
    return lambda k: (
        k["truth"]["family"] == "unknown" and abs(np.log(max(k["truth"]["strength"], 1e-9) / strength)) < 0.3
    )


def _is(*words: str) -> Callable[[str], bool]:
    return lambda word: word in words


_UNKNOWN = _family("unknown", "pair")
_FIGURES: tuple[tuple[str, str, Rule, Callable[[str], bool]], ...] = (
    ("wrong and stated as found", "<= 2 %", _UNKNOWN, _is("wrong, stated")),
    ("wrong and flagged", "", _UNKNOWN, _is("wrong, flagged")),
    ("right, alike or honest", ">= 90 %", _UNKNOWN, _is("right", "alike", "honest")),
    ("right", "", _UNKNOWN, _is("right")),
    ("missed, strength 8", "", _about(8.0), _is("missed")),
    ("missed, strength 15", "<= 5 %", _about(15.0), _is("missed")),
    ("missed, strength 30", "", _about(30.0), _is("missed")),
    ("pairs: right", "", _family("pair"), _is("right")),
    ("controls: right", "", _family("control"), _is("right")),
    ("nulls: anything but nothing", "<= 2 %", _family("null"), _is("wrong, stated", "wrong, flagged")),
)


def _share(kept: Mapping[Any, Kept], of: Rule, good: Callable[[str], bool]) -> str:
    words = [_word(k) for k in kept.values() if of(k)]
    count = sum(map(good, words))
    if not words:
        return "-"
    low, high = wilson(count, len(words))
    return f"{count}/{len(words)} = {count / len(words):.1%} [{low:.1%}, {high:.1%}]"


def _row(cause: str, old: dict[str, Kept], new: dict[str, Kept]) -> str:
    names = [name for name, k in new.items() if _label(k) == cause]
    before, after = Counter(_word(old[n]) for n in names), Counter(_word(new[n]) for n in names)
    cells = [f"{before[w]} → {after[w]}" if before[w] or after[w] else "" for w in WORDS]
    return f"| {cause.replace('_', ' ')} | {len(names)} | {' | '.join(cells)} |"


def _rest(kept: Iterable[Kept]) -> list[str]:
    rows = ["| case | strength | word | what is said |", "|---|---|---|---|"]
    for k in sorted(kept, key=_name):
        word, why = judge(k["truth"], k["answer"])
        if word not in ("right", "alike"):
            rows.append(f"| {_name(k)} | {k['truth']['strength']:.3g} | {word} | {why.replace('|', 'or')} |")
    return rows
