r"""What runs say of an estimator, with intervals that hold with 95 %.

    z = e / s,    NEES = mean e' P^-1 e / q,    efficiency = bound^2 / variance,    d_i = e_ai^2 - e_bi^2

with the error e, told deviation s and covariance P of the q quantities that are asked for. NEES and the spread of z are
1 where an estimator tells the truth of itself. Two pairs are compared on the same seeds: the difference of their
root mean squares is mean d / (r_a + r_b), and most of the chance is in both and cancels.

Where sum (e / bound)^2 is below the quantile 1e-6 of chi^2 with as many degrees of freedom as runs, an estimator says
more than its data can tell: it has seen the truth, or has guessed what hardly differs from run to run.
Source: Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), section 5.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtr

from insenv.core.recording import Floats
from insenv.evaluate.runs import Table
from insenv.evaluate.sweeps import QUANTILE, moments

#: Probability with which an honest estimator that reaches the bound is called better than it.
FALSE_ALARM = 1e-6
#: A value with half of its 95 % interval.
Value = tuple[float, float]


@dataclass(frozen=True)
class QuantityScore:
    """Errors of one quantity.

    Attributes
    ----------
    quantity, unit : str
        Its SI unit.
    bias, deviation, rms : tuple of float
        Mean error, standard deviation and root mean square, each with half of its interval.
    told : float
        Root mean square of the deviations that the estimator tells.
    spread : tuple of float
        Root mean square of z-scores.
    bound : float, optional
        Least standard deviation.
    efficiency : tuple of float, optional
    chance : float, optional
        Probability that an unbiased estimator which reaches the bound errs as little as this in so many runs.
    """

    quantity: str
    unit: str
    bias: Value
    deviation: Value
    rms: Value
    told: float
    spread: Value
    bound: float | None = None
    efficiency: Value | None = None
    chance: float | None = None

    @property
    def beyond(self) -> bool:
        """Whether the errors are smaller than the bound allows, by more than chance."""
        return self.chance is not None and self.chance < FALSE_ALARM


@dataclass(frozen=True)
class Scored:
    """Errors of one estimator under one policy.

    Attributes
    ----------
    estimator, policy : str
    runs : int
    scores : tuple of QuantityScore
    nees : tuple of float
        Over all quantities that are asked for.
    time : float
        Mean instrument time of a run [s].
    stopped : float
        Share of the runs that the policy stopped before time was up.
    cpu, cpu_estimator : float
        Of a run, simulation and policy included, and of the estimator alone [s].
    fault : str
        Why there is nothing of this pair; then all numbers are empty.
    """

    estimator: str
    policy: str
    runs: int = 0
    scores: tuple[QuantityScore, ...] = ()
    nees: Value = (np.nan, np.nan)
    time: float = np.nan
    stopped: float = np.nan
    cpu: float = np.nan
    cpu_estimator: float = np.nan
    fault: str = ""


@dataclass(frozen=True)
class Paired:
    """How far a pair is from the first one, on the same seeds.

    Attributes
    ----------
    quantity : str
    pair, first : tuple of str
        Estimator and policy.
    bias, rms : tuple of float
        Difference of mean errors, and of root mean squares; above zero: the pair errs more than the first.
    """

    quantity: str
    pair: tuple[str, str]
    first: tuple[str, str]
    bias: Value
    rms: Value


def quantities(table: Table) -> list[str]:
    """What the task asks for and the estimator tells."""
    return [name.removeprefix("error.") for name in table if name.startswith("error.")]


def score(table: Table, quantity: str, unit: str, bound: float | None) -> QuantityScore:
    """Of one quantity."""
    error, told = table[f"error.{quantity}"], np.sqrt(table[f"cov.{quantity}.{quantity}"])
    scale = float(np.abs(error).max(initial=0.0)) or 1.0
    found = moments([error / scale])
    deviation = (found.deviation[0] * scale, found.deviation[1] * scale)
    efficiency = None
    if bound is not None and deviation[0] > 0:
        value = (bound / deviation[0]) ** 2
        efficiency = (value, 2 * value * deviation[1] / deviation[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(told > 0, error / told, np.inf)
    return QuantityScore(
        quantity,
        unit,
        bias=(found.mean[0] * scale, found.mean[1] * scale),
        deviation=deviation,
        rms=(found.rms[0] * scale, found.rms[1] * scale),
        told=float(np.sqrt(np.mean(told**2))),
        spread=moments([z]).rms if np.isfinite(z).all() else (np.inf, np.nan),
        bound=bound,
        efficiency=efficiency,
        chance=None if bound is None else float(chdtr(len(error), np.sum((error / bound) ** 2))),
    )


def nees(table: Table, names: Sequence[str]) -> Value:
    """Normalised estimation error squared, divided by the number of quantities."""
    error = np.stack([table[f"error.{name}"] for name in names], axis=-1)
    cov = np.empty((len(error), len(names), len(names)))
    for j, a in enumerate(names):
        for k, b in enumerate(names[: j + 1]):
            cov[:, j, k] = cov[:, k, j] = table[f"cov.{b}.{a}"] if f"cov.{b}.{a}" in table else table[f"cov.{a}.{b}"]
    try:
        values = np.einsum("ri,ri->r", error, np.linalg.solve(cov, error[..., None])[..., 0]) / len(names)
    except np.linalg.LinAlgError:
        return np.inf, np.nan
    return moments([values]).mean if np.isfinite(values).all() else (np.inf, np.nan)


def paired(quantity: str, pair: tuple[str, str], a: Table, first: tuple[str, str], b: Table) -> Paired:
    """The runs ``a`` against ``b``, of the same seeds."""
    x, y = a[f"error.{quantity}"], b[f"error.{quantity}"]
    ra, rb = _rms(x), _rms(y)
    # To first order, for the interval: each root mean square follows its own squares.
    share = x**2 / (2 * ra or 1.0) - y**2 / (2 * rb or 1.0)
    return Paired(quantity, pair, first, _mean(x - y), (ra - rb, _mean(share)[1]))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _mean(values: Floats) -> Value:
    n = len(values)
    return float(values.mean()), QUANTILE * float(values.std(ddof=1) if n > 1 else np.nan) / n**0.5
