r"""What a whole search looks at, as directions in which white noise is looked at.

With the noise at hand the fitted modes are w = S^-1/2 r ~ N(0, I) outside the span of the model, and the held-out ones
v = V^-1/2 r (`insenv.identify.fit.evidence`). For every shape of every candidate the k orthonormal directions r_j of
its regressors beside the model give the score

    q = sum_j a_j^2,      a_j = r_j' w,

and the same coefficients say what held-out data are to look like: phi = sum_j a_j h_j, with h_j what the direction r_j
is in them,

    z_h = phi' v / |phi|,      Z = (z(q) + sqrt(rho) z_h) / sqrt(1 + rho),      rho = |phi|^2 / q.

The evidence of a search on one residual is the largest over its candidates, each at its best shape, of the logarithm of
the probability beyond Z with the looks of that candidate counted, log Q(Z) + log looks: what `Hit.log_p` is. For many
residuals it is two matrix products a candidate.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct, next_fast_len, rfft, rfftfreq
from scipy.special import fdtrc, log_ndtr, ndtri_exp

from insenv.core.recording import Floats
from insenv.effects.tone import Tone
from insenv.identify.fit.bins import Block, at_places
from insenv.identify.fit.evidence import HeldOutSpace
from insenv.identify.fit.gls import Fit, noise_freedoms, spectrum
from insenv.identify.fit.problem import Problem
from insenv.identify.search.candidates import Candidate, stacked
from insenv.identify.search.round import CALIBRATION, SUGGESTED, against
from insenv.identify.search.scan import LARGEST_GROWTH, orthonormal

#: Of single precision: chance has no more digits, and products take half as long.
Singles = NDArray[np.float32]

#: Residuals that are worked off together: what they hold stays in the cache of a processor's neighbour.
TOGETHER = 250
#: Degrees of freedom of noise that is as good as known; those below which the noise is fitted anew, to one of so many
#: residuals, those with the largest scores, in so many steps.
KNOWN, FEW, MOST_SHARE, STEPS = 1e6, 100.0, 8, 30
#: Times its size in the fitted modes that a curve has in a held-out one at most: its square is a number as well.
FARTHEST = 1e12
#: Logarithm of a probability below which the incomplete beta function has no digits.
SMALLEST = -600.0


@dataclass(frozen=True)
class Directions:
    """Of one candidate.

    Attributes
    ----------
    key : str
    fitted : ndarray, shape (k, shapes, modes)
        Orthonormal directions of each shape; zero where the model spans them.
    held : ndarray, shape (k, shapes, held-out modes)
        What they are in the held-out data.
    rank : ndarray of int, shape (shapes,)
    freedom : ndarray, shape (shapes,)
        Degrees of freedom with which the noise is known where each shape lives.
    sd : ndarray, shape (shapes,)
        Standard deviation of the coefficient, where it is one.
    limits : tuple of float
        Least and largest credible value of that coefficient, and the least that counts.
    odds : float
        What the looks are multiplied by.
    """

    key: str
    fitted: Singles
    held: Singles
    rank: NDArray[np.int64]
    freedom: Floats
    sd: Floats
    limits: tuple[float, float, float]
    odds: float

    def best(self, w: Singles) -> tuple[Singles, Singles, NDArray[np.int64]]:
        """Best score over the shapes, the coefficients there, and which shape: shapes (n,), (k, n), (n,)."""
        k, shapes, modes = self.fitted.shape
        a = (self.fitted.reshape(-1, modes) @ w).reshape(k, shapes, -1)
        q = np.where((self.rank > 0)[:, None], np.einsum("ksn,ksn->sn", a, a), -1.0)
        at = q.argmax(axis=0)
        each = np.arange(w.shape[1])
        return q[at, each], a[:, at, each], at

    def credible(self, a: Singles, at: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether a single coefficient is one that the effect may have, as the search asks it; shape (n,)."""
        if len(a) > 1:
            return np.ones(a.shape[1], bool)
        low, high, least = self.limits
        sd = self.sd[at]
        value, slack = a[0] * sd, 3 * sd
        inside = ((low if low == 0 else low - slack) <= value) & (value <= high + slack)
        most = np.where(value > 0, high, -low)
        return inside & ~((most < slack) & (slack <= np.abs(value))) & (np.abs(value) + slack >= least)

    def held_out(self, a: Singles, at: NDArray[np.int64], v: Singles) -> tuple[Floats, Floats]:
        """Deviate of the held-out data and the information of what they are asked, shapes (n,)."""
        k, shapes, modes = self.held.shape
        told = (self.held.reshape(-1, modes) @ v).reshape(k, shapes, -1)[:, at, np.arange(v.shape[1])]
        information = np.einsum("in,nij,jn->n", a, self.between[at], a)
        size = np.sqrt(np.maximum(information, 1e-300))
        return np.where(information < 1e-12, 0.0, np.einsum("kn,kn->n", a, told) / size), information

    @cached_property
    def between(self) -> Floats:
        """Products of the directions in held-out data, shape (shapes, k, k); some are nearly all there."""
        held = self.held.astype(np.float64)
        return np.einsum("ism,jsm->sij", held, held)


@dataclass(frozen=True)
class Lines:
    """Lines of any frequency, as directions: the periodogram of the whitened series.

    ``places`` are those of the bins of each block (`Bins.places`), ``looked`` the frequencies looked at, ``odds`` as of
    `Directions`, ``share`` the information of held-out data beside that of the fitted ones.
    """

    blocks: tuple[Block, ...]
    places: tuple[NDArray[np.int64], ...]
    width: float
    looked: float
    share: float
    odds: float

    def best(self, w: Singles) -> tuple[Singles, int]:
        """Largest power over the frequencies, shape (n,), and its degrees of freedom."""
        longest = max(int(place[-1]) + 1 for place in self.places)
        size = next_fast_len(4 * longest)
        frequencies = rfftfreq(size, self.width)
        usable = (frequencies > 1.5 / (longest * self.width)) & (frequencies < 0.48 / self.width)
        power: dict[int, Singles] = {}
        offset = 0
        for block, place in zip(self.blocks, self.places, strict=True):
            series = at_places(idct(w[offset : offset + block.n], type=2, norm="ortho", axis=0), place)
            offset += block.n
            if block.n >= 16:
                spectrum_of = np.abs(rfft(series, size, axis=0)[usable]) ** 2 * 2 / block.n
                power[block.run] = power.get(block.run, 0) + spectrum_of
        if not power or not usable.any():
            return np.zeros(w.shape[1], np.float32), 2
        return np.asarray(sum(power.values())).max(axis=0), 2 * len(power)


@dataclass(frozen=True)
class Noise:
    """What fits the noise of many white residuals at once: plain maximum likelihood, as likelihood ratios have it.

    Attributes
    ----------
    model : ndarray, shape (modes, p)
        Orthonormal basis of the whitened model.
    order, starts : ndarray of int
        Modes in groups of nearly one variance.
    count : ndarray, shape (groups,)
    shapes : ndarray, shape (groups, terms)
        Variance of each noise term in that of the noise at hand, where each has at least a thousandth of it somewhere.
    """

    model: Singles
    order: NDArray[np.int64]
    starts: NDArray[np.int64]
    count: Floats
    shapes: Floats

    @classmethod
    def of(cls, problem: Problem, power: Floats, model: Floats) -> Noise:
        """Of a problem whitened by noise of ``power``."""
        relative = problem.modes().shapes / spectrum(problem, power)[:, None]
        least = 1e-3 / np.maximum(relative.max(axis=0), 1e-300)
        most = np.inf if problem.most is None else np.maximum(problem.most, 0.0)
        groups = problem.grouping()
        shapes = (relative * np.minimum(np.maximum(power, least), most))[groups.order]
        pooled = np.add.reduceat(shapes, groups.starts, axis=0) / groups.count[:, None]
        return cls(model.astype(np.float32), groups.order, groups.starts, groups.count, pooled)

    def energy(self, w: Singles) -> Floats:
        """Energy of each group of modes beside the model, shape (groups, n)."""
        beside = w - self.model @ (self.model.T @ w)
        return np.asarray(np.add.reduceat((beside * beside)[self.order], self.starts, axis=0), np.float64)

    def fitted(self, energy: Floats) -> Floats:
        """Log-likelihood of the noise at its best, shape (n,), by steps that never make it worse.

        Of Fevotte and Idier (2011), Neural Computation 23, 2421: each power times a ratio of two sums.
        """
        power = np.ones((self.shapes.shape[1], energy.shape[1]))
        counted = self.shapes.T * self.count
        for _ in range(STEPS):
            inverse = 1 / np.maximum(self.shapes @ power, 1e-9)
            power *= (self.shapes.T @ (energy * inverse * inverse)) / np.maximum(counted @ inverse, 1e-300)
        variance = np.maximum(self.shapes @ power, 1e-9)
        return np.asarray(-0.5 * (self.count @ np.log(variance) + (energy / variance).sum(axis=0)))


@dataclass(frozen=True)
class Whole:
    """The whole search on one model of one target.

    Attributes
    ----------
    candidates : tuple of Directions
        Those that the recording can tell from the model.
    lines : Lines, optional
    noise : Noise
    fitted, held : tuple of Block
    """

    candidates: tuple[Directions, ...]
    lines: Lines | None
    noise: Noise
    fitted: tuple[Block, ...]
    held: tuple[Block, ...]

    def deviates(
        self, w: Singles, v: Singles, chance: np.random.Generator, anew: bool = False
    ) -> dict[str, tuple[Floats, Floats]]:
        """Of each candidate: deviate Z at its best shape, and log P of its score there alone; shapes (n,).

        Parameters
        ----------
        w : ndarray, shape (modes, n)
            Whitened fitted modes.
        v : ndarray, shape (held-out modes, n)
            Whitened held-out modes.
        chance : Generator
            Of what held-out data say of lines, which are at another frequency in each residual.
        anew : bool
            Whether the noise is fitted to each residual anew, with and without the candidate, as the search does:
            where few modes tell the noise, and the score of the residual is among the largest.
        """
        found = {}
        without = self.noise.fitted(self.noise.energy(w)) if anew else None
        for one in self.candidates:
            q, a, at = one.best(w)
            freedom = np.full(len(q), KNOWN)
            log_p, ratio = log_tail_of_score(q, one.rank[at], freedom), q.astype(np.float64)
            if without is not None and one.freedom[one.rank > 0].min() < FEW:
                most = np.argsort(log_p)[: max(1, len(q) // MOST_SHARE)]
                left = w[:, most] - np.einsum("kn,knm->mn", a[:, most], one.fitted[:, at[most]])
                ratio[most] = 2 * np.maximum(self.noise.fitted(self.noise.energy(left)) - without[most], 0.0)
                nu, rank = one.freedom[at[most]], one.rank[at[most]]
                grown = np.minimum(ratio[most] / (nu + rank + 1), LARGEST_GROWTH)
                log_p[most] = log_tail_of_score(nu * np.expm1(grown), rank, nu)
            z, information = one.held_out(a, at, v)
            joint = _joint(log_p, z, information / np.maximum(ratio, 1e-3))
            found[one.key] = np.where(one.credible(a, at), joint, -np.inf), log_p
        if self.lines is not None:
            power, freedom_of = self.lines.best(w)
            ones = np.ones(len(power))
            log_p = log_tail_of_score(power, np.full(len(power), freedom_of), KNOWN * ones)
            found[Tone.id] = _joint(log_p, chance.standard_normal(len(power)), self.lines.share * ones), log_p
        return found

    def looks(self, alone: dict[str, Floats]) -> dict[str, float]:
        """Looks of each candidate, counted on residuals of noise: independent shapes, times the odds.

        ``alone`` has the logarithms of the probability of each one's best score by itself.
        """
        looks = {}
        for one in self.candidates:
            below = np.clip(-np.expm1(float(np.median(alone[one.key]))), 1e-12, 1 - 1e-12)
            looks[one.key] = max(1.0, float(np.log(0.5) / np.log(below))) * one.odds
        if self.lines is not None:
            looks[Tone.id] = self.lines.looked * self.lines.odds
        return looks


def whole(problem: Problem, fit: Fit, power: Floats, found: tuple[Candidate, ...], family: int, tones: bool) -> Whole:
    """The whole search beside the model of ``fit``, whitened by noise of ``power``.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The model that candidates are added to.
    power : ndarray, shape (terms,)
        Of the noise: that of ``fit``, or of a larger model.
    found : tuple of Candidate
    family : int
        As of `insenv.identify.search.round.search`.
    tones : bool
        Whether a line may be found.
    """
    weight = 1 / np.sqrt(spectrum(problem, power))
    columns = fit.design.transformed * weight[:, None]
    space = HeldOutSpace.of(problem, fit)
    q, r = np.linalg.qr(columns) if columns.shape[1] else (columns, np.zeros((0, 0)))
    both = np.vstack([q, np.linalg.solve(r.T, space.model.T).T]) if columns.shape[1] else None
    count = CALIBRATION * family
    told = []
    for candidate, block in zip(found, stacked(problem, found), strict=True):
        held = space.white(np.concatenate([problem.columns(term) for term in candidate.terms], axis=1))
        k, shapes, modes = block.shape
        held = held.T.reshape(shapes, k, -1).swapaxes(0, 1)
        rows = np.concatenate([block * weight, held], axis=2)
        size = np.sqrt(np.einsum("ksn,ksn->ks", rows[..., :modes], rows[..., :modes]))
        rows /= np.where(size > 0, size, 1)[..., None]
        if both is not None:
            rows -= (rows[..., :modes] @ q) @ both.T
        rank, left = orthonormal(rows, modes)
        if not rank.any():
            continue
        freedom = noise_freedoms(problem, power, np.einsum("ksn,ksn->sn", rows[..., :modes], rows[..., :modes]))
        later = np.asarray(space.damped(rows[..., modes:].reshape(k * shapes, -1).T).T).reshape(k, shapes, -1)
        sd = 1 / np.maximum(size[0] * left, 1e-300)
        param = candidate.effect.linear[0]
        limits = (*problem.limits(param), param.least)
        odds = count * against(problem, candidate.effect)
        told.append(
            Directions(
                candidate.effect.key,
                rows[..., :modes].astype(np.float32),
                np.clip(later, -FARTHEST, FARTHEST).astype(np.float32),
                rank,
                freedom,
                sd,
                limits,
                odds,
            )
        )
    lines = None
    if tones:
        looked = sum(b.n / 2 for b in problem.fitted if b.n >= 16)
        share = sum(b.n for b in problem.held_out) / sum(b.n for b in problem.fitted)
        places = tuple(problem.bins.places(block) for block in problem.fitted)
        lines = Lines(problem.fitted, places, problem.bins.width, max(looked, 1.0), share, count)
    return Whole(tuple(told), lines, Noise.of(problem, power, q), problem.fitted, problem.held_out)


def to_series(blocks: tuple[Block, ...], modes: Floats) -> Floats:
    """White series of which these are the modes, block after block."""
    ends = np.cumsum([b.n for b in blocks])[:-1]
    return np.concatenate([idct(part, type=2, norm="ortho", axis=0) for part in np.split(modes, ends)])


def to_modes(blocks: tuple[Block, ...], series: Singles) -> Singles:
    """The other way."""
    ends = np.cumsum([b.n for b in blocks])[:-1]
    return np.concatenate([dct(part, type=2, norm="ortho", axis=0) for part in np.split(series, ends)])


def log_tail_of_score(q: Floats | Singles, rank: NDArray[np.int64], freedom: Floats) -> Floats:
    """Logarithm of the probability that noise gives a larger score at one shape: F = q / rank, beside ``freedom``.

    Of one coefficient by the normal deviate of Student's t of Wallace (1959), Ann. Math. Stat. 30, 1124, to 1 % of it
    far out; of two it is a power.
    """
    q = np.maximum(q, 0.0, dtype=np.float64)
    grown = freedom * np.log1p(q / freedom)
    if np.all(rank == 1):
        z = (8 * freedom + 1) / (8 * freedom + 3) * np.sqrt(grown)
        return np.asarray(np.log(2.0) + log_ndtr(-z))
    if np.all(rank == 2):
        return np.asarray(-0.5 * grown)
    with np.errstate(divide="ignore"):
        tail = np.log(fdtrc(rank, freedom, q / np.maximum(rank, 1)))
    # Far out, where the function has no digits, the tail is nearly its leading power.
    return np.where(tail > SMALLEST, tail, -0.5 * grown)


def _joint(log_p: Floats, z: Floats, rho: Floats) -> Floats:
    """Deviate of fitted and held-out data together, where the fitted ones suggest anything; shape (n,)."""
    alone = -ndtri_exp(np.minimum(log_p, -1e-12))
    return np.where(log_p > np.log(SUGGESTED), alone, (alone + np.sqrt(rho) * z) / np.sqrt(1 + rho))


def log_tails(z: Floats) -> Floats:
    """Logarithm of the probability that a standard normal exceeds each of ``z``."""
    return np.asarray(log_ndtr(-z))
