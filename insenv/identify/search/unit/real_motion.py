"""Whether an instrument that nothing turned has moved at all, for effects of force and of the rates of other axes.

At rest an accelerometer shows its own noise, lines and drift beside gravity, and a gyro its own: none of that is a
specific force, and what two channels have in common by their electronics, or by a floor that shakes, is no sensitivity
of the one to the other. Without a table such a regressor counts if its means over a second cover more than instruments
at rest do by themselves: 0.1 m/s^2, as a tilt of 0.6 deg does. Single knocks do not count. A tilt turns gravity from
axis to axis and leaves its magnitude: where a whole triad changes that by a good part of what an axis covers, it is the
accelerometers that warm up, or motors that shake them. Rows of a second and more may each be of another position: a
force that jumps from row to row is one where its values have ends, as those of a unit that is turned have, and no tails
as those of noise. A vibration counts if its mean square over a second covers the square of that. Rates of the other
gyros never do, however large: a unit that sways about an axis between two of them is read by both, and only a table
tells which of it the one should have read.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.core.series.robust import MEDIAN
from insenv.effects.base import Effect
from insenv.identify.fit.problem import Problem

#: Length of the means that are looked at [s].
AVERAGING = 1.0
#: Quantiles between which they are.
INNER = (0.01, 0.99)
#: What they cover at least where something moves: of specific forces [m/s^2] and of their squares.
LEAST = {
    "force": (0.1, "specific force", "m/s^2"),
    "vibration": (0.01, "mean square of the vibration", "(m/s^2)^2"),
}
#: Share of what an axis covers from which on a change of the magnitude is no tilt's.
OF_MAGNITUDE = 0.3
#: Deviations of a mean by the white noise of its bins that real motion covers: the quantiles of white noise cover 4.7,
#: those of noise of which half is left a row later 6.6.
BEYOND = 10.0
#: What the inner quantiles of a normal variable cover, in its deviations.
OF_NORMAL = 4.65
#: The same of positions at most: 2.8 of a circle, 3.4 of any between two ends, 3.5 of the six faces. Fewest rows and
#: different values that tell it: a converter that goes to and fro between two counts has no tails either.
OF_POSITIONS, FEWEST, VALUES = 3.8, 200, 12
#: Angle from which on a table turned [rad].
TURNED = 0.01


def unmoved(problem: Problem, effect: Effect) -> str:
    """Why an effect of force or of cross rates cannot be told from noise at rest; empty if it can."""
    if "cross_rate" in effect.needs and not any(turned_by_a_table(e.motion) for e in problem.exposures):
        return "no channel tells how the unit turned: gyros that read alike may have swayed about an axis between them"
    needs = [need for need in LEAST if any(n.partition(".")[0] == need for n in effect.needs)]
    if not needs or any(e.motion.angle is not None and np.ptp(e.motion.angle) > TURNED for e in problem.exposures):
        return ""
    least, what, unit = LEAST[needs[0]]
    position = needs[0] == "force"
    fields: list[Mapping[str, Floats]] = [getattr(e.motion, needs[0]) for e in problem.exposures]
    axes = set.intersection(*(set(one) for one in fields))
    of_axes = [tuple(one[axis] for one in fields) for axis in axes]
    if problem.in_points:  # each a mean of its own
        covered = max((float(np.ptp(problem.bins.mean(cells))) for cells in of_axes), default=0.0)
        return "" if covered >= least else f"the {what} covers {covered:.2g} {unit}: nothing moved"
    covered = max((covered_by(problem, cells, position) for cells in of_axes), default=0.0)
    if covered >= least and needs[0] == "force" and len(axes) == 3:
        sizes = tuple(np.sqrt(sum(np.square(one[axis]) for axis in axes)) for one in fields)
        magnitude = covered_by(problem, sizes, position)
        if magnitude > OF_MAGNITUDE * covered:
            return (
                f"the {what} covers {covered:.2g} {unit} and its magnitude {magnitude:.2g}, which no tilt changes: "
                "accelerometers that warm up or are shaken do"
            )
    if covered >= least:
        return ""
    return f"the {what} covers {covered:.2g} {unit}, which instruments at rest do by themselves; nothing moved"


def turned_by_a_table(motion: Motion) -> bool:
    """Whether a table is known to have turned the unit."""
    return motion.angle is not None or motion.rate_edges is not None or bool(np.any(motion.rate))


def covered_by(problem: Problem, cells: tuple[Floats, ...], position: bool) -> float:
    """Range of the means over a second of one channel, in the bins of all runs, but for a hundredth at either end.

    Nothing where white noise covers as much by itself, unless rows may each be of another ``position`` and are.
    """
    bins = problem.bins
    values, second = bins.mean(cells), np.floor(bins.time / AVERAGING)
    _, group = np.unique(np.column_stack([bins.run, second]), axis=0, return_inverse=True)
    count = np.bincount(group.ravel())
    low, high = np.quantile(np.bincount(group.ravel(), values) / count, INNER)
    if position and bins.width >= AVERAGING and _without_tails(values, float(high - low)):
        return float(high - low)
    # Slow rows are averaged little: then the white noise of the channel covers much by itself, its tails more so.
    steps = np.diff(values)
    tails = float(np.ptp(np.quantile(steps, INNER))) / OF_NORMAL
    white = max(float(np.median(np.abs(steps))) / MEDIAN, tails) / np.sqrt(2 * np.median(count))
    return float(high - low) if high - low > BEYOND * white else 0.0


def _without_tails(values: Floats, covered: float) -> bool:
    """Whether values, shape (n,), whose inner ones cover so much end there, as positions do and no noise does."""
    many = len(values) >= FEWEST and len(np.unique(values)) >= VALUES
    return many and covered < OF_POSITIONS * float(np.std(values))
