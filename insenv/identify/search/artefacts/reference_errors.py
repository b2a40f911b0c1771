r"""What the errors of a reference leave that goes with the motion, as the rival of every law of an instrument.

A reference of the motion by other means, cameras, the attitude of a robot, another unit or an encoder on a shaft that
bends, has errors of its own that go with the motion. Beside the model X, an effect C must be told from three of them:

1. *A gain and a phase that go with the frequency* (a filter, an interpolation, another axis that leaks in): the input
   in bands (`insenv.identify.fit.bands`). Of the marginal likelihood l of that response, with C and without,

       h = |r|^2 - |r_C|^2 + 2 l_C - 2 l

   is what C gains: a law of two parameters wins over a response of eighty that does as much.
2. *Noise in the variable.* u = x + v is where the curve is taken, and -v stands in y - u: what is left at one reading
   of the rate is no law but where the readings crowd, at rest or at the rate of a sweep (Tweedie),

       E[v | u] = (s^2 p)' / p,      p the density of the readings, s^2 the variance of what is left there

   and of a table that all but stands any odd polygon of u up to a few scatters. Coefficients are N(0, 1).
3. *Noise that goes with the motion* (`insenv.identify.fit.swings`): the variance of C's coefficient is larger by f.

Of the first an error of the encoder itself is none (`insenv.identify.search.artefacts.wave_of_reference`).
Of points at one rate each there is neither a frequency nor a swing, and no lag: the errors are the table's own. Nor
is there of a table that keeps its rate, of which an encoder's wave is all that changes.
The normal deviate of the evidence shrinks by sqrt(h / (h_0 f)), h_0 being what C gains without all that.

Source of the second: B. Efron, Tweedie's formula and selection bias, J. Am. Stat. Assoc. 106 (2011) 1602.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri_exp

from insenv.core.lazy import Lazy
from insenv.core.recording import Floats
from insenv.core.series.tails import log_tail_of_t
from insenv.identify.fit.bands import in_bands, response
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.lag_form import second_order
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.swings import by_swings, in_few_swings, in_the_loudest
from insenv.identify.search.artefacts.wave_of_reference import in_reference_alone
from insenv.identify.search.candidates import keeps_its_rate, law_of_motion
from insenv.identify.search.scan import Hit, Reference, beside, white_beside

#: Largest p-value at which an effect is worth the test.
WORTH = 0.05
#: Widths of the density of the readings, in the scatter of what is left; grid points to a width, and at most.
WIDTHS, FINE, MOST_POINTS = (1.0, 3.0), 4, 20_000
#: Rates, in the same scatter, up to which readings of a table that all but stands are noise in part.
STILL = (0.0, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
#: Share of the evidence below which the errors of a reference are what is left of it.
TAKEN = 0.8


def beside_reference_errors(problem: Problem, fit: Fit, base: Reference, hit: Hit) -> Hit:
    """The hit with its deviate as it is beside what errors of the reference leave that goes with the motion.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The model without it.
    base : Reference
        The same with its noise by plain likelihood.
    hit : Hit
    """
    if not _may_be_reference(problem, hit):
        return hit
    larger = Lazy(lambda: solve(problem, (*fit.model, hit.term)))
    evidence = _evidence(problem, fit, base, hit.term, larger)
    if evidence is None:
        return hit
    if evidence.response < 1 and in_reference_alone(problem, larger()):
        evidence = replace(evidence, response=1.0)
    deviate = evidence.of(hit.deviate)
    if deviate >= hit.deviate:
        return hit
    less = replace(hit, deviate=deviate, alone=hit.deviate)
    if deviate**2 < TAKEN * hit.deviate**2 and hit.log_p < np.log(WORTH) <= less.log_p:
        return replace(less, remark=evidence.why)
    return less


def _may_be_reference(problem: Problem, hit: Hit) -> bool:
    if hit.candidate.effect.of_response or hit.log_p >= np.log(WORTH):
        return False
    moves = problem.turns and not problem.in_points and not keeps_its_rate(problem)
    return moves and problem.target.startswith("gyro")


@dataclass(frozen=True)
class _Evidence:
    """What is left of an effect's evidence: shares beside the response and within swings, and how many swings tell."""

    response: float
    swings: float
    freedom: float

    def of(self, deviate: float) -> float:
        """A normal deviate as it is beside errors of the reference."""
        z = deviate * float(np.sqrt(min(1.0, self.response) / self.swings))
        if not np.isfinite(self.freedom):
            return z
        tail = log_tail_of_t(z, self.freedom)
        return float(-ndtri_exp(min(tail, -1e-12))) if np.isfinite(tail) else z

    @property
    def why(self) -> str:
        """In words."""
        if self.response * self.swings < 1:
            return "errors of a reference explain it as well: a gain that goes with the frequency, or noise of its rate"
        return "it is not the same swing by swing: what is left goes with the motion, as errors of a reference do"


def _evidence(problem: Problem, fit: Fit, base: Reference, term: Term, larger: Callable[[], Fit]) -> _Evidence | None:
    """What is left of the evidence of a ``term`` beside the model of ``fit``, ``larger`` with it; None of none."""
    columns = beside(problem, base, term)
    span, size, _ = np.linalg.svd(columns, full_matrices=False)
    span = span[:, size > 1e-6 * size.max(initial=1e-300)]
    data = white_beside(base, problem.data())
    alone = float(np.sum((span.T @ data) ** 2))
    if not span.shape[1] or alone <= 0:
        return None
    bands, frequency = _bands(problem, base)
    crowding = np.column_stack([_crowding(problem, larger()), second_order(problem, fit)])
    crowd = white_beside(base, transform(problem.fitted, crowding))
    gram = _Gram.of(span, data, bands, crowd)
    sizes, gained = gram.response(frequency, with_effect=True)
    _, without = gram.response(frequency, with_effect=False)
    held = gram.gained + 2 * gained - 2 * without
    theta, own, information = gram.fit(sizes)
    curve = span @ theta
    seen = np.column_stack([bands, crowd])
    # As the response sees them: what it would take of the curve, it takes of it here too.
    left, curve_left = data - curve - seen @ own.left, curve - seen @ own.curve
    factor, freedom = by_swings(problem, curve_left, left)
    few, moves = in_few_swings(problem, curve_left), law_of_motion(term.effect)
    for one in _of_motion(problem, base) if few or moves else ():
        if few:
            factor = max(factor, 1 + few * (in_the_loudest(problem, one, left) - 1))
        if moves and few < 1:
            factor = max(factor, 1 + (1 - few) * (by_swings(problem, one, left)[0] - 1))
    share = max(min(held, information, alone), 0.0) / alone
    return _Evidence(share, factor, freedom)


# The response in bands


def _bands(problem: Problem, base: Reference) -> tuple[Floats, Floats]:
    """The input in bands beside the model, shape (modes, k), and the frequency of each column in swings."""
    columns, frequency = in_bands(problem)
    known = problem.cache.get("bands beside")
    if known is None or known[0] is not base:
        known = (base, white_beside(base, columns))
        problem.cache["bands beside"] = known
    return known[1], frequency


# Noise in the variable


def _crowding(problem: Problem, fit: Fit) -> Floats:
    """What noise of the readings leaves where they crowd, (s^2 p)' / p, and about zero, shape (bins, k)."""
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    left = problem.y - fit.predicted()
    used = ~problem.bins.held_out
    used[list(problem.outliers)] = False
    scatter = max(float(np.sqrt(np.mean(left[used] ** 2))), 1e-300)
    low, high = float(u.min()), float(u.max())
    # At one rate, in all means, nothing crowds: what the readings of it scatter by is far less than what is left.
    if not high - low > scatter / FINE:
        return np.zeros((len(u), 0))
    slopes = []
    for width in (max(times * scatter, FINE * (high - low) / MOST_POINTS) for times in WIDTHS):
        at = np.linspace(low, high, int((high - low) / width * FINE) + 2)
        index = np.clip(np.rint((u[used] - low) / (high - low) * (len(at) - 1)), 0, len(at) - 1).astype(int)
        density = _smoothed(np.asarray(np.bincount(index, minlength=len(at)), np.float64))
        power = _smoothed(np.asarray(np.bincount(index, left[used] ** 2, len(at)), np.float64))
        slopes.append((at, np.gradient(power, at) / np.maximum(density, 1e-3 * density.max())))
    # As an effect's curve: of the rate in each cell, not of its mean.
    return problem.bins.mean(
        tuple(
            np.column_stack([*(np.interp(e.u, *slope) for slope in slopes), *_all_but_still(e.u, scatter)])
            for e in problem.exposures
        )
    )


def _all_but_still(u: Floats, scatter: float) -> Iterator[Floats]:
    """Odd polygons of a rate up to some scatters, as large as the rate or the scatter at their corners."""
    corners = scatter * np.array(STILL)
    for low, at, high in zip(corners[:-2], corners[1:-1], corners[2:], strict=True):
        yield np.sign(u) * np.interp(np.abs(u), [low, at, high], [0.0, max(at, scatter), 0.0])


def _smoothed(counts: Floats) -> Floats:
    """Counts on the grid, means with a Gaussian of one width."""
    reach = np.arange(-4 * FINE, 4 * FINE + 1)
    kernel = np.exp(-0.5 * (reach / FINE) ** 2)
    return np.convolve(counts, kernel / kernel.sum())[4 * FINE : 4 * FINE + len(counts)]


# The effect beside both


@dataclass(frozen=True)
class _Own:
    """Coefficients of bands and crowding: in what the effect leaves, and in the effect's curve."""

    left: Floats
    curve: Floats


@dataclass(frozen=True)
class _Gram:
    """Products of the columns of effect, data, bands and crowding (c, 1, k, m), crowding with a coefficient N(0, 1)."""

    products: Floats
    c: int
    k: int

    @classmethod
    def of(cls, span: Floats, data: Floats, bands: Floats, crowd: Floats) -> _Gram:
        """Of orthonormal columns of the effect, the data, bands and crowding, all whitened and beside the model."""
        rows = np.column_stack([span, data, bands, crowd])
        return cls(rows.T @ rows, span.shape[1], bands.shape[1])

    @property
    def gained(self) -> float:
        """Square sum that the effect takes, beside the crowding."""
        inner = self._free(with_effect=False)
        own = inner[: self.c, : self.c]
        return float(inner[self.c, : self.c] @ np.linalg.lstsq(own, inner[: self.c, self.c], rcond=1e-10)[0])

    def _free(self, with_effect: bool) -> Floats:
        """Products of effect, data and bands beside the crowding, and beside the effect where it is in the model."""
        n = self.c + 1 + self.k
        g, d = self.products[:n, :n], self.products[:n, n:]
        inside = self.products[n:, n:] + np.eye(len(self.products) - n)
        g = g - d @ _solved(inside, d.T)
        if not with_effect:
            return np.asarray(g)
        e = g[:, : self.c]
        return np.asarray(g - e @ np.linalg.lstsq(g[: self.c, : self.c], e.T, rcond=1e-10)[0])

    def response(self, frequency: Floats, with_effect: bool) -> tuple[Floats, float]:
        """Standard deviation of each band's coefficient, and the gain of the marginal likelihood."""
        g = self._free(with_effect)
        return response(g[self.c + 1 :, self.c + 1 :], g[self.c + 1 :, self.c], frequency)

    def fit(self, sizes: Floats) -> tuple[Floats, _Own, float]:
        """Coefficients of the effect, those of bands and crowding, and the information in the effect's curve."""
        n = self.c + 1
        scale = np.concatenate([sizes, np.ones(len(self.products) - n - self.k)])
        inner = self.products[n:, n:] * np.outer(scale, scale) + np.eye(len(scale))
        across = self.products[:n, n:] * scale
        solved = _solved(inner, across.T)
        g = self.products[:n, :n] - across @ solved
        theta = np.linalg.lstsq(g[: self.c, : self.c], g[: self.c, self.c], rcond=1e-10)[0]
        of_curve = scale * (solved[:, : self.c] @ theta)
        return theta, _Own(scale * solved[:, self.c] - of_curve, of_curve), float(theta @ g[: self.c, self.c])


def _solved(matrix: Floats, right: Floats) -> Floats:
    """The solution; the shortest one where crowding so loud is alike that one beside it is rounding."""
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])


# Noise that goes with the motion


def _of_motion(problem: Problem, base: Reference) -> tuple[Floats, ...]:
    """A level, the input, its size and its change, whitened: curves in which all swings have a say."""
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    columns = np.column_stack([np.ones(len(u)), u, np.abs(u), np.gradient(u)])
    return tuple((transform(problem.fitted, columns) / base.root[:, None]).T)


def log_p_alone(hit: Hit) -> float:
    """Logarithm of the p-value that a hit has where the reference has no errors."""
    return min(0.0, log_tail(max(hit.alone, hit.deviate)) + float(np.log(hit.looks)))
