"""The documented estimators and policies over all environments and their scenarios: docs/results/leaderboard.md.

python scripts/leaderboard.py [--runs 64] [--jobs 2] [--only NorthFinder] [--kept out/leaderboard]

What is done is kept in a folder, scenario by scenario: the same command goes on where it was ended, and a scenario is
judged anew when its file there is deleted.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from studies.result_page import Section, table, write

from insenv.core.errors import InputError
from insenv.core.files import write_whole
from insenv.evaluate import words
from insenv.evaluate.evaluation import LIMIT, Evaluation, evaluate

PAGE = Path(__file__).parents[1] / "docs/results/leaderboard.md"
HEAD = """# Leaderboard

The documented estimators under the documented policies, in every packaged scenario that asks for a quantity:
`insenv evaluate` ([judging plug-ins](../evaluate.md)), written by `scripts/leaderboard.py`. All pairs of a scenario
play the same runs;
intervals hold with 95 %. The order is that of the root mean square. `claimed` is the root mean square of the deviations
that the estimator tells: where it is far below the error, as in the scenarios `undeclared`, something is at work that
the datasheet does not declare. Where `claimed` is 3.7e5 arcsec the estimator knows nothing of north: `correlation` and
`revolution` want whole turns at one rate. The bound is that of the first run's motion: a policy that looks at its data
moves otherwise in another run, and efficiency is then a rough figure. Time is that of the instrument; CPU that of one
run with its simulation."""
COLUMNS = ("policy", "estimator", "rms", "claimed", "error / claimed", "efficiency", "time [s]", "CPU [ms]")


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
        ("constant_rate", "bidirectional", "rate_choice", "greedy_north", "horizon_north"),
        {},
        every=1000,
    ),
    "TwoPosition": Board(
        tuple(
            f"two_position/{name}" for name in ("published_a", "published_a2", "published_b", "realistic", "undeclared")
        ),
        ("two_position", "two_position_tied", "two_position_joint"),
        # `greedy_two_position` takes two seconds of CPU time for a run, a hundred times what the others take.
        ("published_schedule", "covariance_triggered", "three_rests", "horizon_two_position"),
        {},
        share=0.5,
        every=10,
    ),
    # At 50 Hz instead of 2 kHz: the noise of a dwell is the same, and a run a fortieth of the work.
    "RateTable": Board(
        tuple(f"rate_table/{name}" for name in ("b215", "b215_lock", "kvh13", "realistic", "undeclared")),
        ("rate_line",),
        (
            *("published_ladder", "optimal_ladder", "van_der_corput", "sweep_and_refine", "greedy_information"),
            *("greedy_rate_table", "horizon_rate_table"),
        ),
        {"instrument.sampling": "50 Hz"},
        share=0.25,
        every=10_000,
    ),
}


def sections(only: str | None, runs: int, jobs: int, kept: Path) -> Iterator[Section]:
    """A part for each scenario: as it was kept, or judged now."""
    kept.mkdir(parents=True, exist_ok=True)
    for environment, board in BOARDS.items():
        for scenario in board.scenarios if only in (None, environment) else ():
            count = max(2, round(runs * board.share))
            file = kept / f"{scenario.replace('/', '_')}_{count}.json"
            if file.exists():
                known = json.loads(file.read_text(encoding="utf-8"))
                yield Section(known["title"], tuple(known["lines"]), known["verdict"])
                continue
            found = _judged(environment, board, scenario, count, jobs)
            write_whole(file, json.dumps(asdict(found), ensure_ascii=False))
            yield found


def _judged(environment: str, board: Board, scenario: str, count: int, jobs: int) -> Section:
    # One after the other the documented ones are trusted: the start of a process costs as much as many runs.
    limit = None if jobs == 1 else LIMIT
    how = (jobs, limit, board.every, board.changes)
    try:
        found = evaluate(environment, board.estimators, board.policies, range(count), scenario, *how)
    except InputError as error:
        return Section(f"{environment}, `{scenario}`", (f"Not judged: {error}.",), "none.")
    return _section(environment, scenario, found)


def _section(environment: str, scenario: str, found: Evaluation) -> Section:
    (quantity, unit), *_ = words.quantities(found)
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
    parser.add_argument("--kept", type=Path, default=Path("out/leaderboard"), help="folder of what is done")
    given = parser.parse_args()
    count = sum(len(board.scenarios) for name, board in BOARDS.items() if given.only in (None, name))
    write(given.page, HEAD, sections(given.only, given.runs, given.jobs, given.kept), count)


if __name__ == "__main__":
    main()
