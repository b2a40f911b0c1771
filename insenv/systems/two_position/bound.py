r"""The least deviation of an installation angle, for the motion that was played.

sigma^2 = sigma^2(phi_U at all sightings) + the sight's errors,   of eight states (`insenv.information.alignment`)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from insenv.core.estimate import Datasheet
from insenv.core.recording import Recording
from insenv.information.alignment import Stretch, after, last, unknowing
from insenv.information.alignment import instrument_of as instrument
from insenv.scenario import Scenario


def bound(
    datasheet: Datasheet, run: Recording, quantities: tuple[str, ...], scenario: Scenario | None
) -> dict[str, float]:
    """Of the installation angle, where it is asked for and turns are recorded [rad]; see `insenv.evaluate.bounds`."""
    if "installation_angle" not in quantities or "turning" not in run.channels:
        return {}
    return {"installation_angle": _installation(datasheet, run)}


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
