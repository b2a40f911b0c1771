"""Textbook causes that this procedure cannot tell from the true one: nobody can blame a search that names them.

A rival j takes the strength of the true addition a away: beside the declared model and j's best curve less than
`UNTOLD` of it is left.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from blind import curves
from blind.plan import Plan
from blind.record import HELD_OUT, declared_columns, true_noise
from blind.strength import Ruler
from blind.table import Floats
from blind.world import World

#: Strength below which two causes are not told apart.
UNTOLD = 3.0
ROWS = 8000


def _curves(plan: Plan) -> Iterator[tuple[str, Floats]]:
    """Curves (n,) or (n, k) of every textbook cause that the recording's channels could show."""
    w = plan.world
    yield "bias_drift", curves.drift(w)
    for tau in w.duration * np.array([0.03, 0.06, 0.1, 0.15, 0.22, 0.35, 0.6]):
        yield "bias_warm_up", curves.warm_up(w, tau)
        if w.turning:
            yield "scale_factor_warm_up", curves.scale_warm_up(w, tau)
    for t0 in w.duration * np.linspace(0.04, 0.56, 40):
        yield "bias_step", curves.step(w, t0)
    if plan.thermometer:
        yield from _thermal(plan)
    if w.turning and np.any(w.u):
        yield from _turning(plan)


def _thermal(plan: Plan) -> Iterator[tuple[str, Floats]]:
    w = plan.world
    first, second, third = (curves.temperature(w, k) for k in (1, 2, 3))
    yield "bias_temperature:1", first
    yield "bias_temperature:2", np.column_stack([first, second])
    yield "bias_temperature:3", np.column_stack([first, second, third])
    yield "bias_temperature_rate", curves.temperature_rate(w)
    for tau in w.duration * np.array([0.01, 0.03, 0.06, 0.1, 0.2, 0.4]):
        yield "bias_thermal_lag", curves.thermal_lag(w, tau)
    if w.turning:
        yield "scale_factor_temperature", curves.scale_temperature(w)


def _turning(plan: Plan) -> Iterator[tuple[str, Floats]]:
    w = plan.world
    yield "scale_factor_drift", curves.scale_drift(w)
    yield "scale_factor_asymmetry", curves.asymmetry(w)
    yield "scale_factor_cubic", curves.cubic(w)
    top = float(np.abs(w.u).max())
    yield "lock_in", curves.lock_in(w, 0.01 * top)
    for centre in top * np.linspace(0.05, 1.0, 20):
        for width in top * np.array([0.04, 0.1]):
            yield "scale_factor_anomaly", curves.anomaly(w, centre, width)
    for k in (1, 2, 3, 4):
        both = [curves.locked(w, k, phase) for phase in (0.0, np.pi / 2)]
        yield f"angle_locked_rate:{k}", np.column_stack(both)
        if plan.reference in ("angle", "both"):
            read = [w.encoder_shift(curves.encoder(w, k, phase)) for phase in (0.0, np.pi / 2)]
            yield f"encoder_harmonic:{k}", np.column_stack(read)
    yield "timing_skew", w.encoder_shift(curves.late(w, 1e-3))


def rivals(plan: Plan, declared: tuple[str, ...], addition: Floats, untold: float = UNTOLD) -> dict[str, float]:
    """What is left of ``addition`` beside each textbook cause; only those that leave less than ``untold``."""
    w = plan.world
    step = max(1, w.n // ROWS)
    if _fastest(w) * step * w.dt > 0.7:
        step = max(1, int(0.7 / _fastest(w) / w.dt))

    count = w.each // step

    def thin(columns: Floats) -> Floats:
        by_run = columns.reshape(w.runs, w.each, *columns.shape[1:])[:, : count * step]
        return by_run.reshape(w.runs * count, step, *columns.shape[1:]).mean(axis=1)

    # Gaps are left aside: what a few lost rows tell makes no rival.
    fitted = [np.arange(int((1 - HELD_OUT) * count)) + run * count for run in range(w.runs)]
    measure = Ruler(true_noise(plan), w.dt * step, fitted, thin(declared_columns(plan, declared)))
    a = thin(addition)
    best: dict[str, float] = {}
    for key, curve in _curves(plan):
        best[key] = min(best.get(key, np.inf), measure.beside(a, thin(curve)))
    return {key: left for key, left in best.items() if left < untold}


def _fastest(w: World) -> float:
    return float(np.abs(w.trajectory.rate(w.rows)).max()) + 1e-9
