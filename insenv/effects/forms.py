"""Forms that several effects share: interval means in closed form, and regressors side by side.

Over an interval [t0, t1] of length dt the mean of an exponential is exact,

    mean exp(-t / tau) = exp(-t0 / tau) (1 - exp(-dt / tau)) / (dt / tau),

and so is that of a harmonic of an angle that turns evenly from a0 to a1,

    mean cos(n a) = cos(n (a0 + a1) / 2) sinc(n (a1 - a0) / 2),     sinc x = sin x / x.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats


def known(motion: Motion, name: str, effect: str) -> Floats:
    """Field ``name`` of the exposure, as an array.

    Raises
    ------
    InputError
        If the exposure lacks it: an effect cannot act on what nobody measured.
    """
    value = getattr(motion, name)
    if value is None:
        raise InputError(f"effect {effect!r} needs {name}, which the exposure lacks")
    return np.asarray(value)


def along_axes(values: Mapping[str, Floats]) -> list[Floats]:
    """One array for each of x, y and z; zero where an axis is unknown."""
    return [values.get(axis, np.zeros(1)) for axis in "xyz"]


def columns(u: Floats, *regressors: Floats) -> Floats:
    """Regressors side by side, shape (..., n, k), with the batch axes of ``u`` and of each of them."""
    shape = np.broadcast_shapes(np.shape(u), *(np.shape(r) for r in regressors))
    side_by_side = np.empty((*shape, len(regressors)))
    for j, regressor in enumerate(regressors):
        side_by_side[..., j] = regressor
    return side_by_side


def spread(u: Floats, addition: Floats) -> Floats:
    """An addition with the batch axes of the input ``u`` as well as its own."""
    shape = np.broadcast_shapes(np.shape(u), addition.shape)
    return addition if addition.shape == shape else np.broadcast_to(addition, shape).copy()


def decay(motion: Motion, tau: Floats) -> Floats:
    """Mean of exp(-t / tau) over each interval, shape (..., n), for time constants of shape (..., 1)."""
    x = motion.dt / tau
    mean: Floats = np.exp(-motion.t[:-1] / tau) * (-np.expm1(-x) / x)
    return mean


def harmonic(angle: Floats, order: int) -> tuple[Floats, Floats]:
    """Means of cos(n a) and sin(n a) over each interval, shape (..., n), for angles at the edges."""
    middle = 0.5 * order * (angle[..., 1:] + angle[..., :-1])
    # np.sinc(x) is sin(pi x) / (pi x).
    damping = np.sinc(np.diff(angle, axis=-1) * (0.5 * order / np.pi))
    return np.cos(middle) * damping, np.sin(middle) * damping


def time_constants(motion: Motion, count: int = 12) -> Floats:
    """Time constants that a scan tries, from a few intervals to twice the run's length; shape (g, 1)."""
    span = motion.dt * motion.n
    return np.geomspace(max(3 * motion.dt, span / 300), 2 * span, count)[:, None]


def checked_order(effect: str, order: int, highest: int) -> None:
    """Refuse an order that the effect does not have.

    Raises
    ------
    InputError
    """
    if not 1 <= order <= highest:
        raise InputError(f"effect {effect!r}: order {order} given, wanted 1 to {highest}")
