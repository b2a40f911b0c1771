"""Closing the loop on a triad that is held still in many attitudes: from the recording to what was found.

Rests, then the accelerometers, then the gyros with the calibrated accelerometers as their attitude reference. What is
found belongs to the triad; each target has it with the coefficients of its own axis, and the triad's one error on
held-out rests.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.data.manifest import Manifest
from insenv.effects.base import Effect
from insenv.effects.catalogue import by_key
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes, directions
from insenv.identify.positions.accelerometers.trace import (
    trace_accelerometers,
    uncertain_calibration,
    variance_of_directions,
    wanted_rests,
)
from insenv.identify.positions.gyros.at_rest import trace_at_rest
from insenv.identify.positions.gyros.between_rests import trace_between_rests
from insenv.identify.positions.gyros.rotations import rotations
from insenv.identify.positions.model import AXES
from insenv.identify.positions.part import Part, surroundings
from insenv.identify.positions.rests import Rest, find_rests, means


@dataclass(frozen=True)
class Positions:
    """Everything that was found: ``gyro`` (None without turns) and ``at_rest`` (one of each axis) of gyros as targets.

    ``forces``, shape (rests, 3), are the calibrated specific forces of ``rests``; ``calm`` are the stretches of them by
    which gyros are judged.
    """

    rests: tuple[Rest, ...]
    calm: tuple[Rest, ...]
    remarks: tuple[str, ...]
    forces: Floats
    gravity_known: bool
    accel: Part
    gyro: Part | None = None
    at_rest: tuple[Part, ...] = ()


def trace_positions(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    tried: Sequence[Effect] | None = None,
    alpha: float = 0.01,
    progress: Callable[[str], None] = lambda text: None,
) -> Positions:
    """Find the rests, and what the declared model of the triads lacks.

    Raises
    ------
    InputError
        If a channel is missing, rests are too few, or a declared effect is none that rests show.
    """
    gyros = any(target.startswith("gyro") for target in manifest.model.targets)
    prefixes = _check(manifest, recordings, gyros)
    progress("finding rests")
    channels = [f"{prefix}_{axis}" for prefix in prefixes for axis in AXES]
    keys = None if tried is None else tuple(effect.key for effect in tried)
    found = find_rests(manifest, recordings, channels, wanted_rests(manifest, keys))
    progress("accelerometers")
    accel, left_out, known = trace_accelerometers(manifest, recordings, found, keys, alpha)
    assert isinstance(accel.problem, Magnitudes)
    after = accel.outcome.after
    forces = directions(accel.problem.measured, accel.problem.around, after.terms, after.theta)
    dropped = {rest.number for rest, left in zip(found.rests, left_out, strict=True) if left}
    calm = tuple(rest for rest in found.calm if rest.number not in dropped)
    remarks = (*found.remarks, *_named(found.rests, recordings, left_out))
    whole = Positions(found.rests, calm, remarks, forces, known, accel)
    if not gyros:
        return whole
    progress("gyros")
    around = surroundings(manifest, recordings, calm)
    directed = directions(means(recordings, calm, "accel"), around, after.terms, after.theta)
    turns = rotations(recordings, calm, directed, found.in_turn)
    if turns.turns and not (turns.fitted.any() and turns.held_out.any()):
        raise InputError(
            f"{manifest.path}: no turns between rests to fit and to score; wanted rests one after the other"
        )
    at_rest, bias = trace_at_rest(manifest, recordings, calm, (directed, around), keys, alpha)
    gyro = None
    if turns.turns:
        away = uncertain_calibration(accel, means(recordings, calm, "accel"), around)
        calibration = {rest.number: each for rest, each in zip(calm, away, strict=True)}
        noise = (variance_of_directions(accel, forces), bias, calibration)
        gyro = trace_between_rests(manifest, turns, noise, keys, alpha)
    return replace(whole, gyro=gyro, at_rest=at_rest)


def _check(manifest: Manifest, recordings: Sequence[Recording], gyros: bool) -> tuple[str, ...]:
    """The triads that the recordings have; refuses what a multi-position recording cannot be without."""
    path = manifest.path
    for target in manifest.model.targets:
        if target[-2:] not in ("_x", "_y", "_z"):
            raise InputError(f"{path}: model.target = {target!r}; procedure = 'multi-position' wants axes of a triad")
    wanted = ("accel", "gyro") if gyros else ("accel",)
    for recording in recordings:
        for prefix in wanted:
            lacking = [f"{prefix}_{a}" for a in AXES if f"{prefix}_{a}" not in recording.channels]
            if lacking:
                why = "as attitude reference of the gyros" if gyros and prefix == "accel" else "as one triad"
                found = f"{', '.join(lacking)} missing in [channels]"
                raise InputError(f"{path}: {found}; procedure = 'multi-position' wants {prefix}_x, y and z {why}")
    thermal = [key for key in manifest.model.declared if "temperature" in by_key(key).needs]
    if thermal and not all("temperature" in recording.channels for recording in recordings):
        raise InputError(f"{path}: model.declared has {thermal[0]!r}; wanted temperature in [channels]")
    whole = all(f"gyro_{axis}" in r.channels for r in recordings for axis in AXES)
    return ("accel", "gyro") if whole else ("accel",)


def _named(rests: Sequence[Rest], recordings: Sequence[Recording], left_out: NDArray[np.bool_]) -> tuple[str, ...]:
    """A sentence about rests that were left out."""
    if not left_out.any():
        return ()
    places = [
        f"{r.number} ({run.label}, {run.t[r.start]:.6g} to {run.t[r.stop - 1]:.6g} s)"
        for r, run, left in zip(rests, (recordings[r.run] for r in rests), left_out, strict=True)
        if left
    ]
    noun = "rest" if len(places) == 1 else "rests"
    return (f"{noun} {', '.join(places)} left out of every fit: what was read there fits no triad",)
