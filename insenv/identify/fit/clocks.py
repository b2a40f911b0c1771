r"""Whether gyro and reference come apart in time: the skew in the quarters of what tells it.

    tau_k = tau + e t_k             two clocks of which one gains e seconds in a second
    tau_k = tau + d for k > j       rows that one of them lost, or a clock that was set
    tau_k otherwise                 a filter of the reference that changes

with t_k the mean times of the quarters, weighted with what tells the skew. One skew for all of them lets the rest of
the motion into the residual, where the search takes it for another effect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from insenv.core.recording import Floats
from insenv.effects.timing import TimingSkew
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.parts import PartsApart, apart
from insenv.identify.fit.problem import Problem, Term

#: Chance of so different a skew below which it is said; and by how much the square sum that a line leaves, in
#: variances, is less or more than that of a jump where one of them is told from the other.
COMES_APART, TOLD = 1e-7, 6.0
#: Chance of what is left beside the better of the two below which it is neither.
NEITHER = 1e-4
#: Fewest parts of which a scatter is a law.
FEWEST = 3


@dataclass(frozen=True)
class Skews:
    """Skews of the quarters with their deviations [s], the chance of their scatter and the variance ``between`` them.

    ``gains`` is what one clock gains in a second, with its standard deviation, and ``jump`` the largest change from one
    quarter to the next [s]. ``favours`` is by how much the square sum that a line leaves, in variances, is less than
    that of a jump, and ``left`` the chance of the lesser.
    """

    values: Floats
    deviations: Floats
    chance: float
    between: float
    gains: tuple[float, float]
    jump: float
    favours: float
    left: float

    def sentence(self, target: str) -> str:
        """What is said of them."""
        scale, unit = (1.0, "s") if np.abs(self.values).max() >= 1.0 else (1e3, "ms")
        pairs = zip(self.values, self.deviations, strict=True)
        told = ", ".join(f"{scale * v:.3g} ± {scale * s:.2g}" for v, s in pairs)
        gained, sd = self.gains
        line = f"two clocks of which one gains {1e3 * abs(gained):.3g} ± {1e3 * sd:.1g} ms in a second"
        jump = f"rows that were lost or a clock that was set, a jump of {scale * abs(self.jump):.3g} {unit}"
        told_as = line if self.favours > TOLD else jump if self.favours < -TOLD else f"{line}, or {jump}"
        if self.left < NEITHER:
            told_as = "a reference whose lag changes"
        return (
            f"{target} and its reference come apart in time: the timing skew is {told} {unit} in the quarters of the "
            f"fitted motion (p = {self.chance:.1g}), as of {told_as}"
        )


def skews_apart(problem: Problem, fit: Fit) -> Skews | None:
    """Skews of the quarters of one run, where they differ by more than chance."""
    if len(np.unique(problem.bins.run)) > 1:
        return None
    named = tuple(t for t in fit.model if not t.effect.generic)
    term = next((t for t in named if isinstance(t.effect, TimingSkew)), None)
    if term is None:
        term = Term(TimingSkew())
        named = (*named, term)
    fit = fit if len(named) == len(fit.model) and term in fit.model else solve(problem, named)
    found = apart(problem, fit, term)
    if found is None or found.chance >= COMES_APART or len(found.values) < FEWEST:
        return None
    gains, left = _line(found)
    jump, after = min((_jump(found, k) for k in range(1, len(found.values))), key=lambda one: one[1])
    rest = float(chdtrc(len(found.values) - 2, min(left, after)))
    return Skews(found.values, found.deviations, found.chance, found.between, gains, jump, after - left, rest)


def _line(found: PartsApart) -> tuple[tuple[float, float], float]:
    """Slope of the skews over time with its deviation, and the square sum that it leaves in variances."""
    w = 1 / found.deviations**2
    t, values = (x - x @ w / w.sum() for x in (found.times, found.values))
    slope = float(t @ (w * values) / (t @ (w * t)))
    return (slope, float(1 / np.sqrt(t @ (w * t)))), float((values - slope * t) ** 2 @ w)


def _jump(found: PartsApart, at: int) -> tuple[float, float]:
    """Change of the skew after ``at`` parts, and the square sum that the two levels leave in variances."""
    w, levels, left = 1 / found.deviations**2, [], 0.0
    for part in (slice(0, at), slice(at, None)):
        own, values = w[part], found.values[part]
        levels.append(float(values @ own / own.sum()))
        left += float((values - levels[-1]) ** 2 @ own)
    return levels[1] - levels[0], left
