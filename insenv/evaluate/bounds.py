"""The least deviation that an estimator of what a task asks for can have, for the motion that was played.

Each system says its own (`insenv.core.system.System.bound`). What the datasheet does not tell of is not in it: so no
unbiased estimator does better, and efficiency, bound^2 / variance, is at most one but for chance.
"""

from __future__ import annotations

import numpy as np

from insenv.core.estimate import Datasheet
from insenv.core.recording import Recording
from insenv.core.system import part, systems
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
    found: dict[str, float] = {}
    for one in systems().values():
        if one.bound:
            found |= part(one.bound)(datasheet, run, quantities, scenario)
    return {name: value for name, value in found.items() if np.isfinite(value) and value > 0}
