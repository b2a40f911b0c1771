"""Noise that several channels have in common: one cause on all of them, electronics or vibration.

    rho_ij = median-free correlation of the steps from row to row of channels i and j,      z = atanh(rho) sqrt(n)

Steps leave out what is slow. A pair has noise in common where |rho| is `LEAST` or more and z beyond chance among all
pairs; pairs that share a channel are one group. It is a finding of its own, for a fit of one channel alone may take the
other's noise for its cause.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from insenv.core.recording import Floats, Recording
from insenv.core.series.robust import OF_MEDIAN
from insenv.data.manifest.spec import ACCELEROMETERS, GYROS, Manifest
from insenv.identify.findings import CommonMode

#: Correlation below which it does not matter.
LEAST = 0.2
#: Deviate beyond which it is no chance, among the 15 pairs of two triads.
SURE = 6.0
#: Steps beyond so many robust deviations are knocks.
KNOCK = 6.0


def common_mode(manifest: Manifest, recordings: Sequence[Recording]) -> tuple[CommonMode, ...]:
    """Groups of gyros and accelerometers with noise in common; none where something is meant to move."""
    if manifest.procedure != "static":
        return ()
    names = [n for n in (*GYROS, *ACCELEROMETERS) if all(n in r.channels for r in recordings)]
    if len(names) < 2:
        return ()
    steps = np.concatenate([_steps(r, names) for r in recordings])
    if len(steps) < SURE**2:
        return ()
    rho = np.corrcoef(steps.T) if np.ptp(steps, axis=0).all() else np.eye(len(names))
    sure = max(LEAST, float(np.tanh(SURE / np.sqrt(len(steps)))))
    groups: list[set[int]] = []
    for i, j in combinations(range(len(names)), 2):
        if abs(rho[i, j]) >= sure:
            joined = [g for g in groups if g & {i, j}]
            groups = [g for g in groups if g not in joined] + [{i, j}.union(*joined)]
    return tuple(_found(names, rho, sorted(group)) for group in groups)


def common_remarks(found: Sequence[CommonMode]) -> tuple[str, ...]:
    """A sentence about each."""
    cause = "one cause on all of them, electronics or vibration"
    names = [f"{', '.join(one.channels[:-1])} and {one.channels[-1]}" for one in found]
    return tuple(
        f"{name} have noise in common (correlation {one.correlation:.2f}): {cause}"
        for name, one in zip(names, found, strict=True)
    )


def _found(names: Sequence[str], rho: Floats, group: Sequence[int]) -> CommonMode:
    inside = np.abs(rho[np.ix_(group, group)][np.triu_indices(len(group), 1)])
    return CommonMode(tuple(names[k] for k in group), float(inside.max()))


def _steps(recording: Recording, names: Sequence[str]) -> Floats:
    """Steps from row to row in robust deviations, rows in use without knocks, shape (rows, channels)."""
    steps = np.diff(np.stack([recording.channels[name].values for name in names], axis=1), axis=0)
    if recording.unused is not None:
        steps = steps[~(recording.unused[1:] | recording.unused[:-1])]
    if not len(steps):
        return steps
    size = OF_MEDIAN * np.median(np.abs(steps - np.median(steps, axis=0)), axis=0)
    # A channel of few counts mostly stands still: then its steps themselves are the measure.
    size = np.where(size > 0, size, np.maximum(steps.std(axis=0), 1e-300))
    scaled = steps / size
    return np.asarray(scaled[(np.abs(scaled) < KNOCK).all(axis=1)], np.float64)
