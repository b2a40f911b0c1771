"""The catalogue's effects made ready for a test: fitted to a motion, with parameters and unit normals."""

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import CurveEffect, DrivenEffect, Effect
from insenv.effects.catalogue import ALL, by_key

KEYS = [effect.key for effect in ALL]
RANDOM = [effect.key for effect in ALL if isinstance(effect, DrivenEffect)]
CURVES = [effect.key for effect in ALL if isinstance(effect, CurveEffect)]
DETERMINISTIC = [key for key in KEYS if key not in RANDOM]


def on(motion: Motion, key: str) -> Effect:
    """The effect, with a spline's knots over the range of the motion."""
    return by_key(key).over(motion)


def typical(effect: Effect, motion: Motion) -> Floats:
    """Half a standard deviation in each linear parameter and shapes from the middle of the grid."""
    linear = np.array([0.5 * p.sd for p in effect.linear])
    if not isinstance(effect, CurveEffect):
        return np.concatenate([linear, [0.5 * p.sd for p in effect.shapes]])
    grid = effect.grid(motion)
    return np.concatenate([linear, grid[len(grid) // 2]])


def normals(effect: Effect, n: int, batch: tuple[int, ...] = ()) -> Floats | None:
    draws = effect.draws if isinstance(effect, DrivenEffect) else 0
    return np.random.default_rng(1).standard_normal((*batch, draws, n)) if draws else None


def addition(effect: Effect, motion: Motion, theta: Floats, u: Floats | None = None) -> Floats:
    u = motion.rate if u is None else u
    return effect.apply(u, motion, theta, effect.begin(motion, theta), normals(effect, motion.n, u.shape[:-1]))[0]
