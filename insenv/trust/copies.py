r"""Altered copies of a recording, in which what is true is known.

With the reading ``y`` of a channel, what was found in it taken out, and the residual ``r = y - u - model``,

    y' = y - r + r'          nothing to find: r' is r without its relation to what the instrument was exposed to
    y' = y + e(u; theta)     one effect to find, of a known size

``r'`` is, in one half of the copies, r from another instant on, continued at both ends by its mirror image, with either
sign: bursts and noise that changes its size stay as they are. In the other half every mode of its cosine transform has
a sign by chance: such copies differ in all modes. Both keep the spectrum, and leave no jump in a random walk.
After Kepler's inverted and scrambled light curves, Christiansen (2017), KSCI-19110, and the surrogates of Theiler et
al. (1992), Physica D 58, 77-94.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct

from insenv.calibration import calibration
from insenv.calibration.apply import is_determined, of_rows, rows_of, slopes_of
from insenv.core.recording import Floats, Recording
from insenv.data.exposure import expose
from insenv.data.manifest import Manifest
from insenv.effects.angle import EarthRate
from insenv.effects.base import Effect
from insenv.identify.findings import Findings


@dataclass(frozen=True)
class Base:
    """A recording, one per run, without what was found in it.

    Attributes
    ----------
    manifest : Manifest
    recordings : tuple of Recording
    noise : tuple of mapping of str to ndarray, shape (rows,)
        Residual of each target, run by run; NaN in rows that are no measurement of it.
    left : mapping of str to tuple of str
        Of each target: keys of what was found and is in the residual still, such as a line whose phase wanders.
    """

    manifest: Manifest
    recordings: tuple[Recording, ...]
    noise: tuple[Mapping[str, Floats], ...]
    left: Mapping[str, tuple[str, ...]]


def base(manifest: Manifest, recordings: Sequence[Recording], found: Findings) -> Base:
    """What copies are made of."""
    whole = calibration(found, manifest)
    without, noise = [], []
    for run, recording in enumerate(recordings):
        channels, residuals = dict(recording.channels), {}
        for target in whole.targets:
            name, channel = target.target, channels[target.target]
            exposure = expose(recording, name, 1, whole.reference_temperature, whole.with_earth)
            parts = {
                origin: sum(
                    (rows_of(t, recording, exposure, run + 1) for t in target.terms if t.origin == origin),
                    np.zeros(len(recording)),
                )
                for origin in ("declared", "added")
            }
            channels[name] = replace(channel, values=channel.values - parts["added"])
            residual = channels[name].values - parts["declared"] - of_rows(exposure.motion.rate, exposure)
            measured = ~_rejected(found, run, name, recording) & (exposure.cell_of_row >= 0)
            slopes = [slopes_of(t, recording, exposure, run + 1) for t in target.terms]
            residuals[name] = _unexplained(
                residual, np.concatenate([np.ones((len(residual), 1)), *slopes], 1), measured
            )
        without.append(replace(recording, channels=channels))
        noise.append(residuals)
    left = {
        t.target: tuple(dict.fromkeys(term.effect for term in t.terms if not is_determined(term)))
        for t in whole.targets
    }
    return Base(manifest, tuple(without), tuple(noise), left)


def _unexplained(residual: Floats, slopes: Floats, measured: NDArray[np.bool_]) -> Floats:
    """What parameters fitted to all rows would leave of a residual, shape (rows,); NaN in rows that are not measured.

    Those of the loop were fitted to a part of the rows: what they leave of the others has curves of the model in it.
    """
    scale = np.sqrt(np.mean(slopes[measured] ** 2, axis=0))
    columns = slopes[measured][:, scale > 0] / scale[scale > 0]
    moved, *_ = np.linalg.lstsq(columns, residual[measured], rcond=1e-9)
    left = np.full(len(residual), np.nan)
    left[measured] = residual[measured] - columns @ moved
    return left


def _rejected(found: Findings, run: int, target: str, recording: Recording) -> NDArray[np.bool_]:
    rows = np.zeros(len(recording), bool)
    for r in found.rows_rejected:
        if (r.run, r.target) == (run, target):
            rows[r.start : r.stop] = True
    return rows


def without_effects(given: Base, rng: np.random.Generator) -> tuple[Recording, ...]:
    """A copy in which nothing is to be found.

    All channels have one sign and begin at one instant, or the signs of their modes are the same: what they have in
    common stays so.
    """
    sign, part, modes = rng.choice([-1.0, 1.0]), rng.random(), rng.random() < 0.5
    seed = int(rng.integers(2**63))

    def other(series: Floats) -> Floats:
        if modes:
            return scrambled(series, np.random.default_rng(seed))
        return sign * mirrored(series, round(part * 2 * len(series)))

    return tuple(
        _altered(recording, noise, other) for recording, noise in zip(given.recordings, given.noise, strict=True)
    )


def _altered(recording: Recording, noise: Mapping[str, Floats], other: Callable[[Floats], Floats]) -> Recording:
    """The recording with another series in the place of the residual of each channel."""
    channels = dict(recording.channels)
    for target, residual in noise.items():
        kept = np.isfinite(residual)
        values = channels[target].values.copy()
        values[kept] += other(residual[kept]) - residual[kept]
        channels[target] = replace(channels[target], values=values)
    return replace(recording, channels=channels)


def mirrored(series: Floats, start: int) -> Floats:
    """As many values of a series from ``start`` on, which its mirror image continues: shape (n,)."""
    n = len(series)
    index = (np.arange(n) + start) % max(2 * n, 1)
    return series[np.where(index < n, index, 2 * n - 1 - index)]


def scrambled(series: Floats, rng: np.random.Generator) -> Floats:
    """A series of the same modes, each of either sign: shape (n,)."""
    modes = dct(series, norm="ortho")
    return np.asarray(idct(modes * rng.choice([-1.0, 1.0], size=len(series)), norm="ortho"))


def with_effect(given: Base, target: str, effect: Effect, theta: Floats) -> tuple[Recording, ...]:
    """A copy with one effect more on one target, of the parameters ``theta`` [SI], shape (p,)."""
    return tuple(_with_effect(given, recording, target, effect.near(theta), theta) for recording in given.recordings)


def _with_effect(given: Base, recording: Recording, target: str, effect: Effect, theta: Floats) -> Recording:
    declared = given.manifest.model
    exposure = expose(recording, target, 1, declared.reference_temperature, EarthRate.id in declared.declared)
    motion = exposure.motion
    added, _ = effect.apply(exposure.u, motion, theta, effect.begin(motion, theta))
    channel = recording.channels[target]
    values = channel.values + of_rows(np.asarray(added), exposure)
    return replace(recording, channels={**recording.channels, target: replace(channel, values=values)})
