"""Outcomes of the search study, and the page of Markdown that says them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest


@dataclass(frozen=True)
class Case:
    """An effect that nobody declared, the profile that shows it, and the ranges of its shapes (SI)."""

    key: str
    profile: str
    shapes: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Job:
    """One recording: ``case`` of strength ``snr``, or None for a complete declared model."""

    profile: str
    seed: tuple[int, ...]
    case: Case | None = None
    snr: float = 0.0


@dataclass(frozen=True)
class Found:
    """What was added, the first one's rivals and p-value, and held-out error after over before."""

    job: Job
    names: tuple[str, ...]
    rivals: tuple[str, ...]
    p_value: float
    ratio: float


PAGE = """\
# How often the search is right

A Monte Carlo study of `insenv close-loop` on simulated recordings. This page is written by

```sh
{command}
```

Each recording is a gyro of {n} samples at {rate:g} Hz ({hours:g} h); the last {held:g} % is held out. Drawn anew for
each: the profile's rates, temperature (warm-up of 2 to 10 K, slow swing of 1 to 4 K, measured with 0.02 K of noise),
bias (5 deg/h, 1 sigma), scale factor (300 ppm, 1 sigma), and the noise, evenly in the logarithm:

| noise | from | to |
|---|---|---|
| angle random walk | 0.3 deg/h/sqrt(Hz) = 0.005 deg/sqrt(h) | 1.2 deg/h/sqrt(Hz) = 0.02 deg/sqrt(h) |
| bias instability | 0.02 deg/h | 0.3 deg/h |
| rate random walk | 0.0005 deg/h/sqrt(s) = 0.03 deg/h/sqrt(h) | 0.015 deg/h/sqrt(s) = 0.9 deg/h/sqrt(h) |

Bias and scale factor are declared (at rest the bias alone), noise figures are not. The whole catalogue is tried, with
the settings that the command has by default.
Brackets hold exact (Clopper-Pearson) 95 % intervals.

## False discoveries

{nulls} recordings that the declared model explains completely, in turn on the profiles
{profiles}.

{false}

## Detection and naming

One effect that is not declared: {cases} cases, {seeds} recordings of each, the same ones at each strength. The strength
**snr** is the norm of the effect's whitened means over {mean:g} s on the fitted rows, with the true noise, after
projection on the declared model: the mean deviate of a test that knew the noise, the effect and its shape.

{shares}

The order of an effect counts: `bias_temperature:2` instead of `bias_temperature:1` is a wrong name.

## Case by case

Of {seeds} recordings: detected / named first / named first or among the rivals of the first.

{table}

## What this does not show

* Library and simulator have the same effects, so shapes are exact; the noise is Gaussian, stationary and of the
  modelled kinds. Real instruments follow neither: expect more false discoveries and more wrong names there.
* One gyro, one run, one length of recording, at most one missing effect. Nothing is said of triads, accelerometers,
  several runs, declared noise, or effects that are not in the table.
* The mix of cases is a choice: shares over all of them are no probabilities for an instrument. Single rows of the
  last table rest on {seeds} recordings.
"""


def is_first(found: Found) -> bool:
    return found.job.case is not None and found.names[:1] == (found.job.case.key,)


def is_listed(found: Found) -> bool:
    return is_first(found) or (found.job.case is not None and found.job.case.key in found.rivals)


def is_wrong(found: Found) -> bool:
    return bool(found.names) and not is_listed(found)


MEASURES: tuple[tuple[str, Callable[[Found], bool]], ...] = (
    ("detected: anything added", lambda f: bool(f.names)),
    ("named first", is_first),
    ("named first, or among the rivals of the first", is_listed),
    ("wrong name, the true one not among its rivals", is_wrong),
    ("of these, a generic curve, which names no cause", lambda f: is_wrong(f) and f.names[0].startswith("spline_")),
    ("further effects beside the first", lambda f: len(f.names) > 1),
    ("held-out error grew", lambda f: f.ratio > 1),
)


def share(count: int, total: int) -> str:
    """Count with its share and the exact (Clopper-Pearson) 95 % interval."""
    ci = binomtest(count, total).proportion_ci(0.95, "exact")
    return f"{count} of {total}: {100 * count / total:.1f} % ({100 * ci.low:.1f} to {100 * ci.high:.1f})"


def tally(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" + (f" x {n}" if n > 1 else "") for name, n in Counter(names).most_common()) or "-"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    return "\n".join("| " + " | ".join(map(str, row)) + " |" for row in (head, ["---"] * len(head), *rows))


def false_discoveries(found: Sequence[Found], alpha: float) -> str:
    false = [f for f in found if f.names]
    said = f"Something was added to {share(len(false), len(found))}; `alpha` aims at {100 * alpha:g} %."
    rows = [(f.job.profile, tally(f.names), f"{f.p_value:.2g}") for f in false]
    return said + ("\n\n" + table(("profile", "added", "p-value of the first"), rows) if rows else "")


def shares(found: Sequence[Found], snrs: Sequence[float]) -> str:
    columns = [[f for f in found if f.job.snr == snr] for snr in snrs]
    rows = [(name, *(share(sum(map(holds, c)), len(c)) for c in columns)) for name, holds in MEASURES]
    medians = [f"{np.median([f.ratio for f in c if f.names] or [np.nan]):.3f}" for c in columns]
    rows.append(("median held-out error, after / before, where detected", *medians))
    return table(("recordings in which", *(f"snr {snr:g}" for snr in snrs)), rows)


def case_by_case(found: Sequence[Found], snrs: Sequence[float]) -> str:
    rows = []
    for case in dict.fromkeys(f.job.case for f in found if f.job.case):
        row = [f"`{case.key}`", case.profile]
        for snr in snrs:
            own = [f for f in found if f.job.case == case and f.job.snr == snr]
            counts = (sum(map(counted, own)) for counted in (lambda f: bool(f.names), is_first, is_listed))
            row += [" / ".join(map(str, counts)), tally([f.names[0] for f in own if is_wrong(f)])]
        rows.append(row)
    return table(("effect", "profile", *(name for snr in snrs for name in (f"snr {snr:g}", "wrong names"))), rows)


def page(found: Sequence[Found], snrs: Sequence[float], alpha: float, **facts: object) -> str:
    """The page; ``facts`` fill what the template says of the set-up."""
    nulls, others = [f for f in found if f.job.case is None], [f for f in found if f.job.case is not None]
    parts = {
        "nulls": len(nulls),
        "false": false_discoveries(nulls, alpha),
        "shares": shares(others, snrs),
        "table": case_by_case(others, snrs),
    }
    return PAGE.format(**parts, **facts)
