r"""Covariance analysis without sampling: what a linear estimator errs by, and what an undeclared effect does to it.

    theta^ = K m + (I - K X) mu,      K = (X' C^-1 X + P^-1)^-1 X' C^-1   for the efficient one
    cov    = K C K' + (I - K X) P (I - K X)',      bias = K x

for means m = X theta + e of cells (`insenv.information.means`), a prior (mu, P), and x what an effect that the model
lacks adds to the means. Per unit of a linear effect x is its column: the bias is then its sensitivity. The same K
serves for noise that the estimator did not know of, so that the price of a wrong weighting is seen too.
Source: A. Gelb (ed.), Applied Optimal Estimation (1974), section 7.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.effects.base import Effect
from insenv.information.means import Means

#: What an estimator without a prior may leave of a parameter: rounding.
_LEFT = 1e-6


@dataclass(frozen=True)
class Linear:
    """A linear estimator.

    Attributes
    ----------
    names : tuple of str
        Of the p parameters.
    gain : ndarray, shape (p, k)
        Of the kept means; zero for a parameter that is known.
    prior : mapping of str to float
        Standard deviations that it takes for the parameters' own; none: not bounded.
    """

    names: tuple[str, ...]
    gain: Floats
    prior: Mapping[str, float]

    def errors(self, means: Means, prior: Mapping[str, float] | None = None) -> Floats:
        """Covariance of its errors, shape (p, p), for the noise of ``means`` and the spread ``prior`` of the truths.

        Raises
        ------
        InputError
            If it does not find a parameter of which no prior is given.
        """
        true = self.prior if prior is None else prior
        left = np.eye(len(self.names)) - self.gain @ means.columns
        spread = np.array([true.get(name, np.inf) for name in self.names])
        wide = ~np.isfinite(spread)
        noise = self.gain @ means.covariance @ self.gain.T
        size = np.sqrt(np.diag(noise))
        # In units of the deviations: parameters differ by many orders.
        relative = np.abs(left) * size <= _LEFT * size[:, None]
        if (lost := wide & ~(relative | (left == 0)).all(axis=0)).any():
            named = ", ".join(np.array(self.names)[lost])
            raise InputError(f"the estimator leaves a part of {named}, of which no prior is given; wanted one")
        return np.asarray(noise + (left * np.where(wide, 0.0, spread) ** 2) @ left.T)


def efficient(means: Means, prior: Mapping[str, float] | None = None) -> Linear:
    """The linear estimator of least variance.

    Parameters
    ----------
    means : Means
        As it takes them: another covariance than the true one makes it suboptimal.
    prior : mapping of str to float, optional
        Standard deviations of parameters; zero: known; infinity, or none: free.

    Raises
    ------
    InputError
        If a direction of the parameters is not identifiable: it is named.
    """
    held = dict(prior or {})
    told = means.information.given(held)
    bound = told.bound()
    if bound.unidentifiable:
        named = "; ".join(" with ".join(direction) for direction in bound.unidentifiable)
        raise InputError(f"not identifiable: {named}; wanted a prior, or a procedure that tells them apart")
    places = [means.names.index(name) for name in told.names]
    gain = np.zeros((len(means.names), len(means.columns)))
    gain[places] = bound.cov @ means.weighed(means.columns[:, places]).T
    return Linear(means.names, gain, held)


@dataclass(frozen=True)
class UndeclaredResponse:
    """What an undeclared effect does to the estimated parameters.

    Attributes
    ----------
    effect : str
        Its key.
    names : tuple of str
        Of the p estimated parameters.
    bias : ndarray, shape (p,)
        SI.
    sd : ndarray, shape (p,)
        Deviations of the estimate without it.
    """

    effect: str
    names: tuple[str, ...]
    bias: Floats
    sd: Floats

    def of(self, weights: Mapping[str, float]) -> float:
        """Bias of a weighted sum of the parameters, such as the quantity that is sought."""
        return float(sum(weight * self.bias[self.names.index(name)] for name, weight in weights.items()))

    @property
    def significance(self) -> Floats:
        """Bias over deviation, shape (p,); zero for a parameter that is known."""
        return np.divide(self.bias, self.sd, out=np.zeros_like(self.bias), where=self.sd > 0)


def sensitivity(
    means: Means, possible: Sequence[tuple[Effect, Sequence[float]]], prior: Mapping[str, float] | None = None
) -> tuple[UndeclaredResponse, ...]:
    """What each of the ``possible`` effects, with its parameters, does to the efficient estimate that lacks it.

    Parameters
    ----------
    means : Means
        The model that the estimator declares.
    possible : sequence of (Effect, parameters)
        SI, in the order of ``Effect.params``; ones for a linear effect give the sensitivity per unit.
    prior : mapping of str to float, optional
        As of `efficient`.

    Raises
    ------
    InputError
        As `efficient`, or if an effect needs what the motion lacks.
    """
    estimator = efficient(means, prior)
    sd = np.sqrt(np.diag(estimator.errors(means)))
    return tuple(
        UndeclaredResponse(
            effect.key, means.names, estimator.gain @ means.addition(effect, np.asarray(theta, float)), sd
        )
        for effect, theta in possible
    )
