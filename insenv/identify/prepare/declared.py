"""The declared model as terms of a fit: which effects, with a coefficient in each run or one for all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats, Recording
from insenv.data.cells.tumble import tumble
from insenv.data.exposure import CHANNEL_OF, expose
from insenv.data.manifest.spec import Manifest
from insenv.data.reference import is_set
from insenv.effects.angle import LEAST_SHARE, EarthRate
from insenv.effects.base import CurveEffect, DrivenEffect, Effect, NoiseEffect
from insenv.effects.catalogue import by_key
from insenv.effects.triad import AccelMisalignment
from insenv.identify.clean.triads import of_others
from insenv.identify.fit.problem import Model, Term
from insenv.identify.fit.scatter import apart_in_temperature

#: Share of the table's rate from which an axis lies along the table's: within half a degree.
ALONG = float(np.cos(np.deg2rad(0.5)))
#: Parts of a run, of which the first and the last may be a ramp, and the share of the rates' range within which the
#: others have one rate.
PARTS, ONE_RATE = 10, 0.02
#: Runs from which on, and difference of their temperatures [K] from which on, they are the soaks of a chamber.
SOAKS, APART = 3, 5.0


def declared_model(manifest: Manifest, recordings: tuple[Recording, ...], target: str) -> Model:
    """Terms of the declared effects.

    Raises
    ------
    InputError
        If a declared effect is unknown, is noise or driven by it, has a shape to be searched, or needs a channel that
        is not there.
    """
    where = f"{manifest.path}: model.declared"
    motions = [expose(r, target).motion for r in (_head(recording) for recording in recordings)]
    terms = []
    for key in manifest.model.declared:
        effect = by_key(key, where=where)
        if of_others(manifest, recordings, target, effect, motions):
            continue
        if isinstance(effect, NoiseEffect):
            raise InputError(f"{where} names {key!r}, which is noise; wanted it in the [noise] table")
        if isinstance(effect, DrivenEffect):
            raise InputError(f"{where} names {key!r}, which is driven by chance and cannot be fitted; leave it out")
        if isinstance(effect, CurveEffect) and effect.shapes:
            names = " and ".join(p.name for p in effect.shapes)
            raise InputError(f"{where} names {key!r}, whose {names} would have to be found first; leave it out")
        missing = sorted({CHANNEL_OF.get(n.partition(".")[0], n) for m in motions for n in effect.missing(m)})
        if effect.of_earth:
            _wants_latitude(recordings, where)
            missing = []
        if missing:
            raise InputError(f"{where} names {key!r}, which needs the channel {', '.join(missing)}; the file has none")
        if not effect.of_earth or any(_sees_north(m) for m in motions):
            # On an accelerometer that turns, that wave is how the table leans: in each run as it was set up then.
            leans = effect.of_earth and target.startswith("accel")
            terms.append(
                Term(
                    _of_tilts(effect, motions),
                    per_run=leans or effect.part == "level" and _bias_per_run(manifest, recordings),
                )
            )
    if any(tumble(recording, target) for recording in recordings):
        # Nobody knows to the arcsecond how an accelerometer sits on its head, and its scale goes by the zero taken.
        terms.append(Term(AccelMisalignment()))
    return tuple(terms)


def _of_tilts(effect: Effect, motions: Sequence[Motion]) -> Effect:
    """The Earth's rate as the first run that sees it does, where others see another share; others as they are."""
    tilted = len({motion.level for motion in motions}) > 1
    first = next((motion for motion in motions if abs(motion.level) > LEAST_SHARE), motions[0])
    return effect.of_tilt(first) if isinstance(effect, EarthRate) and tilted else effect


def _sees_north(motion: Motion) -> bool:
    """Whether the axis turns through the horizontal Earth rate: not where it lies along the table's, or nothing turns.

    Its known vertical part needs no term. What a mount that is not quite along the axis sees is found like any effect.
    """
    return motion.angle is not None and abs(motion.projection) < ALONG


def without_north(manifest: Manifest, motions: Sequence[Motion]) -> tuple[str, ...]:
    """A word on a declared Earth rate of which nobody knows where its horizontal part points on a table that turns."""
    declared = [key for key in manifest.model.declared if by_key(key).of_earth]
    seen = [m for m in motions if np.ptp(m.rate) and abs(m.projection) < ALONG]
    if not declared or not seen or any(m.angle is not None for m in motions):
        return ()
    return (
        f"{declared[0]} is declared, and its horizontal part has no term: it goes with the table's angle, and the "
        "recording has no table_angle. An axis that leans sees it once a turn.",
    )


def _head(recording: Recording) -> Recording:
    """The first rows of a recording: enough to see which references there are."""
    channels = {n: replace(c, values=c.values[:16]) for n, c in recording.channels.items()}
    left_out = {name: mask[:16] for name, mask in recording.left_out.items()}
    return replace(recording, t=recording.t[:16], channels=channels, segments=(), left_out=left_out)


def _wants_latitude(recordings: tuple[Recording, ...], where: str) -> None:
    for recording in recordings:
        if recording.site.latitude is None:
            raise InputError(f"{where} names 'earth_rate', which needs site.latitude; the manifest has none")


def _bias_per_run(manifest: Manifest, recordings: tuple[Recording, ...]) -> bool:
    """A bias belongs to its power-up, unless it is said to be common or the runs are parts of one test.

    Such parts are positions of one set-up, the rates of a table, and the temperatures of a chamber: with a bias of its
    own each would tell no gain, and nothing that goes with the temperature.
    """
    if manifest.model.bias is not None:
        return manifest.model.bias == "per-run"
    one_mounting = len({replace(recording.mounting, base_turned=0.0) for recording in recordings}) == 1
    return one_mounting and not (_each_at_one_rate(recordings) or _each_at_one_temperature(recordings))


def _each_at_one_rate(recordings: tuple[Recording, ...]) -> bool:
    """Whether a table turns at one rate in each run, and not at the same one in all of them."""
    rates = [_rates(recording) for recording in recordings]
    if any(len(each) == 0 for each in rates):
        return False
    within = max(float(np.ptp(each)) for each in rates)
    return within < ONE_RATE * float(np.ptp([np.median(each) for each in rates]))


def _each_at_one_temperature(recordings: tuple[Recording, ...]) -> bool:
    """Whether the temperature hardly changes in each run, and differs between them: the soaks of a chamber."""
    if len(recordings) < SOAKS or any("temperature" not in recording.channels for recording in recordings):
        return False
    return apart_in_temperature([recording.channels["temperature"].values for recording in recordings]) > APART


def _rates(recording: Recording) -> Floats:
    """Mean rates of a table in parts of a run but for its ends, shape (k,); none where nothing says how it turns."""
    ends = np.linspace(0, len(recording) - 1, PARTS + 1).astype(int)
    if len(recording) > PARTS and "table_rate" in recording.channels:
        values = recording.channels["table_rate"].values
        return np.array([values[a:b].mean() for a, b in pairwise(ends[1:-1])])
    if len(recording) > PARTS and "table_angle" in recording.channels and not is_set(recording):
        return (np.diff(recording.channels["table_angle"].values[ends]) / np.diff(recording.t[ends]))[1:-1]
    return np.empty(0)
