"""What was found taken out of a recording: corrected = measured - addition.

The addition of a found effect is that of `insenv.effects` at the fitted parameters, on the exposure of the recording.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from insenv.core.exposure import expose
from insenv.core.recording import Floats, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.findings import Added, Findings


def corrected(recording: Recording, found: Findings) -> Recording:
    """The recording without the effects that were found on it.

    Parameters
    ----------
    recording : Recording
        The one run that the loop was closed on, with the references that its effects need.
    found : Findings

    Returns
    -------
    Recording
        Declared effects stay; so do generic curves, of which nobody knows what they are, and wandering lines.
    """
    channels = dict(recording.channels)
    for target in found.targets:
        for added in target.added:
            if not added.generic:
                channel = channels[target.target]
                values = channel.values - addition(recording, target.target, added)
                channels[target.target] = replace(channel, values=values)
    return replace(recording, channels=channels)


def addition(recording: Recording, target: str, added: Added) -> Floats:
    """What a found effect adds to each row of ``target``, shape (rows,), in the channel's unit."""
    values = {p.parameter: p.value for p in added.parameters}
    if "amplitude" in values:
        return _line(recording, values)
    effect = by_key(added.effect if added.order is None else f"{added.effect}:{added.order}")
    exposure = expose(recording, target, with_earth=recording.site.latitude is not None)
    theta = np.array([values.get(p.name, 0.0) for p in effect.params])
    cells, _ = effect.apply(exposure.u, exposure.motion, theta, effect.begin(exposure.motion, theta))
    # The first row's interval began before the recording: as its neighbour.
    cell = exposure.cell_of_row
    whole = np.flatnonzero(cell >= 0)
    return np.interp(np.arange(len(cell)), whole, cells[cell[whole]])


def _line(recording: Recording, values: dict[str, float]) -> Floats:
    """A line above the bin rate, which is steady if its phase is known."""
    t = recording.t - recording.t[0]
    if "phase" not in values:
        return np.zeros(len(t))
    return values["amplitude"] * np.cos(2 * np.pi * values["f"] * t + values["phase"])
