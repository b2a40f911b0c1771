"""The bound of `insenv.information.alignment` for searches: one set of matrices for a rest, a compiled loop.

Without the velocities of the turns, it is the bound of `alignment.bound` within 1e-3.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from insenv.core.compiled import jit
from insenv.core.earth import earth_rate_enu, gravity
from insenv.core.recording import Floats
from insenv.information.alignment import AlignedUnit, Stretch, step_model, unknowing

#: Longest step at rest, and while the body turns [s].
_REST, _TURN = 1.0, 1.0
#: Heading and length of a step whose matrices are kept are told to so much [rad], [s].
_SAME = 1e-9


def compiled(function: Callable[..., Any]) -> Any:
    """The function compiled, with divisions as NumPy has them."""
    return jit(function, error_model="numpy")


def installation_sd(instrument: AlignedUnit, stretches: Sequence[Stretch], heading: float = 0.0) -> float:
    """Deviation of phi_U at the start [rad] without the turns' velocities; see `insenv.information.alignment.bound`."""
    cov = unknowing(instrument, heading).cov
    for stretch in stretches:
        if stretch.duration <= 0:
            continue
        steps = int(np.ceil(stretch.duration / (_TURN if stretch.turn else _REST) - 1e-9))
        dt, share = stretch.duration / steps, stretch.turn / steps
        if stretch.turn:
            pairs = [_matrices(instrument, _near(heading - (k + 0.5) * share), _near(dt)) for k in range(steps)]
            cov = _predicted(cov, np.array([F for F, *_ in pairs]), np.array([Q for _, _, Q, *_ in pairs]))
        else:
            cov = _filtered(cov, *_matrices(instrument, _near(heading), _near(dt)), steps)
        heading -= stretch.turn
    return float(np.sqrt(cov[10, 10]))


def _near(value: float) -> float:
    return round(value / _SAME) * _SAME


@lru_cache(maxsize=4096)
def _matrices(instrument: AlignedUnit, heading: float, dt: float) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    return step_model(instrument, heading, dt, *_earth(instrument.latitude, instrument.altitude))


@lru_cache(maxsize=16)
def _earth(latitude: float, altitude: float) -> tuple[Floats, float]:
    return earth_rate_enu(latitude), float(gravity(latitude, altitude))


@compiled
def _predicted(cov, transitions, noises):
    for k in range(len(transitions)):
        cov = transitions[k] @ cov @ transitions[k].T + noises[k]
    return cov


@compiled
def _filtered(cov, transition, regressor, noise, own, cross, steps):
    for _ in range(steps):
        seen = cov @ regressor.T
        S = regressor @ seen + own
        lean = transition @ seen + cross
        cov = transition @ cov @ transition.T + noise - lean @ np.linalg.inv(S) @ lean.T
        cov = 0.5 * (cov + cov.T)
    return cov
