"""The documented policies under the reward of today and under the one before it: docs/results/reward.md.

python scripts/studies/learning/order.py [--share 1.0] [--page PAGE]

Both returns are computed from the same runs: the last belief, the true error and the time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from insenv.core.recording import Floats
from insenv.envs.belief import Judge, judge
from insenv.envs.rollout import roll_out
from insenv.evaluate.runs import task_of

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "scripts"))
from studies.result_page import Section, table, write  # noqa: E402 - of the folder above

PAGE = ROOT / "docs/results/reward.md"
HEAD = """# The reward, before and now

The reward of the [environments](../environments.md) was the information won less the square of the last error in
demanded deviations, which is no proper score. Now a run earns the logarithmic score of the truth and a bounded price of
the error. Written by `python scripts/studies/learning/order.py`; intervals hold with 95 %.
"""
NORTH = ("constant_rate", "bidirectional", "rate_choice", "greedy_north", "horizon_north")
TWO = ("published_schedule", "covariance_triggered", "three_rests", "horizon_two_position")
RATE = ("published_ladder", "optimal_ladder", "van_der_corput", "sweep_and_refine", "greedy_information")
#: What an estimator multiplies its deviations by.
FACTORS = (1.0, 0.5, 2.0, 1e-3, 1e-6)


@dataclass(frozen=True)
class Board:
    """What is played: estimator, policies, runs, steps between estimates, other values of the scenario's entries."""

    estimator: str
    policies: tuple[str, ...]
    runs: int
    every: int = 1
    changes: dict[str, str] = field(default_factory=dict)


BOARDS = {
    "two_position/published_a2": Board("two_position_joint", TWO, 64, 1, {"instrument.sampling": "20 Hz"}),
    "two_position/realistic": Board("two_position_joint", TWO, 32, 1, {"instrument.sampling": "20 Hz"}),
    "north_finder/published": Board("north_gls", NORTH, 48, 10),
    "north_finder/realistic": Board("north_gls", NORTH, 48, 10),
    "rate_table/b215": Board(
        "rate_line", (*RATE, "greedy_rate_table", "horizon_rate_table"), 16, 100, {"instrument.sampling": "50 Hz"}
    ),
}


@dataclass(frozen=True)
class Played:
    """Last beliefs of some runs, of one quantity."""

    judge: Judge
    means: Floats
    deviations: Floats
    truth: dict[str, Floats]
    first: Floats
    paid: Floats

    def now(self, factor: float = 1.0) -> Floats:
        """Return of an estimator that tells ``factor`` times its deviation."""
        sd = self.told(factor)
        return self.judge.information(sd) + self.judge.verdict(self.means, sd, self.truth) - self.paid

    def before(self, factor: float = 1.0) -> Floats:
        """The same under the former reward."""
        (q,) = self.judge.quantities
        error = q.error(self.means[:, 0], self.truth[q.name])
        found: Floats = np.log(self.first / self.told(factor)[:, 0]) - (error / q.demanded) ** 2 - self.paid
        return found

    def told(self, factor: float) -> Floats:
        """Deviations within what is shown."""
        (q,) = self.judge.quantities
        return np.clip(factor * self.deviations, 1e-12 * q.prior, q.prior)


def played(scenario: str, policy: str, share: float) -> Played:
    board = BOARDS[scenario]
    task = task_of(scenario, board.changes)
    runs = max(2, round(share * board.runs))
    rolled = roll_out(task, policy, board.estimator, range(runs), keep=False, every=board.every)
    last = np.rint(rolled.time / task.step_s).astype(int)
    at = (np.arange(runs), last)
    watched = judge(board.estimator, task.datasheet, task.quantities)
    paid = task.cost * rolled.time
    return Played(
        watched, rolled.means[at], rolled.deviations[at], dict(rolled.truth), rolled.deviations[:, 0, 0], paid
    )


def shown(values: Floats) -> str:
    return f"{values.mean():.2f} ± {1.96 * values.std(ddof=1) / len(values) ** 0.5:.2f}"


def honesty(share: float) -> Section:
    one = played("north_finder/published", "bidirectional", share)
    rows = [(f"{factor:g}", shown(one.before(factor)), shown(one.now(factor))) for factor in FACTORS]
    lines = (
        f"`north_finder/published`, `north_gls` under `bidirectional`, {len(one.paid)} runs; the estimator multiplies "
        "the deviation that it has by a factor before it tells it.",
        "",
        *table(("factor", "return before", "return now"), rows),
    )
    best_before = max(FACTORS, key=lambda factor: float(one.before(factor).mean()))
    best = max(FACTORS, key=lambda factor: float(one.now(factor).mean()))
    return Section("Honesty", lines, f"The factor that paid best was {best_before:g}; now it is {best:g}.")


def order(scenario: str, share: float) -> Section:
    board = BOARDS[scenario]
    found = {policy: played(scenario, policy, share) for policy in board.policies}
    rows = [(f"`{policy}`", shown(one.before()), shown(one.now())) for policy, one in found.items()]
    ranks = [sorted(found, key=lambda p: -float(getattr(found[p], name)().mean())) for name in ("before", "now")]
    runs = len(next(iter(found.values())).paid)
    verdict = (
        "The order is the same." if ranks[0] == ranks[1] else f"Before: {_listed(ranks[0])}. Now: {_listed(ranks[1])}."
    )
    lines = (f"`{board.estimator}`, {runs} runs.", "", *table(("policy", "return before", "return now"), rows))
    return Section(f"`{scenario}`", lines, verdict)


def _listed(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--share", type=float, default=1.0, help="of the runs")
    parser.add_argument("--page", type=Path, default=PAGE)
    given = parser.parse_args()

    def sections() -> Iterator[Section]:
        yield honesty(given.share)
        for scenario in BOARDS:
            yield order(scenario, given.share)

    write(given.page, HEAD, sections(), 1 + len(BOARDS))


if __name__ == "__main__":
    main()
