"""The documented estimators and policies over all environments and their scenarios: docs/results/leaderboard.md.

python scripts/leaderboard.py [--runs 64] [--jobs 2] [--only NorthFinder]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from result_page import Section, table, write

from insenv.core.errors import InputError
from insenv.evaluate import words
from insenv.evaluate.evaluation import Evaluation, evaluate

PAGE = Path(__file__).parents[1] / "docs/results/leaderboard.md"
HEAD = """# Leaderboard

The documented estimators under the documented policies, in every packaged scenario that asks for a quantity:
`insenv evaluate` ([](../evaluate.md)), written by `scripts/leaderboard.py`. All pairs of a scenario play the same runs;
intervals hold with 95 %. The order is that of the root mean square. `told` is the root mean square of the deviations
that the estimator tells: where it is far below the error, as in the scenarios `undeclared`, something is at work that
the datasheet does not declare. Time is that of the instrument; CPU that of one run with its simulation."""
COLUMNS = ("policy", "estimator", "rms", "told", "spread of z", "efficiency", "time [s]", "CPU [ms]")


@dataclass(frozen=True)
class Board:
    """What is judged in an environment; ``changes``: of every scenario; ``share``: of the runs that are asked for."""

    scenarios: tuple[str, ...]
    estimators: tuple[str, ...]
    policies: tuple[str, ...]
    changes: dict[str, Any]
    share: float = 1.0
    every: int = 1


BOARDS = {
    "NorthFinder": Board(
        ("north_finder/published", "north_finder/realistic", "north_finder/undeclared"),
        ("correlation", "revolution", "north_gls"),
        ("constant_rate", "bidirectional", "rate_choice"),
        {},
        every=1000,
    ),
    "TwoPosition": Board(
        tuple(
            f"two_position/{name}" for name in ("published_a", "published_a2", "published_b", "realistic", "undeclared")
        ),
        ("two_position", "two_position_tied", "two_position_joint"),
        ("published_schedule", "covariance_triggered", "three_rests"),
        {},
        every=10,
    ),
    # At 50 Hz instead of 2 kHz: the noise of a dwell is the same, and a run a fortieth of the work.
    "RateTable": Board(
        tuple(f"rate_table/{name}" for name in ("b215", "b215_lock", "kvh13", "realistic", "undeclared")),
        ("rate_line",),
        ("published_ladder", "optimal_ladder", "van_der_corput", "sweep_and_refine", "greedy_information"),
        {"instrument.sampling": "50 Hz"},
        share=0.25,
        every=10_000,
    ),
}


def sections(only: str | None, runs: int, jobs: int) -> Iterator[Section]:
    for environment, board in BOARDS.items():
        for scenario in board.scenarios if only in (None, environment) else ():
            count = max(2, round(runs * board.share))
            try:
                found = evaluate(
                    environment,
                    board.estimators,
                    board.policies,
                    range(count),
                    scenario,
                    jobs,
                    limit=600.0,
                    every=board.every,
                    changes=board.changes,
                )
            except InputError as error:
                yield Section(f"{environment}, `{scenario}`", (f"Not judged: {error}.",), "none.")
                continue
            yield _section(environment, scenario, found)


def _section(environment: str, scenario: str, found: Evaluation) -> Section:
    (quantity, unit), *_ = words.asked(found)
    places = [words.HEADER.index(name) for name in COLUMNS]
    order = sorted(
        (s.rms[0], one.policy, one.estimator) for one in found.scored for s in one.scores if s.quantity == quantity
    )
    by_pair = {(row[0], row[1]): row for row in words.rows(found, quantity)}
    rows = [tuple(by_pair[p, e][j].replace("+-", "±") for j in places) for _, p, e in order]
    lines = [f"`{quantity}` [{words.shown(unit)[0]}], {found.count} runs.", "", *table(COLUMNS, rows)]
    if least := words.bound(found, quantity):
        lines += ["", f"Cramér-Rao bound of the deviation by policy: {least}."]
    for fault in found.faults:
        lines += ["", f"Without a result: {fault}."]
    _, policy, estimator = order[0]
    best = by_pair[policy, estimator]
    told = f"`{estimator}` under `{policy}`: {best[4].replace('+-', '±')} {words.shown(unit)[0]} in {best[9]} s."
    return Section(f"{environment}, `{scenario}`", tuple(lines), f"Best: {told}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=64)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", choices=tuple(BOARDS))
    parser.add_argument("--page", type=Path, default=PAGE)
    given = parser.parse_args()
    count = sum(len(board.scenarios) for name, board in BOARDS.items() if given.only in (None, name))
    write(given.page, HEAD, sections(given.only, given.runs, given.jobs), count)


if __name__ == "__main__":
    main()
