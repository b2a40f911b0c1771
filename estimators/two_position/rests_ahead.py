r"""What rests and turns to come will tell of the installation angle: the loop of `estimators.two_position.horizon`.

The filter of `insenv.information.alignment`, cov <- F cov F' + Q - L S^-1 L' with L = F cov H' + cross, S = H cov H' +
R, for many plans at once. The matrices are those of that module, made once for each place and each turn; of a turn the
velocities are left out. Nine states: phi now, biases, phi_U at the start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from insenv.core.compiled import jit
from insenv.core.earth import earth_rate_enu, gravity
from insenv.core.recording import Floats
from insenv.information.alignment import AlignedUnit, step_model

#: Of the eleven states of `insenv.information.alignment`.
STATES = np.array([0, 1, 2, 3, 4, 5, 6, 7, 10])
#: Step at rest and in a turn [s].
REST, TURN = 1.0, 0.25


@dataclass(frozen=True)
class RestModel:
    """One step at rest: F and Q, shape (9, 9), H, shape (2, 9), R, shape (2, 2), cross, shape (9, 2)."""

    F: Floats
    Q: Floats
    H: Floats
    R: Floats
    cross: Floats


@dataclass(frozen=True)
class Turned:
    """A whole turn: cov <- F cov F' + Q, each of shape (9, 9); ``seconds`` it takes."""

    F: Floats
    Q: Floats
    seconds: float


def place(instrument: AlignedUnit, heading: float, dt: float = REST) -> RestModel:
    """At rest with a heading [rad]."""
    F, H, Q, R, cross = _matrices(instrument, heading, dt)
    both = np.ix_(STATES, STATES)
    return RestModel(F[both], Q[both], np.ascontiguousarray(H[:, STATES]), R, np.ascontiguousarray(cross[STATES]))


def turned(instrument: AlignedUnit, heading: float, angle: float, seconds: float) -> Turned:
    """A turn by ``angle`` [rad] from a heading, counter-clockwise, at a steady rate."""
    steps = max(int(np.ceil(seconds / TURN - 1e-9)), 1)
    both = np.ix_(STATES, STATES)
    F, Q = np.eye(len(STATES)), np.zeros((len(STATES),) * 2)
    for k in range(steps):
        one, _, noise, _, _ = _matrices(instrument, heading - angle * (k + 0.5) / steps, seconds / steps)
        F, Q = one[both] @ F, one[both] @ Q @ one[both].T + noise[both]
    return Turned(F, Q, seconds)


def rested(cov: Floats, at: RestModel, seconds: float) -> Floats:
    """Covariance after whole steps of a rest, shape (9, 9)."""
    cov = cov.copy()
    none = Turned(np.eye(len(STATES)), np.zeros_like(cov), 0.0)
    found = np.empty((1, 3))
    look(cov, np.array([[float(seconds)]]), (at, at), (none, none), 0.0, found, last=cov)
    return cov


def look(
    cov: Floats,
    plans: Floats,
    places: tuple[RestModel, RestModel],
    turns: tuple[Turned, Turned],
    demanded: float,
    found: Floats,
    last: Floats | None = None,
) -> None:
    """Time and deviation at the end of each of some plans; written into ``found``.

    Parameters
    ----------
    cov : ndarray, shape (9, 9)
    plans : ndarray, shape (S, K)
        Lengths of the rests [s], a turn between any two; NaN: the plan is over.
    places : tuple of RestModel
        Here and there.
    turns : tuple of Turned
        There and back again.
    demanded : float
        Deviation of phi_U at the start at which a plan ends [rad].
    found : ndarray, shape (S, 3)
        Time until the demanded deviation [s] (infinite: not reached), time [s] and deviation [rad] at the end.
    last : ndarray, shape (9, 9), optional
        The covariance after the last plan is written there.
    """
    a, b = places
    there, back = turns
    stacked = [np.stack([getattr(a, name), getattr(b, name)]) for name in ("F", "Q", "H", "R", "cross")]
    moved = [np.stack([there.F, back.F]), np.stack([there.Q, back.Q]), np.array([there.seconds, back.seconds])]
    end = np.empty_like(cov) if last is None else last
    _compiled()(np.ascontiguousarray(cov), np.ascontiguousarray(plans), *stacked, *moved, demanded, REST, found, end)


def _matrices(instrument: AlignedUnit, heading: float, dt: float) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    g = float(gravity(instrument.latitude, instrument.altitude))
    return step_model(instrument, heading, dt, earth_rate_enu(instrument.latitude), g)


@lru_cache
def _compiled() -> Callable[..., None]:
    """The loop, compiled when it is first asked for."""
    loop: Callable[..., None] = jit(_looked)
    return loop


def _looked(  # noqa: C901, PLR0912, PLR0913, PLR0915 -- one loop over plans; numba wants it in one function
    cov: Floats,
    plans: Floats,
    F: Floats,
    Q: Floats,
    H: Floats,
    R: Floats,
    cross: Floats,
    there: Floats,
    drift: Floats,
    seconds: Floats,
    demanded: float,
    dt: float,
    found: Floats,
    last: Floats,
) -> None:
    n = cov.shape[0]
    P, M = np.empty((n, n)), np.empty((n, n))
    T, L = np.empty((n, 2)), np.empty((n, 2))
    fastest = np.inf
    for s in range(plans.shape[0]):
        for i in range(cov.shape[0]):  # a matrix at once would compile the message of shapes that differ: seconds
            for j in range(cov.shape[1]):
                P[i, j] = cov[i, j]
        time, reached, at = 0.0, np.inf, 0
        for k in range(plans.shape[1]):
            if np.isnan(plans[s, k]):
                break
            if k > 0:
                A = there[at]
                for i in range(n):
                    for j in range(n):
                        total = 0.0
                        for m in range(n):
                            total += A[i, m] * P[m, j]
                        M[i, j] = total
                for i in range(n):
                    for j in range(n):
                        total = drift[at, i, j]
                        for m in range(n):
                            total += M[i, m] * A[j, m]
                        P[i, j] = total
                time += seconds[at]
                at = 1 - at
            for _ in range(int(plans[s, k] / dt + 0.5)):
                for i in range(n):
                    for h in range(2):
                        total = 0.0
                        for m in range(n):
                            total += P[i, m] * H[at, h, m]
                        T[i, h] = total
                s00, s01, s11 = R[at, 0, 0], R[at, 0, 1], R[at, 1, 1]
                for m in range(n):
                    s00 += H[at, 0, m] * T[m, 0]
                    s01 += H[at, 0, m] * T[m, 1]
                    s11 += H[at, 1, m] * T[m, 1]
                det = s00 * s11 - s01 * s01
                # Only the attitude, the first three, is changed by the transition.
                for i in range(n):
                    for h in range(2):
                        total = cross[at, i, h] + T[i, h]
                        if i < 3:
                            total = cross[at, i, h]
                            for m in range(n):
                                total += F[at, i, m] * T[m, h]
                        L[i, h] = total
                for i in range(n):
                    for j in range(n):
                        total = P[i, j]
                        if i < 3:
                            total = 0.0
                            for m in range(6):
                                total += F[at, i, m] * P[m, j]
                        M[i, j] = total
                for i in range(n):
                    x, y = (s11 * L[i, 0] - s01 * L[i, 1]) / det, (s00 * L[i, 1] - s01 * L[i, 0]) / det
                    for j in range(i + 1):
                        total = M[i, j]
                        if j < 3:
                            total = 0.0
                            for m in range(6):
                                total += M[i, m] * F[at, j, m]
                        total += Q[at, i, j] - x * L[j, 0] - y * L[j, 1]
                        P[i, j] = total
                        P[j, i] = total
                time += dt
                if P[n - 1, n - 1] <= demanded * demanded:
                    reached = time
                    break
                if time >= fastest:
                    break
            if reached < np.inf or time >= fastest:
                break
        if reached < fastest:
            fastest = reached
        found[s, 0], found[s, 1], found[s, 2] = reached, time, np.sqrt(P[n - 1, n - 1])
    for i in range(P.shape[0]):
        for j in range(P.shape[1]):
            last[i, j] = P[i, j]
