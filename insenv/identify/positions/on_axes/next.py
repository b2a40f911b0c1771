r"""The next run of a unit on its table that would tell apart what this one does not.

    delta = min over b, beta of || L^-1 (X_a theta_a - X_b b - [X D] beta) ||

over the cells of the recorded runs and of a planned one, with what was found of a and the priors of the table's errors:
what would be left, in standard deviations, if another effect stood in the place of the added one. Planned are the same
turns once more, right angles, half of them, and the unit remounted, turned by 90 deg on the innermost axis, whose seat
is then another one. Only the shape of the proposals is fixed; rates are those of the recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from insenv.core.estimate import Limits
from insenv.core.recording import Floats, Recording
from insenv.core.unit.gimbals import Gimbals, turn_time
from insenv.identify.findings import NextExperiment, Pair
from insenv.identify.positions.least_squares import Fit
from insenv.identify.positions.on_axes.problem import Cells, OnAxes, UnitTerm
from insenv.information.positions import Angles, twenty_four
from insenv.information.unit.calibration import BLOCK, Blocks, UnitModel
from insenv.information.unit.sequence import Planner, Visit

#: Rest at each planned position [s], and how many positions there are.
DWELL, POSITIONS = 20.0, 24
#: Limits where the recording shows none [rad/s], [rad/s^2].
_RATE, _ACCELERATION = 0.1, 0.1


@dataclass(frozen=True)
class PlannedRun:
    """A run that was not recorded: its words, its model with its table, and its visits."""

    words: str
    model: UnitModel
    visits: tuple[Visit, ...]

    def blocks(self) -> Blocks:
        """Of its motion, from the first position on."""
        limits, angles = self.model.sheet.limits, np.array([visit.angles for visit in self.visits])
        turning = turn_time(np.diff(angles, axis=0), limits.rate, limits.acceleration).sum(axis=-1)
        time = float(np.ceil(turning / BLOCK).sum()) * BLOCK + DWELL * len(self.visits)
        return Planner(self.model.sheet).planned(self.visits[0].angles, self.visits, time)


def plans(model: UnitModel, limits: Limits) -> tuple[PlannedRun, ...]:
    """What is proposed on a table of ``model``."""
    sheet = replace(model.sheet, sampling=10.0, limits=limits)
    here, gimbals = UnitModel(sheet, in_turns=True), model.gimbals
    turned = replace(gimbals, mounted=gimbals.mounted + np.pi / 2)
    there = UnitModel(replace(sheet, mounting=replace(sheet.mounting, gimbals=turned)), in_turns=True)
    right, half = _rests(twenty_four(gimbals)), _rests(half_way(gimbals))
    return (
        PlannedRun("half-way: " + spelled(half), here, half),
        PlannedRun("right angles: " + spelled(right), here, right),
        PlannedRun(
            "the unit remounted, turned by 90 deg about its z (mounted = 90 deg), right angles: " + spelled(right),
            there,
            right,
        ),
    )


def half_way(gimbals: Gimbals) -> tuple[Angles, ...]:
    """Steps of 45 deg, one axis after the other, those of the inner axes oftener."""
    k, found = len(gimbals.axes), []
    now = np.zeros(k)
    for i in range(POSITIONS):
        axis = k - 1 if i % 3 else max(k - 2 - (i // 3) % max(k - 1, 1), 0)
        now = now.copy()
        now[axis] = now[axis] + np.pi / 4
        now[axis] -= 2 * np.pi * (now[axis] > np.pi)
        found.append(tuple(float(a) for a in now))
    return tuple(found)


def _rests(path: Sequence[Angles]) -> tuple[Visit, ...]:
    return tuple(Visit(at, DWELL) for at in path[:POSITIONS])


def spelled(visits: Sequence[Visit]) -> str:
    """Angles of the axes in degrees, from the outer to the inner."""
    return "; ".join(" ".join(f"{np.degrees(a) + 0.0:.0f}" for a in visit.angles) for visit in visits) + " deg"


def limits_of(recordings: Sequence[Recording]) -> Limits:
    """Rates and accelerations that the axes showed."""
    rate, acceleration = _RATE, _ACCELERATION
    for run in recordings:
        step = max(1, round(0.5 / run.dt))
        for name, channel in run.channels.items():
            if name.startswith("axis_"):
                rates = np.diff(channel.values[::step]) / (step * run.dt)
                rate = max(rate, float(np.abs(rates).max(initial=0.0)))
                acceleration = max(acceleration, float(np.abs(np.diff(rates)).max(initial=0.0)) / (step * run.dt))
    return Limits(rate, acceleration)


def next_runs(
    problem: OnAxes,
    after: Fit,
    sets: Sequence[tuple[UnitTerm, Sequence[UnitTerm]]],
    planned: Sequence[tuple[PlannedRun, Sequence[Cells]]],
) -> tuple[NextExperiment, ...]:
    """Of each set of an added term and its rivals the planned runs, those that tell them best first."""
    found = []
    for term, rivals in sets:
        rows = []
        for plan, cells in [(None, ()), *planned]:
            whole = [*problem.cells, *cells]
            sizes = [*problem.sizes, *(_size(problem, cell.channel) for cell in cells)]
            pairs = tuple(
                Pair(
                    (term.effect.id, rival.effect.id),
                    _separation(whole, sizes, problem.nuisance, after, (term, rival)),
                )
                for rival in rivals
            )
            rows.append((min(pair.sigma for pair in pairs), plan, pairs))
        keys = tuple(dict.fromkeys((term.effect.id, *(rival.effect.id for rival in rivals))))
        for sigma, plan, pairs in sorted(rows[1:], key=lambda row: -row[0]):
            assert plan is not None
            found.append(NextExperiment(keys, plan.words, sigma, pairs=pairs))
    return tuple(found)


def _size(problem: OnAxes, channel: int) -> float:
    return next(s for s, c in zip(problem.sizes, problem.cells, strict=True) if c.channel == channel)


def _separation(
    cells: Sequence[Cells], sizes: Sequence[float], prior: Floats, after: Fit, pair: tuple[UnitTerm, UnitTerm]
) -> float:
    term, rival = pair
    model = [*(t for t in after.terms if t is not term), rival]
    places = [j for t in model for j in t.at]
    parts = []
    for cell, size in zip(cells, sizes, strict=True):
        effect = cell.columns[:, list(term.at)] @ after.theta[after.of(term)]
        data = np.column_stack([effect, cell.columns[:, places], cell.nuisance])
        root = cholesky(cell.covariance, lower=True) * size
        parts.append(solve_triangular(root, data, lower=True, check_finite=False))
    white, q = np.concatenate(parts), len(prior)
    rows = np.hstack([np.zeros((q, 1 + len(places))), np.diag(1 / prior)]) if q else np.zeros((0, white.shape[1]))
    whole = np.vstack([white, rows])
    design = whole[:, 1:]
    width = np.linalg.norm(design, axis=0)
    scaled = design / np.where(width > 0, width, 1.0)
    left = whole[:, 0] - scaled @ np.linalg.lstsq(scaled, whole[:, 0], rcond=1e-9)[0]
    return float(np.linalg.norm(left))
