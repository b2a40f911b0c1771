"""The scan: which effect of the catalogue explains the residual best, and how surely.

For every candidate and every shape the score statistic

    q = r' S^-1 C (C' P C)^-1 C' S^-1 r,      P = S^-1 - S^-1 X (X' S^-1 X)^-1 X' S^-1

with the noise of the model at hand, then for each candidate's best shapes the likelihood ratio with the noise fitted
anew, which regains what the noise model had swallowed of the effect. The number of independent shapes, and of
independent candidates, is measured on simulated noise of this very recording (`Null`), not assumed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, ndtri_exp

from insenv.core.recording import Floats
from insenv.core.series.tails import log_tail_of_f
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import Fit, noise_freedom, spectrum, whitened
from insenv.identify.fit.noise import NoiseFit, fit_noise
from insenv.identify.fit.problem import Model, Problem, Term, design, pooled
from insenv.identify.search.candidates import Candidate, stacked

#: Runs of simulated noise that measure the number of independent shapes.
NULL_RUNS = 200
#: Modes up to which that noise is drawn for all problems of a seed at once: as many as most have.
MOST_SHARED = 2048

#: A candidate less of which is left outside the model than this is not told from it: its coefficient would be hundreds
#: of times less certain than alone, and small errors of the references would decide it.
TOLD_APART = 3e-3

#: Largest logarithm of 1 + gained F / nu whose F is a floating-point number.
LARGEST_GROWTH = 500.0

#: Shapes of each candidate whose likelihood ratio is taken, best score first.
SHAPES_REFITTED = 3


@dataclass(frozen=True)
class Scores:
    """Score statistics of one candidate.

    Attributes
    ----------
    q : ndarray, shape (shapes,)
        Score of each shape; -1 where it cannot be told from the model.
    null_median : float
        Median over simulated noise of the best score over the shapes; 0 where none was drawn.
    rank : int
        Degrees of freedom at one shape.
    """

    q: Floats
    null_median: float
    rank: int

    @property
    def testable(self) -> bool:
        """Whether any shape can be told from the model."""
        return self.rank > 0

    @property
    def trials(self) -> float:
        """Number of independent shapes: how many would give the median found on simulated noise."""
        single = chdtr(self.rank, self.null_median)
        return float(max(1.0, np.log(0.5) / np.log(np.clip(single, 1e-12, 1 - 1e-12))))


@dataclass(frozen=True)
class Hit:
    """A candidate at its best shape, added to a model.

    Attributes
    ----------
    likelihood_ratio : float
        Of the fitted data, the noise fitted anew.
    looks : float
        Independent shapes of this candidate times the candidates of the whole search.
    deviate : float
        Normal deviate of the evidence, uncorrected for the looks.
    held_out : float
        Normal deviate of the held-out data alone; 0 where they were not asked.
    size : int
        Parameters that it spends: those of which the recording tells, and its shapes.
    remark : str
        Why it was taken out, if it was.
    alone : float
        Deviate that it would have beside a reference without errors, where those are why it has less; else 0.
    unrounded : float
        The same of readings that are not rounded (`insenv.identify.search.artefacts.rounded`).
    incredible : float
        Deviate that it would have if its coefficients, which are beyond what is credible, were not; else 0.
    """

    candidate: Candidate
    term: Term
    likelihood_ratio: float
    looks: float
    deviate: float
    size: int
    held_out: float = 0.0
    remark: str = ""
    alone: float = 0.0
    unrounded: float = 0.0
    incredible: float = 0.0

    @property
    def log_p(self) -> float:
        """Natural logarithm of ``p_value``."""
        return min(0.0, log_tail(self.deviate) + float(np.log(self.looks)))

    @property
    def rank(self) -> float:
        """What orders hits that are significant: the likelihood ratio, less what the spent freedom gains by chance.

        Of the ratio counts what errors of the reference leave of the evidence: of two laws the one that errors of the
        motion follow as well may be the likelier by far.
        """
        return self.left * self.likelihood_ratio - self.spent

    @property
    def spent(self) -> float:
        """What its parameters and looks gain by chance."""
        return 2 * self.size + 2 * float(np.log(self.looks))

    @property
    def left(self) -> float:
        """Share of the evidence that is left beside errors of the reference."""
        return (self.deviate / self.alone) ** 2 if 0 < self.deviate < self.alone else 1.0

    @property
    def p_value(self) -> float:
        """Probability of such a hit anywhere in the search if there were only noise."""
        return float(min(1.0, np.exp(self.log_p)))


def score(problem: Problem, fit: Fit, found: tuple[Candidate, ...], seed: int) -> list[Scores]:
    """Score statistics of all candidates, with their null distribution by simulated noise."""
    weight, q, residual = whitened(problem, fit)
    noise = _noise(seed, len(weight))
    return [_score_one(block, weight, q, residual, noise) for block in stacked(problem, found)]


def score_alone(problem: Problem, fit: Fit, found: tuple[Candidate, ...]) -> list[Scores]:
    """As `score`, of the data alone: who asks only which scores are large draws no noise to compare them with."""
    weight, q, residual = whitened(problem, fit)
    return [_score_one(block, weight, q, residual, None) for block in stacked(problem, found)]


def _noise(seed: int, modes: int) -> Floats:
    """White noise of the null distribution, shape (modes, runs): the same in every round and of every target alike.

    The first of more modes are those of fewer: problems of a seed take theirs of what was drawn for the largest.
    """
    drawn = _of_seed(seed)
    if len(drawn[0]) < modes:
        size = max(modes, MOST_SHARED)
        drawn[0] = np.random.Generator(np.random.SFC64(seed)).standard_normal((size, NULL_RUNS))
    return drawn[0][:modes]


@lru_cache(maxsize=2)
def _of_seed(seed: int) -> list[Floats]:
    """The most that was drawn of a seed so far."""
    del seed
    return [np.empty((0, NULL_RUNS))]


def _score_one(block: Floats, weight: Floats, q: Floats, residual: Floats, noise: Floats | None) -> Scores:
    """Scores of regressors of shape (k, shapes, modes); what the model spans of the noise, no basis sees."""
    k, shapes, _ = block.shape
    rows, rank = _beside_model(block, weight, q)
    if not rank.any():
        return Scores(np.full(shapes, -1.0), 0.0, 0)
    values = np.sum((rows @ residual).reshape(k, shapes) ** 2, axis=0)
    usable = rank > 0
    median = 0.0
    if noise is not None:
        null = rows @ noise
        null *= null
        null = null if k == 1 else null.reshape(k, shapes, -1).sum(axis=0)
        null = (null if usable.all() else null[usable]).max(axis=0)
        median = float(np.median(null))
    return Scores(np.where(usable, values, -1.0), median, int(np.median(rank[usable])))


def _beside_model(block: Floats, weight: Floats, q: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Whitened regressors beside the model, orthonormal for each shape, shape (k shapes, modes), and their ranks."""
    rows = block.reshape(-1, block.shape[2]) * weight
    norm = np.sqrt(np.einsum("rn,rn->r", rows, rows))
    rows /= np.where(norm > 0, norm, 1)[:, None]
    rows -= (rows @ q) @ q.T
    return rows, orthonormal(rows.reshape(block.shape), block.shape[2])[0]


def orthonormal(rows: Floats, modes: int) -> tuple[NDArray[np.int64], Floats]:
    """Make the k rows of each shape, (k, shapes, n), orthonormal in ``modes``; zero if the model spans them.

    What stands behind the modes is moved with them. Also the rank of each shape, and what was left of its last row.
    """
    rank = np.zeros(rows.shape[1], dtype=int)
    left = np.zeros(rows.shape[1])
    for j, rest in enumerate(rows):
        own = rest[:, :modes].copy() if j else rest[:, :modes]
        for before in rows[:j]:
            rest -= before * np.einsum("sn,sn->s", before[:, :modes], own)[:, None]
        left = np.sqrt(np.einsum("sn,sn->s", rest[:, :modes], rest[:, :modes]))
        good = left > TOLD_APART
        rest *= (good / np.where(good, left, 1.0))[:, None]
        rank += good
    return rank, left


@dataclass(frozen=True)
class Reference:
    """The model at hand, with its noise by plain maximum likelihood: what likelihood ratios compare with.

    Attributes
    ----------
    model : Model
    noise : NoiseFit
    parameters : int
    root : ndarray, shape (modes,)
        Standard deviation of each mode.
    basis : ndarray, shape (modes, parameters)
        Orthonormal basis of the whitened model.
    """

    model: Model
    noise: NoiseFit
    parameters: int
    root: Floats
    basis: Floats


def reference(problem: Problem, model: Model, start: Floats | None = None) -> Reference:
    """Maximum likelihood of a model."""
    columns = design(problem, model)
    noise = fit_noise(*pooled(problem, model), restricted=False, start=start, most=problem.most)
    root = np.sqrt(spectrum(problem, noise.power))
    return Reference(model, noise, len(columns.scale), root, np.linalg.qr(columns.transformed / root[:, None])[0])


def largest_statistic(problem: Problem, base: Reference, found: tuple[Candidate, ...]) -> float:
    """Largest score statistic of any shape of any candidate beside the noise of the reference."""
    residual = white_beside(base, problem.data())
    each = (_statistics(base, block, residual) for block in stacked(problem, found))
    return max((float(values.max(initial=0.0)) for values in each), default=0.0)


def statistics(problem: Problem, base: Reference, block: Floats) -> Floats:
    """Score statistic of each shape beside the noise of the reference, shape (shapes,).

    ``block`` holds the transformed regressors, shape (k, shapes, modes).
    """
    return _statistics(base, block, white_beside(base, problem.data()))


def _statistics(base: Reference, block: Floats, residual: Floats) -> Floats:
    rows, _ = _beside_model(block, 1 / base.root, base.basis)
    return np.asarray(np.sum((rows @ residual).reshape(block.shape[:2]) ** 2, axis=0))


def likelihood_ratio(problem: Problem, base: Reference, model: Model) -> tuple[float, int]:
    """Twice the gain in log-likelihood of ``model`` over ``base``, noise fitted anew, and the parameters gained.

    Remembered: what several targets have in common, and what stands in an effect's place, is asked again and again.
    """
    limits = None if problem.most is None else problem.most.tobytes()
    key = ("ratio", model, limits, base.noise.power.tobytes(), base.noise.loglik, base.parameters)
    found: tuple[float, int] = problem.remember(key, lambda: _likelihood_ratio(problem, base, model))
    return found


def _likelihood_ratio(problem: Problem, base: Reference, model: Model) -> tuple[float, int]:
    cross, prior = pooled(problem, model)
    noise = fit_noise(cross, prior, restricted=False, start=base.noise.power, most=problem.most)
    return 2 * (noise.loglik - base.noise.loglik), len(prior) - base.parameters


def beside(problem: Problem, base: Reference, term: Term) -> Floats:
    """Whitened regressors of a term beside those of the model, shape (modes, k)."""
    return white_beside(base, problem.transformed(term))


def white_beside(base: Reference, columns: Floats) -> Floats:
    """Whitened columns or values of the modes beside the model, shape as given."""
    white = columns / (base.root if columns.ndim == 1 else base.root[:, None])
    return np.asarray(white - base.basis @ (base.basis.T @ white))


def term_freedom(problem: Problem, base: Reference, term: Term) -> float:
    """Degrees of freedom with which the noise is known where ``term`` differs from the model."""
    columns = beside(problem, base, term)
    energy = np.sum(columns**2 / np.maximum(np.sum(columns**2, axis=0), 1e-300), axis=1)
    return noise_freedom(problem, base.noise.power, energy)


def deviate(problem: Problem, base: Reference, term: Term, ratio: float, gained: int) -> float:
    """Normal deviate of a likelihood ratio, uncorrected for the looks."""
    log_p = log_significance(ratio, gained, term_freedom(problem, base, term))
    return float(-ndtri_exp(min(log_p, -1e-12)))


def log_significance(ratio: float, gained: int, freedom: float) -> float:
    """Logarithm of the probability that noise alone gives this likelihood ratio at one given shape.

    Fisher's F, not chi-square: the noise itself is known with ``freedom`` = nu degrees of freedom only. Noise that is
    fitted anew takes back a part of what the effect gains, so that the ratio grows with the logarithm of F alone:

        ratio = (nu + gained + 1) log(1 + gained F / nu)

    The 1 is measured: with it 8000 simulated nulls of each of eight slow effects exceed a probability of 1 % in 0.8 to
    1.7 %, of 0.1 % in 0.03 to 0.15 %; without it in up to 2.1 % and 0.23 %.
    """
    if gained <= 0 or ratio <= 0:
        return 0.0
    growth = min(ratio / (freedom + gained + 1), LARGEST_GROWTH)
    tail = log_tail_of_f(freedom / gained * np.expm1(growth), gained, freedom)
    return tail if np.isfinite(tail) else -0.5 * ratio
