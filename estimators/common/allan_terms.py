r"""The terms of an Allan variance, fitted with the covariance that its estimates have, and tested.

    sigma^2(tau) = 3 Q^2 / tau^2 + N^2 / tau + (2 ln 2 / pi) B^2 + K^2 tau / 3 + R^2 tau^2 / 2
                 + (q T)^2 / tau (1 - T / (2 tau) (3 - 4 e^(-tau/T) + e^(-2 tau/T)))      Markov, correlation time T
                 + A^2 (sin^2(pi f tau) / (pi f tau))^2                                   sinusoid of amplitude A

Neighbouring averaging times see the same noise. With S the density of noise that is not white and |H_i|^2 = sin^4(x) /
x^2, x = pi f tau_i, the estimates have the correlation

    rho_ij = C_ij / sqrt(C_ii C_jj),     C_ij = int |H_i|^2 |H_j|^2 S^2 df,

of white noise 0.35 an octave, and the variance 2 sigma^4 / edf. The coefficients are squares and not negative:
non-negative generalised least squares. A model that does not fit (chi-square) is given a Markov term, a sinusoid, or
both; or the shortest averaging times are left to what made them: filters, lines and the sway of the base. What still
does not fit has no coefficients. The floor of the deviation divided by 0.664 is what B would be if the floor were
flicker alone, and so the most it can be.

Source: IEEE Std 952-1997, annex C; Riley, NIST SP 1065 (2008).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import log, pi, sqrt

import numpy as np

from insenv.core.rate_test import AllanTerm, Valued
from insenv.core.recording import Floats
from insenv.core.series.allan import NOISES

#: Powers of tau of the terms, in the order of `TERMS`, and their factors.
TERMS = (*NOISES, "rate_ramp")
_POWERS = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
_FACTORS = np.array([3.0, 1.0, 2 * log(2) / pi, 1 / 3, 0.5])
#: No model holds better than this in the variance.
_MODEL = 1e-3
#: Probability of chance below which a model is refused.
REFUSED = 1e-3
#: Averaging times that are left at least, beside the parameters.
SPARE = 2
#: Shapes that are tried: correlation times and frequencies.
_TIMES, _FREQUENCIES = 24, 120
#: Correlation of the estimates of white noise at two neighbouring octaves, whose differences overlap by half.
WHITE = 0.35
#: Averages from which the floor is read.
FEWEST = 8.0


@dataclass(frozen=True)
class FittedTerms:
    """What the terms are.

    Attributes
    ----------
    coefficients : dict of str to Valued
        SI, by `TERMS`; those that nothing is seen of are 0 with what may be hidden; NaN where no model fits.
    p_value : float
        Of the fit, by chi-square; NaN with too few averaging times to tell.
    others : tuple of AllanTerm
    left_out : int
        Shortest averaging times that the model is not of.
    """

    coefficients: dict[str, Valued]
    p_value: float
    others: tuple[AllanTerm, ...] = ()
    left_out: int = 0

    @property
    def fits(self) -> bool:
        """Whether the figures may be believed as their deviations say."""
        return not self.p_value < REFUSED


#: What finds terms: taus, variance, degrees of freedom -> terms.
Fit = Callable[[Floats, Floats, Floats], FittedTerms]


def fitted(taus: Floats, variance: Floats, edf: Floats) -> FittedTerms:
    """Coefficients of the noise terms of an Allan variance at octaves.

    Parameters
    ----------
    taus, variance, edf : ndarray, shape (k,)
        [s], Allan variance [rad^2/s^2], its degrees of freedom.
    """
    if len(taus) < 2:
        return FittedTerms({}, float("nan"))
    if len(taus) < len(TERMS) + SPARE:
        return plain(taus, variance, edf)
    tried = sorted(
        (left + 2 * len(kinds), left, kinds)
        for left, kinds in product(range(len(taus) - len(TERMS) - SPARE + 1), _KINDS)
        if len(taus) - left >= len(TERMS) + 2 * len(kinds) + SPARE
    )
    for _, left, kinds in tried:
        kept = slice(left, None)
        found = _best(taus[kept], variance[kept], edf[kept], kinds)
        if found.fits:
            return FittedTerms(found.coefficients, found.p_value, found.others, left)
    worst = plain(taus, variance, edf)
    return FittedTerms(dict.fromkeys(TERMS, Valued()), worst.p_value)


_KINDS: tuple[tuple[str, ...], ...] = ((), ("markov",), ("sinusoid",), ("markov", "sinusoid"))


def plain(taus: Floats, variance: Floats, edf: Floats) -> FittedTerms:
    """The powers of the averaging time alone, over all of it, whether they fit or not; fast. Shapes as `fitted`."""
    if len(taus) < 2:
        return FittedTerms({}, float("nan"))
    return _solved(taus, variance, edf, (), max(1, min(len(TERMS), len(taus) - 1)))


def _best(taus: Floats, variance: Floats, edf: Floats, kinds: tuple[str, ...]) -> FittedTerms:
    """The fit with terms of those kinds, one shape after the other being tried where the fit so far is worst."""
    shapes: list[tuple[str, float]] = []
    for kind in kinds:
        low, high = (taus[0], taus[-1]) if kind == "markov" else (0.1 / taus[-1], 0.5 / taus[0])
        grid = np.geomspace(low, high, _TIMES if kind == "markov" else _FREQUENCIES)
        shapes.append((kind, float(min(grid, key=lambda s: _misfit(taus, variance, edf, (*shapes, (kind, s)))))))
    return _solved(taus, variance, edf, tuple(shapes), len(TERMS))


def _column(kind: str, shape: float, taus: Floats) -> Floats:
    """Allan variance of a term of unit size."""
    return AllanTerm(kind, shape, 1.0).variance(taus)


def _misfit(taus: Floats, variance: Floats, edf: Floats, shapes: tuple[tuple[str, float], ...]) -> float:
    """Chi-square with weights of the data alone: to choose a shape by."""
    from scipy.optimize import nnls  # slow to import

    basis = _basis(taus, shapes, len(TERMS))
    scale = variance * np.sqrt(2 / edf + _MODEL**2)
    weighted = basis / scale[:, None]
    size = np.linalg.norm(weighted, axis=0)
    return float(nnls(weighted / size, variance / scale)[1])


def _basis(taus: Floats, shapes: tuple[tuple[str, float], ...], terms: int) -> Floats:
    powers = _FACTORS[:terms] * taus[:, None] ** _POWERS[:terms]
    return np.column_stack([powers, *(_column(kind, shape, taus) for kind, shape in shapes)])


def _solved(
    taus: Floats, variance: Floats, edf: Floats, shapes: tuple[tuple[str, float], ...], terms: int
) -> FittedTerms:
    """Non-negative generalised least squares with the covariance of the fitted model."""
    from scipy.linalg import cholesky, solve_triangular
    from scipy.optimize import nnls
    from scipy.special import chdtrc

    basis = _basis(taus, shapes, terms)
    model, x = variance, np.zeros(basis.shape[1])
    for _ in range(6):
        cov = _covariance(taus, model, edf, x, shapes, terms)
        factor = cholesky(cov, lower=True)
        weighted = solve_triangular(factor, basis, lower=True)
        size = np.linalg.norm(weighted, axis=0)
        y = solve_triangular(factor, variance, lower=True)
        z, _ = nnls(weighted / size, y)
        x = z / size
        model = np.maximum(basis @ x, 1e-6 * variance)
    active = x > 0
    free = len(taus) - int(active.sum()) - len(shapes)
    p_value = float(chdtrc(free, _chi_square(variance, model, edf, cov))) if free > 0 else float("nan")
    sd, hidden = _deviations(weighted, size, active, taus, shapes, x, factor)
    out = {}
    for j, name in enumerate(TERMS[:terms]):
        value = sqrt(x[j])
        out[name] = Valued(value, sd[j] / (2 * value)) if active[j] else Valued(0.0, sqrt(hidden[j]))
    others = (AllanTerm(k, s, float(x[terms + i])) for i, (k, s) in enumerate(shapes) if active[terms + i])
    return FittedTerms(out, p_value, tuple(others))


def _chi_square(variance: Floats, model: Floats, edf: Floats, cov: Floats) -> float:
    """Misfit in squared deviations: variances of few degrees of freedom are made Gaussian by their cube root.

    Source: Wilson and Hilferty, The distribution of chi-square, PNAS 17 (1931).
    """
    ratio = np.cbrt(variance / model)
    sd = np.sqrt(np.diag(cov)) / model
    z = (ratio - 1 + 2 / (9 * edf)) / np.maximum(sd / 3, 1e-300)
    correlation = cov / np.sqrt(np.diag(cov))[:, None] / np.sqrt(np.diag(cov))
    return float(z @ np.linalg.solve(correlation, z))


def _deviations(  # noqa: PLR0913 -- the state of one fit
    weighted: Floats,
    size: Floats,
    active: np.ndarray,
    taus: Floats,
    shapes: tuple[tuple[str, float], ...],
    x: Floats,
    factor: Floats,
) -> tuple[Floats, Floats]:
    """Standard deviations of the squares that are seen, and of those that might be; shapes are fitted beside them."""
    from scipy.linalg import solve_triangular

    terms = len(x) - len(shapes)
    step = 1e-4
    slopes = [
        x[terms + i] * (_column(k, s * (1 + step), taus) - _column(k, s * (1 - step), taus)) / (2 * step)
        for i, (k, s) in enumerate(shapes)
        if active[terms + i]
    ]
    beside = [solve_triangular(factor, slope, lower=True) for slope in slopes]

    def inverse(columns: np.ndarray) -> Floats:
        whole = np.column_stack([(weighted / size)[:, columns], *(b / max(np.linalg.norm(b), 1e-300) for b in beside)])
        return np.asarray(np.diag(np.linalg.pinv(whole.T @ whole, rcond=1e-10)), np.float64)

    sd, hidden = np.zeros(len(x)), np.zeros(len(x))
    if active.any():
        sd[active] = np.sqrt(np.maximum(inverse(active)[: int(active.sum())], 0.0)) / size[active]
    for j in np.flatnonzero(~active):
        one = active.copy()
        one[j] = True
        hidden[j] = sqrt(max(inverse(one)[int(one[:j].sum())], 0.0)) / size[j]
    return sd, hidden


def _covariance(  # noqa: PLR0913 -- the state of one fit
    taus: Floats, model: Floats, edf: Floats, x: Floats, shapes: tuple[tuple[str, float], ...], terms: int
) -> Floats:
    """Covariance of the estimates, shape (k, k)."""
    sd = model * np.sqrt(2 / edf)
    cov = _correlation(taus, model, x, shapes, terms) * sd[:, None] * sd
    cov[np.diag_indices(len(taus))] += (_MODEL * model) ** 2
    return cov


def _correlation(taus: Floats, model: Floats, x: Floats, shapes: tuple[tuple[str, float], ...], terms: int) -> Floats:
    """Correlation of the estimates: of the share of white noise in each, of the rest, and of their products."""
    octaves = np.abs(np.log2(taus[:, None] / taus))
    white = WHITE**octaves
    rest = _of_density(taus, x, shapes, terms)
    if rest is None:
        return white
    share = np.clip((_FACTORS[:2] * taus[:, None] ** _POWERS[:2])[:, :terms] @ x[: min(terms, 2)] / model, 0.0, 1.0)
    other = 1 - share
    mixed = np.sqrt(share * other)
    return np.asarray(
        np.outer(share, share) * white
        + np.outer(other, other) * rest
        + 2 * np.outer(mixed, mixed) * np.sqrt(white * rest),
        np.float64,
    )


def _of_density(taus: Floats, x: Floats, shapes: tuple[tuple[str, float], ...], terms: int) -> Floats | None:
    """Correlation for the noise that is not white; None where there is none."""
    f = np.geomspace(0.02 / taus[-1], 0.5 / taus[0], 1500)
    w = 2 * pi * f
    squares = np.zeros(len(TERMS))
    squares[:terms] = x[:terms]
    # A ramp is no noise, and a sinusoid is one frequency: neither scatters.
    density = squares[2] / w + squares[3] / w**2
    for (kind, shape), square in zip(shapes, x[terms:], strict=True):
        if kind == "markov":
            density = density + square * shape**2 / (1 + (w * shape) ** 2)
    if not density.max() > 0:
        return None
    response = np.sin(pi * f * taus[:, None]) ** 4 / (pi * f * taus[:, None]) ** 2 * density * np.sqrt(f)
    response /= np.linalg.norm(response, axis=1, keepdims=True)
    return np.asarray(response @ response.T, np.float64)


def floor(taus: Floats, variance: Floats, edf: Floats) -> tuple[Valued, float]:
    """The least deviation / 0.664 and its averaging time [s]; NaN where the deviation still falls at the end."""
    told = np.flatnonzero(edf >= FEWEST / 2)
    if len(told) < 3:
        return Valued(), float("nan")
    i = int(told[np.argmin(variance[told])])
    if i in (told[0], told[-1]):
        return Valued(), float("nan")
    value = sqrt(variance[i] / _FACTORS[2])
    return Valued(value, value / sqrt(2 * edf[i])), float(taus[i])
