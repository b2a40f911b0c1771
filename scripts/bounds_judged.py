"""The Cramer-Rao bound against Monte Carlo of efficient estimators in all three environments: docs/results/bounds.md.

python scripts/bounds_judged.py [--seeds 2000] [--jobs 1]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from studies.bounds.analysis import north_shares, sensitivities, turns_left_out, two_position_shares
from studies.result_page import Section, table, write

from insenv.core.units import ARCMIN, ARCSEC, PPM
from insenv.evaluate.evaluation import evaluate
from insenv.evaluate.scores import QuantityScore

PAGE = Path(__file__).parents[1] / "docs/results/bounds.md"
GLS = "estimators.rate_table.rate_gls:RateGls"
#: What only the datasheet's effects are in; a fiftieth of the readings, for the noise of a dwell is the same.
DECLARED = {"undeclared": {}, "instrument.sampling": "20 Hz"}
#: Without errors of the sight the installation angle is known as well as the inertial part.
NO_SIGHT = {"sight.tracking": "0 arcsec", "sight.position_error": "0 m"}
HEAD = """# The bound against Monte Carlo

How far the Cramér-Rao bound of a procedure, computed without a sample, is from what the best documented estimator does
in simulation: `insenv evaluate` on scenarios whose effects are all declared. This page is written by

```sh
python scripts/bounds_judged.py --seeds {seeds}
```

The bounds are those of [judging plug-ins](../evaluate.md): `insenv.information.fisher`, `insenv.information.alignment`,
`insenv.information.scale_factor`. +- are 95 % intervals; with R runs that of a ratio is about 1.39 / sqrt(R).
`claimed / bound` is the deviation that the estimator claims over the bound: what it leaves unused by choice."""


@dataclass(frozen=True)
class Case:
    """A procedure that is judged; ``share``: of the seeds that are asked for."""

    environment: str
    scenario: str
    policy: str
    estimators: tuple[str, ...]
    said: str
    unit: tuple[float, str]
    changes: Mapping[str, Any] = field(default_factory=dict)
    share: float = 1.0


def _north(policy: str, said: str, **changes: Any) -> Case:
    named = {name.replace("__", "."): value for name, value in changes.items()}
    return Case(
        "NorthFinder", "north_finder/published", policy, ("north_gls",), said, (ARCSEC, "arcsec"), named, share=2.0
    )


def _vehicle(noise: str, said: str, sampling: str = "20 Hz", share: float = 1.0) -> Case:
    scenario, changes = f"two_position/published_{noise}", {**NO_SIGHT, "instrument.sampling": sampling}
    return Case(
        "TwoPosition", scenario, "published_schedule", ("two_position_joint",), said, (ARCMIN, "arcmin"), changes
    )


def _rate(scenario: str, policy: str, said: str, share: float = 1.0, **changes: Any) -> Case:
    return Case(
        "RateTable",
        f"rate_table/{scenario}",
        policy,
        (GLS, "rate_line"),
        said,
        (PPM, "ppm"),
        {**DECLARED, **changes},
        share,
    )


CASES = (
    _north("constant_rate", "10 deg/s one way, 300 s"),
    _north("bidirectional", "10 deg/s both ways, 300 s"),
    _north("bidirectional", "the same in 60 s", duration="60 s"),
    _vehicle("a", "noise A"),
    _vehicle("a2", "noise A2"),
    _vehicle("a2", "noise A2, 100 Hz", "100 Hz", 2.0),
    _vehicle("b", "noise B"),
    _rate("b215", "published_ladder", "B-215, the paper's 36 rates", 0.2),
    _rate("b215", "sweep_and_refine", "B-215, a sweep and dwells", 0.2),
    _rate("b215", "optimal_ladder", "B-215, two rates, 300 s", duration="300 s"),
    _rate("kvh13", "optimal_ladder", "KVH-13, two rates, 300 s", duration="300 s"),
)


def judged(seeds: int, jobs: int) -> Iterator[Section]:
    """A table for each environment, then the analyses."""
    for environment, title in (("NorthFinder", "North"), ("TwoPosition", "Two positions"), ("RateTable", "Rate table")):
        rows: list[tuple[str, ...]] = []
        best: list[QuantityScore] = []
        for case in (case for case in CASES if case.environment == environment):
            found = list(_scores(case, max(2, round(case.share * seeds)), jobs))
            rows += [_row(case, name, runs, score) for name, runs, score in found]
            best.append(found[0][2])
        name = next(case.estimators[0] for case in CASES if case.environment == environment).rpartition(":")[2]
        yield Section(title, table(HEADER, rows), _verdict(name, best))
    yield north_shares()
    yield two_position_shares()
    yield turns_left_out()
    yield sensitivities()


HEADER = ("procedure", "estimator", "runs", "bound", "rms", "rms / bound", "claimed / bound", "rms z")
#: The agreement that is asked for.
NEAR = 0.05


def _scores(case: Case, runs: int, jobs: int) -> Iterator[tuple[str, int, QuantityScore]]:
    found = evaluate(
        case.environment,
        case.estimators,
        (case.policy,),
        range(runs),
        case.scenario,
        jobs,
        limit=600.0,
        every=1_000_000,
        changes=case.changes,
    )
    for one in found.scored:
        if one.fault:
            raise SystemExit(one.fault)
        yield one.estimator.rpartition(":")[2], one.runs, one.scores[0]


def _share(value: float, score: QuantityScore) -> float:
    assert score.bound is not None
    return value / score.bound


def _row(case: Case, name: str, runs: int, score: QuantityScore) -> tuple[str, ...]:
    size, unit = case.unit
    (rms, half), bound = score.rms, score.rms[0] / _share(score.rms[0], score)
    return (
        f"{case.said} (`{case.policy}`)",
        f"`{name}`",
        str(runs),
        f"{bound / size:.3g} {unit}",
        f"{rms / size:.3g} ± {half / size:.2g} {unit}",
        f"{_share(rms, score):.3f} ± {_share(half, score):.3f}",
        f"{_share(score.told, score):.3f}",
        f"{score.spread[0]:.3f} ± {score.spread[1]:.3f}",
    )


def _verdict(name: str, scores: Sequence[QuantityScore]) -> str:
    """How many procedures are within 5 %, by the error and by what is claimed; the intervals that hold no 5 %."""
    ratios = [(_share(s.rms[0], s), _share(s.rms[1], s)) for s in scores]
    within = sum(abs(ratio - 1) <= NEAR for ratio, _ in ratios)
    apart = sum(abs(ratio - 1) - half > NEAR for ratio, half in ratios)
    told = sum(abs(_share(s.told, s) - 1) <= NEAR for s in scores)
    return (
        f"The rms error of `{name}` is within {NEAR:.0%} of the bound in {within} of {len(scores)} procedures and "
        f"significantly beyond in {apart}; the deviation that it claims, a figure without chance, in {told}."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=2000)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--page", type=Path, default=PAGE)
    given = parser.parse_args()
    write(given.page, HEAD.format(seeds=given.seeds), judged(given.seeds, given.jobs), 7)
    print(given.page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
