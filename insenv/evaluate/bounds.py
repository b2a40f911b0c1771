r"""The least deviation that an estimator of what a task asks for can have, for the motion that was played.

    north:         M = X' C^-1 X + diag(1 / sd_j^2),   X: Earth's rate, declared effects (`insenv.information.fisher`)
    installation:  phi_U at all sightings, of eight states (`insenv.information.alignment`), with the sight's errors
    scale factor:  slope of the line, all noises of the datasheet, power-ups (`insenv.evaluate.rate_bound`)

What the datasheet does not tell of is not in it, nor, of north, what makes it larger (flicker noise, effects that are
not smooth): so no unbiased estimator does better, and efficiency, bound^2 / variance, is at most one but for chance.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Recording
from insenv.effects.angle import EarthRate
from insenv.effects.base import CurveEffect, Effect, LinearEffect
from insenv.effects.catalogue import by_key
from insenv.evaluate.rate_bound import scale_factor_bound
from insenv.information.alignment import Stretch, after, last, unknowing
from insenv.information.alignment import told as instrument
from insenv.information.fisher import IncrementNoise, information, north_bound
from insenv.information.rate_noise import white_angle
from insenv.scenario import Scenario


def bounds(
    datasheet: Datasheet, run: Recording, quantities: tuple[str, ...], scenario: Scenario | None = None
) -> dict[str, float]:
    """Least standard deviation of each of the ``quantities`` of which there is a bound [SI].

    Parameters
    ----------
    datasheet : Datasheet
    run : Recording
        One run, of which the motion is taken.
    quantities : tuple of str
    scenario : Scenario, optional
        Which a bound of the rate table needs, for what changes from power-up to power-up.
    """
    found = {}
    if "azimuth" in quantities and "table_angle" in run.channels:
        found["azimuth"] = _north(datasheet, run)
    if "installation_angle" in quantities and "turning" in run.channels:
        found["installation_angle"] = _installation(datasheet, run)
    # Another task's scale factor is that of the moment, and no slope.
    if "scale_factor" in quantities and scenario is not None and _is_rate_table(scenario):
        found["scale_factor"] = scale_factor_bound(datasheet, run, scenario)
    return {name: value for name, value in found.items() if np.isfinite(value) and value > 0}


def _is_rate_table(scenario: Scenario) -> bool:
    return scenario.task is not None and scenario.task.kind == "rate-table"


def _north(sheet: Datasheet, run: Recording) -> float:
    """Root mean square over all azimuths [rad]."""
    latitude, tilt = sheet.site.latitude, sheet.mounting.tilt
    noise = IncrementNoise(sheet.coefficient("gyro", "angle_random_walk"), white_angle(sheet))
    if latitude is None or not (noise.walk > 0 or noise.angle > 0):
        return np.inf
    motion = _turned(sheet, run)
    effects: list[Effect] = [EarthRate()]
    theta: list[float] = [0.0, 0.0]
    prior: dict[str, float] = {}
    for told in sheet.declared:
        effect = by_key(told.effect)
        if told.target != "gyro" or not isinstance(effect, LinearEffect | CurveEffect) or any(_lacks(effect, motion)):
            continue
        effects.append(effect)
        theta += told.mean
        prior |= {f"{effect.key}.{p.name}": sd for p, sd in zip(effect.params, told.sd, strict=True)}
    found = information(motion, effects, noise, np.array(theta)).given(prior).bound()
    return north_bound(found, EARTH_RATE * float(np.cos(latitude) * np.cos(tilt)))


def _turned(sheet: Datasheet, run: Recording) -> Motion:
    """Motion of the gyro on the table, whose recorded angle is taken for the true one."""
    reading = np.asarray(run.values("table_angle", "rad"), float)
    angle = np.concatenate([[0.0], reading])
    t = np.concatenate([[run.t[0] - sheet.dt], run.t])
    share = float(np.sin(sheet.mounting.tilt))
    vertical = EARTH_RATE * float(np.sin(sheet.site.latitude or 0.0)) * share
    rate = np.diff(angle) / sheet.dt * share + vertical
    edges = np.concatenate([rate[:1], 0.5 * (rate[1:] + rate[:-1]), rate[-1:]])
    return Motion(t=t, rate=rate, angle=angle, rate_edges=edges, projection=share)


def _lacks(effect: Effect, motion: Motion) -> list[str]:
    there = {need: getattr(motion, need.partition(".")[0], None) for need in effect.needs}
    return [need for need, value in there.items() if value is None or (isinstance(value, Mapping) and not value)]


def _installation(sheet: Datasheet, run: Recording) -> float:
    """Of the inertial part, of the sight's errors, and of what was known before [rad]."""
    told = sheet.sight
    if told is None or sheet.site.latitude is None:
        return np.inf
    seen = run.values("sight_heading", "rad")
    at = np.flatnonzero(np.isfinite(seen))
    box = instrument(sheet)
    known = unknowing(box, float(seen[at[0]]) if len(at) else 0.0)
    for stretch, sighted in _stretches(run, at[1:] + 1):
        known = last(after(box, known, stretch, turning_data=True), known)
        known = known.sighted() if sighted else known
    data = np.hypot(known.target(told.tracking), told.orientation)
    return float((data**-2 + told.installation**-2.0) ** -0.5)


def _stretches(run: Recording, cuts: NDArray[np.int64]) -> list[tuple[Stretch, bool]]:
    """Rests and turns, whose angle the gyro that points up tells, and whether each ends with a cut."""
    turning = run.values("turning", "1") > 0
    up, dt = run.values("gyro_z", "rad/s"), run.dt
    edges = sorted({0, *(np.flatnonzero(np.diff(turning)) + 1).tolist(), *cuts.tolist(), len(turning)})
    return [
        (Stretch((b - a) * dt, float(up[a:b].sum() * dt) if turning[a] else 0.0), b in cuts)
        for a, b in zip(edges[:-1], edges[1:], strict=True)
        if b > a
    ]
