"""Problems of one target from recordings, and the covariance of means of noise, for the tests of fits."""

from __future__ import annotations

from typing import Literal

import numpy as np
from simulated_runs import manifest, use

from insenv.core.recording import Floats, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.prepare.problems import prepare

#: Width of the bins [s].
WIDTH = 2.0


def problem_of(
    *recordings: Recording,
    declared: tuple[str, ...] = ("bias", "scale_factor"),
    bias: Literal["common", "per-run"] | None = None,
    averaging: float | None = None,
    samples: bool = True,
) -> tuple[Problem, Model]:
    """Bins and declared terms, 60 % of each run fitted; lines and a hold are looked for in the ``samples``."""
    asked = manifest(declared=declared, bias=bias, averaging=averaging)
    uses = tuple(use(len(r)) for r in recordings)
    prepared = prepare(asked, recordings, uses, asked.model.targets[0], tones=samples, holds=samples)
    return prepared.plain, prepared.model


def terms(*keys: str) -> Model:
    return tuple(Term(by_key(key)) for key in keys)


def covariance(n: int, white: float, walk: float, errors: float = 0.0) -> Floats:
    """Of means over WIDTH of white noise, a random walk from zero and angle errors at the edges, (n, n)."""
    k = np.arange(n)
    # Means of a Wiener process over [i, i + 1]: min + 1/2 off the diagonal, i + 1/3 on it, in units of WIDTH.
    wander = np.minimum.outer(k, k) + 0.5 - np.eye(n) / 6
    difference = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return white / WIDTH * np.eye(n) + walk * WIDTH * wander + errors / WIDTH**2 * difference
