r"""What an estimator makes of a run, as an observation and as a score.

    belief = (mean, sd),   information = sum_q ln(prior_q / sd_q)   [nats],

    score = information + sum_q [ 1/2 - min(z_q^2, 100) / 2 - ln(1 + (error_q / demanded_q)^2) ],   z = error / sd

is earned by the belief at the end of a run, whatever was believed before. Its first part and z are the logarithmic
score ln N(truth; mean, sd) of the stated Gaussian, less what the prior is expected to have: in the mean it is largest
where mean and sd are what the data tell. The last part is the price of an error beyond what is demanded; it depends on
the mean alone and is least at the middle of the belief. So no other statement pays better than the honest one. The
limit on z^2 keeps returns bounded. With it a deviation that is too small by any factor up to exp(49) still pays less
(`LEAST_SHARE` allows exp(28)), and the best deviation is the honest one but for a share of 1e-21.
Source: Gneiting and Raftery, Strictly proper scoring rules, J. Am. Stat. Assoc. 102 (2007) 359.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from insenv.core.attitude import wrapped
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate, Estimator
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Floats, Recording

#: No deviation is taken for smaller than this share of the prior one: its logarithm stays finite.
LEAST_SHARE = 1e-12
#: Largest square of an error in stated deviations that is scored.
MOST_Z2 = 100.0


@dataclass(frozen=True)
class SoughtQuantity:
    """A quantity of interest.

    Attributes
    ----------
    name : str
    prior : float
        Standard deviation before anything is measured: none that is larger is shown.
    limit : float
        Its mean lies within plus and minus this.
    demanded : float
        Standard deviation that is wanted.
    circular : bool
        Whether it is an angle on the full circle: errors are wrapped.
    unit : str
        In which an estimator tells it (SI); empty: any.
    """

    name: str
    prior: float
    limit: float
    demanded: float
    circular: bool = False
    unit: str = ""

    def error(self, mean: Floats, true: Floats) -> Floats:
        """Mean minus truth, wrapped into [-pi, pi) on a circle."""
        error = mean - true
        return wrapped(error) if self.circular else error


@dataclass(frozen=True)
class Judge:
    """An estimator by name, watched: what it does wrong is said of it in one sentence.

    Attributes
    ----------
    name : str
    estimator : Estimator
    quantities : tuple of SoughtQuantity
        What it is asked for.
    """

    name: str
    estimator: Estimator
    quantities: tuple[SoughtQuantity, ...]

    def begin(self, batch: int) -> Any:
        """State before any data."""
        return self._answer("reset", self.estimator.reset, batch)

    def update(self, state: Any, chunk: Recording) -> Any:
        """State after a chunk."""
        return self._answer("update", self.estimator.update, state, chunk)

    def estimate(self, state: Any, batch: int) -> Estimate:
        """What is known of so many runs.

        Raises
        ------
        InputError
            If it is no `Estimate`, or has not the shape of the batch.
        """
        estimate: Estimate = self._answer("estimate", self.estimator.estimate, state)
        if not isinstance(estimate, Estimate):
            raise InputError(f"estimator {self.name!r} returned a {type(estimate).__name__}; wanted an Estimate")
        k = len(estimate.names)
        if np.shape(estimate.mean) != (batch, k) or np.shape(estimate.cov) != (batch, k, k):
            raise InputError(
                f"estimator {self.name!r} returned a mean of shape {np.shape(estimate.mean)} and a covariance of "
                f"shape {np.shape(estimate.cov)}; wanted {(batch, k)} and {(batch, k, k)}"
            )
        return estimate

    def belief(self, estimate: Estimate) -> tuple[Floats, Floats]:
        """Means and standard deviations of the quantities, each of shape (R, k), a new array.

        Raises
        ------
        InputError
            If the estimator does not tell them, tells them in another unit, or says NaN.
        """
        batch = len(estimate.mean)
        means, deviations = np.empty((batch, len(self.quantities))), np.empty((batch, len(self.quantities)))
        for j, q in enumerate(self.quantities):
            try:
                mean, sd = estimate.of(q.name)
            except KeyError as error:
                raise InputError(f"estimator {self.name!r}: {error.args[0]}; wanted {q.name!r}") from None
            if q.unit and (unit := estimate.units[estimate.names.index(q.name)]) != q.unit:
                raise InputError(f"estimator {self.name!r} tells {q.name!r} in {unit!r}; wanted {q.unit!r}")
            if not np.all(np.isfinite(mean)) or np.any(np.isnan(sd)):
                raise InputError(
                    f"estimator {self.name!r} returned {_odd(mean, sd)} of {q.name!r}; wanted a finite mean and "
                    f"a standard deviation of zero or more"
                )
            means[:, j] = np.clip(mean, -q.limit, q.limit)
            deviations[:, j] = np.clip(sd, LEAST_SHARE * q.prior, q.prior)
        return means, deviations

    def information(self, deviations: Floats) -> Floats:
        """What is known beyond the prior [nats], shape (R,), of deviations of shape (R, k)."""
        prior = np.array([q.prior for q in self.quantities])
        known: Floats = np.log(prior / deviations).sum(axis=-1)
        return known

    def verdict(self, means: Floats, deviations: Floats, truth: Mapping[str, Floats]) -> Floats:
        """What the truth adds to the information at the end of a run, shape (R,): score less information."""
        total = np.zeros(len(means))
        for j, q in enumerate(self.quantities):
            error = q.error(means[:, j], truth[q.name])
            z2 = np.minimum((error / deviations[:, j]) ** 2, MOST_Z2)
            total += 0.5 * (1.0 - z2) - np.log1p((error / q.demanded) ** 2)
        return total

    def _answer(self, method: str, call: Callable[..., Any], *given: Any) -> Any:
        """What the plug-in answers; whatever it raises is an error of the plug-in, by name."""
        try:
            # A deviation of zero or without bound is checked afterwards, and is no reason for a warning here.
            with np.errstate(invalid="ignore"):
                return call(*given)
        except Exception as error:
            text = " ".join(str(error).split()) or "no message"
            raise InputError(f"estimator {self.name!r} failed in {method}: {type(error).__name__}: {text}") from error


def _odd(mean: Floats, sd: Floats) -> str:
    """The first row that cannot be used, in words."""
    row = int(np.flatnonzero(~np.isfinite(mean) | np.isnan(sd))[0])
    return f"mean {np.ravel(mean)[row]:g} and deviation {np.ravel(sd)[row]:g}"


def judge(
    name: str,
    datasheet: Datasheet,
    quantities: tuple[SoughtQuantity, ...],
    made: Callable[[Datasheet], Estimator] | None = None,
) -> Judge:
    """The estimator of that name, told what the datasheet says; ``made`` makes it where it is not installed here.

    Raises
    ------
    InputError
        If it is not installed or refuses the datasheet.
    """
    made = find(ESTIMATORS, name) if made is None else made
    try:
        estimator = made(datasheet)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"estimator {name!r} failed when it was made: {type(error).__name__}: {error}") from error
    return Judge(name, estimator, quantities)
