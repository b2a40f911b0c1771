"""The calibration of a unit in the browser: the angle of each axis of the table, its rate, and how long it rests.

The dial shows the outer axis, seen along it; the face of the table with the inner axes is not seen from there, and
stands as figures among the readings. A table that is on its way, or rests, goes on with that whatever is set.
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Recording
from insenv.envs.group import Group
from insenv.envs.task import Task
from insenv.play.scene import TABLE, Control, Scene, Signal
from insenv.systems.system_calibration.env import SystemCalibration

#: Where an axis is in the table.
_PLACES = {2: ("outer axis", "inner axis"), 3: ("outer axis", "middle axis", "inner axis")}


def outer(group: Group, chunk: Recording) -> float:
    """Angle of the outer axis as it was read last [rad]."""
    del group
    return float(np.ravel(chunk.channels["axis_1"].values)[-1])


def scene(task: Task) -> Scene:
    """The scene of a table with as many axes as the scenario says."""
    assert isinstance(task.world, SystemCalibration)
    plant = task.world.plant
    gimbals, k = plant.gimbals, len(plant.gimbals.axes)
    places = _PLACES.get(k, tuple(f"axis {m + 1}" for m in range(k)))
    angles = tuple(
        Control(m, f"{place}, {letter}", "rad", scale=most, follows=True)
        for m, (place, letter, most) in enumerate(zip(places, gimbals.axes, gimbals.most, strict=True))
    )
    return Scene(
        controls=(
            *angles,
            Control(k, "rate of the way (0: the largest)", "rad/s", scale=plant.max_rate),
            Control(k + 1, "rest when there", "s", scale=gimbals.longest),
        ),
        signals=(Signal(k + 2, 1.0, "end the run here", "e", ends=True),),
        body=TABLE,
        zero="outer axis at 0",
        turned=outer,
    )
