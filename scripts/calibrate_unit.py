"""A whole unit on its table: estimators, published positions and sequences: docs/results/system_calibration.md.

python scripts/calibrate_unit.py [--runs 64] [--played 200] [--kept FILE.npz] [--loop FOLDER] [--sections FOLDER]

FILE.npz is what `scripts/studies/system_calibration/bound_reached.py --kept` made, FOLDER what `generate.py` and
`judge.py` beside it did. --sections keeps each section, so that what was broken off goes on where it was.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats
from studies.result_page import Section, kept, table, write
from studies.system_calibration import bound_reached, judge

from estimators.system_calibration.orientation import PlannedVisits
from insenv.core.estimate import Policy
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Floats
from insenv.envs.rollout import RollOut, roll_out
from insenv.evaluate.bounds import bounds
from insenv.information.positions import nineteen, six, twenty_four
from insenv.information.unit.directions import parameter_words, sentence, weak_directions
from insenv.information.unit.sequence import Planner, Visit, designed, even, parameter_of_table
from insenv.information.unit.sequence_bound import SequenceBound, sequence_bound
from insenv.scenario import datasheet, load
from insenv.systems.system_calibration.env import system_calibration

PAGE = Path(__file__).parents[1] / "docs/results/system_calibration.md"
SCENARIO = "system_calibration/tactical_fog"
COARSE, HAND = "system_calibration/mems", "system_calibration/hand"
#: White noise is told by the root of a second: fewer samples are the same data.
CHANGES: Mapping[str, Any] = {"instrument.sampling": "20 Hz"}
ESTIMATED_BY = ("batch_gls", "six_position", "multi_position", "system_kalman")
#: Those that need no readings of a table.
WITHOUT_TABLE = ("multi_position", "system_kalman")
#: The rate at which a unit in the hand is sampled, and runs of it.
AS_SAMPLED, FEWER = "50 Hz", 16
#: Searches for a sequence, of which the best is taken, and runs that tell the published filter's deviations.
SEARCHES, OF_FILTER = 3, 8
#: Shares of the 19 positions' time in which sequences are searched for, and orders that each search tries.
SHARES, TRIES = (0.5, 0.7, 0.85, 0.95, 1.0), 1000
#: Chance that a band of all parameters does not hold.
ALPHA = 0.01
#: Runs that are played together.
TOGETHER = 50
HEAD = """# A whole unit on its table

Six instruments with 48 parameters, and 11 errors of the table beside them, by the published 19 positions
(`nineteen_positions`: Xie Bo, Multiposition calibration method of laser gyro SINS, 2011, as the toolbox PSINS simulates
it) and by sequences that were searched for ([designing](../design.md)). Written by `python scripts/calibrate_unit.py
--kept FILE.npz --loop FOLDER`; what makes the file and the folder stands in their sections.
The published sources print accuracies of instruments without their noise; what is reproduced is the
procedure, and its figures for the declared ones. +- are 95 % intervals. Samples a minute are of CPU
time, on a machine that was busy with other work.
"""


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=64)
    parser.add_argument("--played", type=int, default=200)
    parser.add_argument("--kept", type=Path)
    parser.add_argument("--loop", type=Path)
    parser.add_argument("--sections", type=Path)
    asked = parser.parse_args()
    made = _sections(asked.runs, asked.played, asked.kept, asked.loop)
    write(PAGE, HEAD, kept(asked.sections, Path(__file__).resolve(), made), len(made))


def _sections(runs: int, played: int, errors: Path | None, loop: Path | None) -> dict[str, Callable[[], Section]]:
    """Each section by a name of one word."""
    planner = Planner(datasheet(load(SCENARIO)))
    made: dict[str, Callable[[], Section]] = {
        "estimators": partial(_estimators, runs, SCENARIO, "Estimators after the 19 positions"),
        "coarse": partial(_estimators, runs, COARSE, "Estimators of a coarse unit after the 19 positions"),
        "hand": partial(_estimators, runs, HAND, "Estimators of a unit in the hand", WITHOUT_TABLE),
        "sampled": partial(_as_sampled, FEWER),
    }
    if errors is not None:
        made["bound"] = partial(_bound, errors)
    made |= {
        "sequences": partial(_sequences, planner, played),
        "filtered": partial(_as_filtered, planner),
        "untold": partial(_not_told, planner),
    }
    if loop is not None:
        made["loop"] = partial(_loop, loop)
    return made


def _bound(errors: Path) -> Section:
    found = bound_reached.judged(len(np.load(errors)["squares"]), bound_reached.QUICK, errors)
    low, high = found.band()
    return Section(
        "The bound in every parameter",
        (
            "An rms of 200 runs scatters by 5 %: so many say little of each of 48 parameters. Of R runs the sum of",
            "the squares of a parameter's errors over the bound's is chi-squared with R degrees of freedom where the",
            "bound is reached: a band for the true ratio of each, all at once with 99 % (Bonferroni). The errors with",
            "all their correlations are one more number. By `bound_reached.py --kept FILE.npz` in",
            "`scripts/studies/system_calibration` (the 19 positions in half of their time, at a tenth of the samples):",
            "",
            *(f"- {line}" for line in bound_reached.said(found)),
        ),
        f"Over {len(found.errors)} runs the rms errors of `batch_gls` are {found.ratio.min():.3f} to "
        f"{found.ratio.max():.3f} times the bound; the true ratios of all {found.errors.shape[1]} parameters stand "
        f"between {low.min():.3f} and {high.max():.3f} with 99 %. "
        f"z has an rms of {np.sqrt(np.mean((found.errors / found.sd) ** 2)):.3f}.",
    )


def _loop(folder: Path) -> Section:
    rows = judge.rows(folder)
    cases, nulls = ([row for row in rows if bool(row["cause"]) == kind] for kind in (True, False))
    right, false = sum(row["right"] for row in cases), sum(bool(row["added"]) for row in nulls)
    missed = ", ".join(str(row["cause"]).replace("_", " ") for row in cases if not row["right"]) or "nothing"
    return Section(
        "One cause that nobody declared",
        (
            "Recordings by a generator of its own, `scripts/studies/system_calibration/generate.py` (matrices at every",
            "sub-step, numpy alone): 22 to 29 turns of a tactical unit or a MEMS unit on tables of two and three axes,",
            "with one cause that adds 10 standard deviations beside everything that is declared, and without any.",
            "Judged by `judge.py`; the held-out error is the median of the channel with the largest gain. The cases",
            "are fresh, none was looked at while the loop was made: `generate.py FOLDER --first 9000`, and of those",
            "without a cause `--first 9500 --cases 0 --nulls 300`.",
            "",
            *judge.table(rows),
        ),
        f"Of {len(cases)} recordings with a cause {right} ({right / max(len(cases), 1):.0%}) have it named or in the "
        f"set of the effects that it cannot be told from; of {len(nulls)} without one, {false} "
        f"({false / max(len(nulls), 1):.1%}) have an effect. Not found: {missed}.",
    )


def _errors(
    name: str, runs: int, changes: Mapping[str, Any], policy: str | Policy, scenario: str = SCENARIO
) -> tuple[RollOut, Floats, Floats, float]:
    """The last runs, errors and deviations of the unit's parameters, (R, q), and samples a minute."""
    task = system_calibration(scenario, changes)
    estimator, errors, deviations, spent, samples = find(ESTIMATORS, name)(task.datasheet), [], [], 0.0, 0
    for first in range(0, runs, TOGETHER):
        seeds = range(first, min(first + TOGETHER, runs))
        played = roll_out(task, policy, None, seeds)
        if not first:
            estimator.estimate(estimator.update(estimator.reset(), played.recording(0)))  # compiled
        for row in range(len(seeds)):
            begun = time.process_time()
            found = estimator.estimate(estimator.update(estimator.reset(), played.recording(row)))
            spent += time.process_time() - begun
            samples += len(played.recording(row))
            own = [i for i, q in enumerate(found.names) if not parameter_of_table(q)]
            errors.append(found.mean[own] - [played.truth[found.names[i]][row] for i in own])
            deviations.append(found.sd[own])
    return played, np.array(errors), np.array(deviations), 60 * samples / spent


def _estimators(runs: int, scenario: str, title: str, estimated_by: Sequence[str] = ESTIMATED_BY) -> Section:
    chance = 1.96 / np.sqrt(2 * runs)
    rows, said = [], f"By chance alone the rms of z of a parameter in {runs} runs is 1 +- {chance:.2f}."
    for name in estimated_by:
        played, errors, sd, speed = _errors(name, runs, CHANGES, "nineteen_positions", scenario)
        z = errors / sd
        each = np.sqrt(np.mean(z**2, axis=0))
        told = "all"
        if name == "batch_gls":
            task = system_calibration(scenario, CHANGES)
            names = tuple(q.name for q in task.quantities)
            least = bounds(task.datasheet, played.recording(0), names)
            over = np.sqrt(np.mean(errors**2, axis=0)) / [least[n] for n in names]
            said = (
                f"`batch_gls` errs by {over.min():.2f} to {over.max():.2f} times the bound over the parameters of "
                f"{runs} runs, {np.mean(over):.3f} in the mean (chance alone: +- {chance:.2f})."
            )
        told = str(z.shape[1])
        rows.append(
            (
                f"`{name}`", runs, told, f"{np.sqrt(np.mean(z**2)):.3f}",
                f"{each.min():.2f} to {each.max():.2f}", f"{speed / 1e6:.1f}",
            )
        )  # fmt: skip
    header = (
        "estimator",
        "runs",
        "parameters",
        "rms of z",
        "of single parameters",
        "million samples of 20 Hz a minute",
    )
    return Section(title, (f"`{scenario}`:", "", *table(header, rows)), said)


def _as_sampled(runs: int) -> Section:
    """The filter of a unit in the hand, at the scenario's own rate."""
    _, errors, sd, _ = _errors("system_kalman", runs, {"instrument.sampling": AS_SAMPLED}, "nineteen_positions", HAND)
    z = errors / sd
    each = np.sqrt(np.mean(z**2, axis=0))
    return Section(
        "The filter of a unit in the hand at the scenario's own rate",
        (f"`system_kalman`, {runs} runs of `{HAND}` at {AS_SAMPLED}, {z.shape[1]} parameters.",),
        f"rms of z {np.sqrt(np.mean(z**2)):.3f}, of single parameters {each.min():.2f} to {each.max():.2f} (chance "
        f"alone: 1 +- {1.96 / np.sqrt(2 * runs):.2f}).",
    )


@dataclass(frozen=True)
class Beside:
    """Sequences beside deviations that are wanted of the unit's parameters, as shares of the prior, shape (q,)."""

    planner: Planner
    wanted: Floats

    @cached_property
    def bound(self) -> SequenceBound:
        """What no sequence betters."""
        return sequence_bound(self.planner.datasheet)

    def best(self, time: float, tries: int = TRIES) -> tuple[tuple[Visit, ...], Floats]:
        """Of several searches the sequence with the least ratio, and the ratios of all parameters, shape (q,)."""
        found = []
        for seed in range(SEARCHES):
            visits = designed(self.planner, time, self.wanted, tries=tries, seed=seed)
            found.append((visits, self.planner.deviations(visits, time)[: len(self.wanted)] / self.wanted))
        return min(found, key=lambda one: float(np.max(one[1])))

    def row(self, time: float, visits: Sequence[Visit], ratio: Floats) -> tuple[str, ...]:
        """Of the table of sequences."""
        worst = self.planner.model.parameters[int(np.argmax(ratio))].name
        return (
            f"{time:.0f}", str(len(visits)), f"{ratio.max():.3f}", f"{np.median(ratio):.3f}",
            f"{self.bound.ratio(time, self.wanted).bound:.3f}", parameter_words(worst, self.planner.model.gimbals),
        )  # fmt: skip

    def played(self, time: float, visits: Sequence[Visit], runs: int) -> Floats:
        """Root mean square errors of `batch_gls` over so many runs of a sequence, over what is wanted, shape (q,)."""
        changes = {**CHANGES, "duration": f"{time:g} s"}
        policy = PlannedVisits(system_calibration(SCENARIO, changes).datasheet, visits)
        _, errors, _, _ = _errors("batch_gls", runs, changes, policy)
        prior = [q.sd for q in self.planner.model.parameters[: len(self.wanted)]]
        return np.asarray(np.sqrt(np.mean(errors**2, axis=0)) / (self.wanted * prior), float)


HEADER = ("time [s]", "visits", "worst", "median", "bound of the worst", "which is the worst")


def _published(planner: Planner) -> Floats:
    """Deviations of the unit's parameters after the 19 positions, as shares of the prior, shape (q,)."""
    units = sum(not parameter_of_table(q.name) for q in planner.model.parameters)
    duration = planner.datasheet.duration
    return planner.deviations(even(planner, nineteen(planner.model.gimbals), duration), duration)[:units]


def _sequences(planner: Planner, runs: int) -> Section:
    duration, beside = planner.datasheet.duration, Beside(planner, _published(planner))
    found = {share * duration: beside.best(share * duration) for share in SHARES}
    half, own = 0.5 * duration, min((t for t, (_, ratio) in found.items() if ratio.max() <= 1), default=duration)
    short, whole = (beside.played(time, found[time][0], runs) for time in (half, own))
    # Of parameters that are told as well as is wanted: all rms at once are below this.
    most = np.sqrt(stats.chi2.isf(ALPHA / len(beside.wanted), runs) / runs)
    least = beside.bound.time(beside.wanted, duration)
    return Section(
        "Sequences beside the 19 positions",
        (
            "Deviations after a designed sequence over those after the 19 positions in 1200 s, by the full model; the "
            "bound is a certificate ([designing](../design.md)): `insenv design system_calibration/tactical_fog --time "
            '"600 s" --no-verify` prints it.',
            "",
            *table(HEADER, (beside.row(time, *one) for time, one in found.items())),
            "",
            "Asked was half of the time. That is excluded, whatever the order: the certificate says so of all "
            "sequences of right angles. What is reached, and what half of the time gives, was played:",
            "",
            *table(
                ("time [s]", "runs", "rms errors over the 19 positions' deviations", "median", "above chance"),
                (
                    (f"{time:.0f}", runs, f"{rms.min():.2f} to {rms.max():.2f}", f"{np.median(rms):.3f}",
                     f"{np.sum(rms > most)} of {len(rms)}")
                    for time, rms in ((half, short), (own, whole))
                ),
            ),
            "",
            f"Above chance: beyond {most:.2f}, where {ALPHA:.0%} of {runs} runs have any parameter that is told as "
            "well as after the 19 positions.",
        ),
        f"In half of the time no sequence of right angles reaches the 19 positions in every parameter: one is at "
        f"least {beside.bound.ratio(half, beside.wanted).bound:.3f} times worse, and {least:.0f} s are needed. In "
        f"{own:.0f} s, {own / duration:.0%} of the time, the designed sequence reaches them: {runs} runs err by "
        f"{np.median(whole):.2f} times the deviations after the 19 positions in the median, {whole.max():.2f} times at "
        f"worst. In {half:.0f} s {np.mean(found[half][1] <= 1):.0%} of the parameters are as good.",
    )  # fmt: skip


def _as_filtered(planner: Planner) -> Section:
    """How short a sequence may be that is as accurate as the 19 positions in the published filter."""
    duration, published = planner.datasheet.duration, _published(planner)
    prior = np.array([q.sd for q in planner.model.parameters[: len(published)]])
    told = _errors("system_kalman", OF_FILTER, CHANGES, "nineteen_positions")[2]
    beside = Beside(planner, np.sqrt(np.mean(told**2, axis=0)) / prior)
    times = [share * duration for share in (0.5, 0.6, 0.7, 0.8, 0.85)]
    over = beside.wanted / published
    return Section(
        "Sequences beside the published filter",
        (
            "The same, beside what the published filter of the 19 positions (`system_kalman`) states after 1200 s: "
            f"{over.min():.2f} to {over.max():.0f} times the bound, {np.median(over):.2f} times in the median. It "
            "knows biases and scale factors of accelerometers nearly as well as can be: time alone tells them.",
            "",
            *table(HEADER, (beside.row(time, *beside.best(time)) for time in times)),
        ),
        f"Not in half of the time either: {beside.bound.time(beside.wanted, duration):.0f} s are needed at the least "
        "for every parameter to be as good as the published filter knows it.",
    )


def _not_told(planner: Planner) -> Section:
    gimbals, names = planner.model.gimbals, [q.name for q in planner.model.parameters]
    rows: list[tuple[str, str]] = []
    for title, path in (
        ("six", six(gimbals)), ("nineteen", nineteen(gimbals)), ("twenty-four", twenty_four(gimbals)),
    ):  # fmt: skip
        matrix = planner.quick(even(planner, path, planner.datasheet.duration))
        said = [sentence(one, gimbals) for one in weak_directions(matrix, names)]
        rows += [(title, one) for one in said or ["all is told better than it was known"]]
    return Section(
        "What positions do not tell",
        table(("positions", "what is not told"), rows),
        "Directions in which the data tell less than was known before.",
    )


if __name__ == "__main__":
    main()
