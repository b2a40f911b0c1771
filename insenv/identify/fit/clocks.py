r"""Whether gyro and reference come apart in time: the skew in the quarters of what tells it.

    tau(t) = tau + e t              two clocks of which one gains e seconds in a second
    tau(t) = tau + d for t > t_j    rows that one of them lost, or a clock that was set
    tau_k of each quarter           a filter of the reference that changes

each by its likelihood, with the noise fitted beside it: what one skew for all of them leaves of the motion is in the
noise of the whole, and the search would take it for another effect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from insenv.core.recording import Floats
from insenv.effects.timing import TimingSkew
from insenv.identify.findings import Estimate
from insenv.identify.fit.gls import Fit, noise_beside, solve, spectrum
from insenv.identify.fit.noise import transform
from insenv.identify.fit.parts import PartsApart, apart
from insenv.identify.fit.problem import Problem, Term

#: Chance of so different a skew below which it is said; twice the difference of the log-likelihoods of a line and of a
#: jump from which on one of them is told from the other, and instants at which a jump is tried.
COMES_APART, TOLD, INSTANTS = 1e-7, 6.0, 32
#: Chance of what is left beside the better of the two below which it is neither.
NEITHER = 1e-4
#: Fewest parts of which a scatter is a law.
FEWEST = 3
#: Deviations from which on skews by means of two lengths differ.
DIFFER = 3.0


@dataclass(frozen=True)
class Skews:
    """Skews of the quarters with their deviations [s], the chance of their scatter and the variance ``between`` them.

    ``gains`` is what one clock gains in a second, with its standard deviation, and ``jump`` the change at one instant
    [s]. ``favours`` is twice by how much the log-likelihood of a line is more than that of a jump, and ``left`` the
    chance of what skews of the quarters have beyond the better of the two.
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
    named = fit.named
    term = next((t for t in named if isinstance(t.effect, TimingSkew)), None)
    if term is None:
        term = Term(TimingSkew())
        named = (*named, term)
    fit = fit if len(named) == len(fit.model) and term in fit.model else solve(problem, named)
    found = apart(problem, fit, term)
    if found is None or found.chance >= COMES_APART or len(found.values) < FEWEST:
        return None
    time = problem.bins.time[:, None]
    lines = found.column[:, None] * np.column_stack([np.ones_like(time), time - time.mean()])
    gains = _Beside.of(problem, fit, term, lines)
    jump = _jump(problem, fit, term, found)
    each = _Beside.of(problem, fit, term, found.column[:, None] * _in_parts(found.label))
    rest = chdtrc(len(found.values) - 2, max(0.0, 2 * (each.loglik - max(gains.loglik, jump.loglik))))
    return Skews(
        found.values,
        found.deviations,
        found.chance,
        found.between,
        (float(gains.values[1]), float(gains.deviations[1])),
        float(jump.values[1] - jump.values[0]),
        2 * (gains.loglik - jump.loglik),
        float(rest),
    )


def skew_of_means(skews: Sequence[tuple[float, float, float]], width: float, own: Estimate) -> tuple[float, str]:
    """What a skew by means over ``width`` seconds differs from that by others beyond chance, and a word of it.

    Others are shorter, or begin elsewhere.

    Where the reference has errors that go with the motion the noise is not all that the skews of means of two lengths
    have to differ: of a robot beside its wheels -19.1 +- 1.2, -15.7 +- 1.1, -14.5 +- 1.8 and -23.6 +- 0.7 ms by means
    over 0.5 to 4 s, where -18.4 was there.

    Parameters
    ----------
    skews : sequence of (float, float, float)
        Length of means [s], skew by them and its deviation [s].
    width : float
        Of the means that are judged.
    own : Estimate
        By these.

    Returns
    -------
    variance : float
        To be added to that of ``own`` [s^2].
    said : str
        Empty where they agree.
    """
    others = [one for one in skews if one[0] < (1 + 1e-6) * width]
    apart = [one for one in others if abs(one[1] - own.value) > DIFFER * math.hypot(one[2], own.sd)]
    if not apart:
        return 0.0, ""
    length, skew, sd = max(apart, key=lambda one: abs(one[1] - own.value))
    elsewhere = " that begin elsewhere" if length > (1 - 1e-6) * width else ""
    return (skew - own.value) ** 2 - sd**2 - own.sd**2, (
        f"the timing skew is not the same by means over {length:.2g} s{elsewhere} ({1e3 * skew:.3g} ± {1e3 * sd:.1g} "
        f"ms) and over {width:.2g} s ({1e3 * own.value:.3g} ± {1e3 * own.sd:.1g} ms), which are judged: errors of the "
        "reference, and the deviation that is stated has the difference in it"
    )


@dataclass(frozen=True)
class _Beside:
    """Columns in the place of a term: coefficients with their deviations, and the log-likelihood of the fitted bins."""

    values: Floats
    deviations: Floats
    loglik: float

    @classmethod
    def of(cls, problem: Problem, fit: Fit, term: Term, columns: Floats) -> _Beside:
        """Of columns over all bins, shape (bins, k), the noise fitted beside them."""
        others = fit.design.term != fit.model.index(term)
        own = transform(problem.fitted, columns)
        size = np.sqrt(np.mean(own**2, axis=0))
        size[size == 0] = 1.0  # behind the last change of the rate nothing tells a skew: it has its prior
        matrix = np.column_stack([own / size, fit.design.transformed[:, others]])
        prior = np.concatenate([1 / (problem.priors(term)[0] * size) ** 2, fit.design.prior[others]])
        noise = noise_beside(problem, matrix, prior, restricted=False, start=fit.noise.power)
        white = 1 / np.sqrt(spectrum(problem, noise.power))
        rows = matrix * white[:, None]
        inverse = np.linalg.inv(rows.T @ rows + np.diag(prior))
        values = inverse @ (rows.T @ (problem.data() * white))
        k = columns.shape[1]
        return cls(values[:k] / size, np.sqrt(np.diag(inverse)[:k]) / size, noise.loglik)


def _in_parts(label: NDArray[np.int64]) -> Floats:
    """One for the bins of each part, shape (bins, parts)."""
    return (label[:, None] == np.arange(label.max() + 1)).astype(float)


def _jump(problem: Problem, fit: Fit, term: Term, found: PartsApart) -> _Beside:
    """A skew before and one after the likeliest of some instants, as far apart as what tells it, each exact there."""
    told = np.cumsum(np.where(problem.bins.held_out, 0.0, found.column**2))
    halves = [_in_parts((told > share * told[-1]).astype(np.int64)) for share in np.arange(1, INSTANTS) / INSTANTS]
    tried = [_Beside.of(problem, fit, term, found.column[:, None] * half) for half in halves]
    half, best = max(zip(halves, tried, strict=True), key=lambda one: one[1].loglik)
    terms = (replace(term, effect=term.effect.near(value[None])) for value in best.values)
    return _Beside.of(problem, fit, term, np.column_stack([problem.columns(one) for one in terms]) * half)
