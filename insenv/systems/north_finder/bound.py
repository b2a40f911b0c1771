r"""The least deviation of an azimuth, for the motion that was played.

    M = X' C^-1 X + diag(1 / sd_j^2),   X: Earth's rate, declared effects (`insenv.information.fisher`)

What makes it larger (flicker noise, effects that are not smooth) is not in it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Recording
from insenv.effects.angle import EarthRate
from insenv.effects.base import CurveEffect, Effect, LinearEffect
from insenv.effects.catalogue import by_key
from insenv.information.fisher import IncrementNoise, information, north_bound
from insenv.information.rate_noise import white_angle
from insenv.scenario import Scenario


def bound(
    datasheet: Datasheet, run: Recording, quantities: tuple[str, ...], scenario: Scenario | None
) -> dict[str, float]:
    """Of the azimuth, where it is asked for and the table's angle is recorded [rad]; see `insenv.evaluate.bounds`."""
    if "azimuth" not in quantities or "table_angle" not in run.channels:
        return {}
    return {"azimuth": _north(datasheet, run)}


def _north(sheet: Datasheet, run: Recording) -> float:
    """Root mean square over all azimuths [rad]."""
    latitude, tilt = sheet.site.latitude, sheet.mounting.tilt
    noise = IncrementNoise(sheet.white("gyro"), white_angle(sheet))
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
