r"""Whether an accelerometer's response is bent: a square, a magnitude or a cube of the specific force, left by a fit.

    rho_k = sum_i c_i u_ki h(u_ki),     h(u) = u^2, |u|, u^3,     u = f / |f|

is what a bent response of axis i leaves in the magnitude of rest k. No effect of several positions has these curves.
They are tested, not fitted, beside all that rests tell of a triad, added or not (Fisher's F on three coefficients, as
many looks as there are curves): axes that are not square, which few tilted attitudes show, hide a bend and look like
one. The verdict then says that something is left, and what it follows. Source: IEEE Std 1293-2018, model equation: K2
and K3.

And whether rests miss gravity by more than any sound accelerometer does that repeats itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from insenv.core.recording import Floats
from insenv.core.units import STANDARD_GRAVITY
from insenv.effects.triad import AccelScaleFactor
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.least_squares import Fit, normal, solve

#: What a bent response follows.
CURVES: dict[str, Callable[[Floats], Floats]] = {"square": np.square, "magnitude": np.abs, "cube": lambda u: u**3}
#: What an accelerometer repeats from rest to rest within minutes [m/s^2]: an ordinary one, as a standard deviation, and
#: the worst that is sound. The noise of the means of rests counts so many times.
REPEATS, WORST, NOISY = 1e-3, 3e-3, 5.0
#: What rests leave that no accelerometer at rest does, nor a hand that holds it: a hundredth of gravity [m/s^2], or so
#: many times the worst that is sound.
UNLIKE, UNSOUND = 0.01 * STANDARD_GRAVITY, 1.5
#: By how much what was stated and the noise of means may be smaller than they are; probability of more by chance.
NOT_EXACT, CHANCE = 1.5, 1e-3
#: Fewest degrees of freedom beside the coefficients with which a bend is told.
LEAST_FREEDOM = 4


def bent(problem: Magnitudes, fit: Fit, alpha: float, tried: Sequence[Any] = ()) -> tuple[str, ...]:
    """A reason why what is left is not noise, with the likeliest curve; empty where there is none.

    ``tried`` are terms that rests tell and that the fit may lack.
    """
    there = {term.effect.key for term in fit.terms}
    lacking = [term for term in tried if term.effect.key not in there]
    found = _by_curve(problem, solve(problem, [*fit.terms, *lacking]) if lacking else fit)
    if not found:
        return ()
    p, name = min(found)
    p *= len(found)
    if p >= alpha:
        return ()
    told = "cube" if name == "cube" else "square or the magnitude"  # which of these two, few rests tell
    return (f"rests miss gravity by what follows the {told} of the specific force: a bent response (p = {p:.1g})",)


def _by_curve(problem: Magnitudes, fit: Fit) -> list[tuple[float, str]]:
    """Of each curve beside a fit the p-value of what it explains; none where too little freedom is left."""
    used = problem.fitted
    unit = problem.measured / np.linalg.norm(problem.measured, axis=1)[:, None]
    if fit.residual.shape[1] != 1 or fit.freedom < 3 + LEAST_FREEDOM:
        return []
    # Without its prior a gravity that nobody stated explains all: no force at all has none.
    slopes, r = normal(problem, fit.residual, fit.slopes, fit.theta, fit.variance)
    beyond = np.zeros((len(r) - int(used.sum()), 3))
    bends = {name: np.linalg.solve(problem.root, unit * curve(unit))[used] for name, curve in CURVES.items()}
    columns = {name: np.vstack([bend, beyond]) for name, bend in bends.items()}
    return [(_p_value(r, slopes, each), name) for name, each in columns.items()]


def _p_value(r: Floats, slopes: Floats, columns: Floats) -> float:
    """Of the square sum that ``columns`` explain of ``r`` beside ``slopes``."""
    size = np.linalg.norm(slopes, axis=0)
    q = np.linalg.qr(slopes[:, size > 0] / size[size > 0])[0]
    fresh = columns - q @ (q.T @ columns)
    basis, spread, _ = np.linalg.svd(fresh / np.linalg.norm(columns, axis=0), full_matrices=False)
    basis = basis[:, spread > 1e-3]
    left = r - q @ (q.T @ r)
    gained, freedom = basis.shape[1], len(r) - q.shape[1] - basis.shape[1]
    if gained < 1 or freedom < LEAST_FREEDOM:
        return 1.0
    explained = float(np.sum((basis.T @ left) ** 2))
    rest = max(float(left @ left) - explained, 1e-300)
    return float(fdtrc(gained, freedom, explained / gained / (rest / freedom)))


def _beyond(scatter: float, repeats: float, noise: float, freedom: int) -> bool:
    """Whether rests scatter more than what was stated of them and their noise, neither of which is exact, by chance."""
    most = NOT_EXACT * float(np.hypot(repeats, noise))
    return float(chdtrc(freedom, freedom * (scatter / most) ** 2)) < CHANCE


def not_repeated(
    problem: Magnitudes,
    fit: Fit,
    number: NDArray[np.int64],
    noise: float,
    few: bool,
    doubted: bool,
    repeats: float | None = None,
) -> tuple[str, ...]:
    """What an instrument that repeats itself does not leave, in words; empty where it may.

    Six faces have six magnitudes: biases and scale factors fit them whatever they are, and nothing would confirm it.
    Where rests miss gravity by far more than a sound accelerometer and nothing else is doubted, nothing that was found
    explains them; a hand that holds it makes means uncertain.

    Parameters
    ----------
    problem : Magnitudes
    fit : Fit
        With all that was found.
    number : ndarray, shape (rests,)
        Of each rest or part of one.
    noise : float
        Of the mean of a rest [m/s^2].
    few : bool
        Whether rests are too few, or their attitudes, to tell scale factors.
    doubted : bool
        Whether something speaks against the fit already.
    repeats : float, optional
        What the instrument repeats from rest to rest, as stated [m/s^2]; else the worst that is sound.
    """
    worst = WORST if repeats is None else repeats
    each, used = problem.plain(fit.residual)[:, 0], problem.fitted | problem.held_out
    left = np.array([each[used & (number == k)].mean() for k in np.unique(number[used])])
    freedom = max(len(left) - sum(term.size for term in fit.terms), 1)
    scatter = float(np.sqrt(np.sum(left**2) / freedom))
    sound = max(worst, NOISY * noise)
    if repeats is not None and not few and not doubted and _beyond(scatter, repeats, noise, freedom):
        return (
            f"rests leave {1e3 * scatter:.2g} mm/s^2, where {1e3 * repeats:g} mm/s^2 from rest to rest, as stated, and "
            f"{1e3 * noise:.2g} mm/s^2 of noise of their means would be left",
        )
    if scatter < sound or not (few or (scatter > min(UNLIKE, UNSOUND * sound) and not doubted)):
        return ()
    said = f"rests leave {1e3 * scatter:.2g} mm/s^2, where an accelerometer repeats itself to about {1e3 * worst:g}"
    return (f"{said}: {AccelScaleFactor.id} would explain it, and more attitudes would tell" if few else said,)
