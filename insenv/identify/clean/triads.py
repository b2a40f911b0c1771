"""One axis of a triad that turns: which declared effects are meant for it, and which rows it is better off without.

While a vehicle turns, its lever arms accelerate and its sway tilts the turn's rate into the level axes: none of that is
an error of an instrument. Accelerometers are left out of every turn, unless a table turns for most of the time: what a
unit feels there is what it was put on the table for. A level gyro keeps it, for the turn shows its
misalignment, unless it shakes: the median step from bin to bin is then larger than `SHAKEN` times that at rest, beside
what follows the turn as an error of the instrument would.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.motion import Motion
from insenv.core.recording import Floats, Recording
from insenv.data.manifest.spec import Manifest
from insenv.data.reference import is_set
from insenv.data.split import RowUse
from insenv.effects.base import Effect, Instrument
from insenv.identify.findings import RejectedRows
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Model, Problem

#: Ratio of the median steps from bin to bin in turns and at rest from which on an axis shakes.
SHAKEN = 2.0
#: Rate of the table above which it turns [rad/s]: some tens of the Earth's.
LEAST_RATE = 2e-3
#: Share of the rows from which on turns are what a recording is of.
MOSTLY = 0.5


def of_others(
    manifest: Manifest, recordings: tuple[Recording, ...], target: str, effect: Effect, motions: list[Motion]
) -> bool:
    """Whether a declared effect is meant for other targets of a triad that turns: gyros, accelerometers, level axes."""
    if not all(r.mounting.table_axis for r in recordings):
        return False
    if _instrument(target) not in effect.instruments:
        return any(_instrument(other) in effect.instruments for other in manifest.model.targets)
    # Along the vertical there is no horizontal part, across it no rate of the turn.
    share = abs(motions[0].projection)
    return share > 0.5 if effect.of_earth else effect.of_rate and share < 0.5


def _instrument(target: str) -> Instrument:
    return "accelerometer" if target.startswith("accel") else "gyro"


def without_turns(
    recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], problem: Problem, model: Model
) -> tuple[RowUse, ...]:
    """The uses of the rows for this target: ``uses`` themselves where nothing is left out."""
    if not all(r.mounting.table_axis for r in recordings):
        return uses
    levels = problem.target.startswith("gyro") and all(abs(e.motion.projection) < 0.5 for e in problem.exposures)
    if not problem.target.startswith("accel") and not (levels and _shakes(problem, model)):
        return uses
    still = [~turning(recording) for recording in recordings]
    if not levels and sum(map(np.sum, still)) < (1 - MOSTLY) * sum(map(len, still)):
        return uses
    kept = tuple(replace(u, fit=u.fit & s, held_out=u.held_out & s) for u, s in zip(uses, still, strict=True))
    return kept if all(u.fit.any() for u in kept) and any(u.held_out.any() for u in kept) else uses


def turns_left_out(recordings: tuple[Recording, ...], target: str) -> tuple[RejectedRows, ...]:
    """The turns that a level gyro that shakes is judged without; none of an accelerometer, which never has them."""
    if not target.startswith("gyro"):
        return ()
    edges = [np.flatnonzero(np.diff(np.concatenate([[0], turning(r).astype(np.int8), [0]]))) for r in recordings]
    return tuple(
        RejectedRows(target, run, start, stop, "a turn in which the axis shakes")
        for run, at in enumerate(edges)
        for start, stop in at.reshape(-1, 2).tolist()
    )


def turning(recording: Recording) -> NDArray[np.bool_]:
    """Rows whose interval, or the one after, is one of a turn, shape (rows,)."""
    if is_set(recording):
        return np.zeros(len(recording), bool)
    if "table_angle" in recording.channels:
        steps = np.abs(np.diff(recording.channels["table_angle"].values)) / np.diff(recording.t)
    else:
        steps = np.abs(recording.channels["table_rate"].values[1:])
    moves = np.concatenate([steps > LEAST_RATE, [False]])
    moves[1:] |= steps > LEAST_RATE
    return moves


def _shakes(problem: Problem, model: Model) -> bool:
    """Whether the residual jumps more in turns than at rest, beside all that follows the turn itself.

    What is proportional to the rate of the turn, to its magnitude, square or change, or a wave of its angle is an error
    of the instrument, however large, and no shaking.
    """
    edges = [e.motion.angle for e in problem.exposures]
    known = [a for a in edges if a is not None]
    if len(known) < len(edges):
        return False
    rates = tuple(np.diff(a) / problem.exposures[0].motion.dt for a in known)
    rate = problem.bins.mean(rates)
    angle = problem.bins.mean(tuple(0.5 * (a[1:] + a[:-1]) for a in known))
    left = problem.y - solve(problem, model).predicted()
    inside = np.abs(rate) > LEAST_RATE
    both, none = inside[1:] & inside[:-1], ~(inside[1:] | inside[:-1])
    if both.sum() < 8 or none.sum() < 8:
        return False
    steps = np.abs(np.diff(left - _of_the_turn(problem, left, rate, angle, inside)))
    return float(np.median(steps[both])) > SHAKEN * float(np.median(steps[none]))


def _of_the_turn(problem: Problem, left: Floats, rate: Floats, angle: Floats, inside: NDArray[np.bool_]) -> Floats:
    """What of a residual follows the turns, shape (bins,); zero at rest."""
    change = np.gradient(rate)
    columns = [rate, np.abs(rate), rate**2, rate**3, change, np.cos(angle), np.sin(angle)]
    columns += [problem.bins.run == run for run in np.unique(problem.bins.run)]
    design = np.column_stack(columns).astype(float) * inside[:, None]
    design = design[:, np.linalg.norm(design, axis=0) > 0]
    design = design / np.linalg.norm(design, axis=0)
    return np.asarray(design @ np.linalg.lstsq(design, left * inside, rcond=1e-8)[0], np.float64)
