r"""What flicker noise and random walk of the rate do to the line through dwells: they are one for all of its dwells.

    var(sum c_i m_i) = sum c_i^2 sigma_i^2 + c' C c,      C = sum_n c_n^2 Q_n

with C the covariance of the means over the dwells that the datasheet's slow noises have since the power-up
(`insenv.effects.base.NoiseEffect.covariance`). Of the residuals it is (1 - H) C (1 - H)', H the line's hat matrix: what
dwells scatter beyond that is a spread of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats
from insenv.core.series.allan import FLICKER, WALK
from insenv.effects.base import NoiseEffect
from insenv.effects.catalogue import by_key

#: Noises that outlast a dwell, and the step of time to which a dwell's ends are told [s].
SLOW, STEP = (FLICKER, WALK), 0.1
Covariance = Callable[[Floats, Floats], Floats]


def covariance_of(datasheet: Datasheet) -> Covariance | None:
    """Covariance of means from ``start``, lasting ``time`` [s], shape (m,) each; None where no slow noise is told."""
    noises = tuple((name, c) for name in SLOW if (c := datasheet.coefficient("gyro", name)) > 0)
    if not noises:
        return None
    return lambda start, time: _kept(noises, np.rint(np.stack([start, start + time]) / STEP).astype(np.int64).tobytes())


@lru_cache(maxsize=64)
def _kept(noises: tuple[tuple[str, float], ...], ends: bytes) -> Floats:
    start, stop = np.frombuffer(ends, np.int64).reshape(2, -1)
    stop = np.maximum(stop, start + 1)
    edges = np.unique(np.concatenate([[0], start, stop]))
    lengths = np.diff(edges)
    # Each dwell's mean from those of the cells between all ends.
    inside = (edges[:-1] >= start[:, None]) & (edges[1:] <= stop[:, None])
    shares = inside * lengths / np.maximum((inside * lengths).sum(axis=1), 1)[:, None]
    total = np.zeros((len(lengths), len(lengths)))
    for name, coefficient in noises:
        effect = by_key(name)
        assert isinstance(effect, NoiseEffect)
        total += coefficient**2 * effect.covariance(edges, STEP)
    return np.asarray(shares @ total @ shares.T)


def drift(
    covariance: Covariance | None, start: Floats, time: Floats, there: NDArray[np.bool_], began: Floats
) -> Floats:
    """Covariances of the dwells that are ``there``, shape (..., m, m); zero for the others.

    Parameters
    ----------
    covariance : callable, optional
        Of `covariance_of`.
    start, time : ndarray, shape (..., m)
        Of the dwells [s].
    there : ndarray of bool, shape (..., m)
    began : ndarray, shape (...)
        When the power-up began [s]: a walk is zero there.
    """
    m = there.shape[-1]
    rows = there.reshape(-1, m)
    found = np.zeros((len(rows), m, m))
    if covariance is not None:
        since = np.maximum((start - began[..., None]).reshape(-1, m), 0.0)
        lasting = time.reshape(-1, m)
        for r, mask in enumerate(rows):
            if mask.any():
                found[r][np.ix_(mask, mask)] = covariance(since[r, mask], lasting[r, mask])
    return found.reshape(*there.shape, m)
