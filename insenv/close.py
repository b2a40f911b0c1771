"""Closing the loop on a manifest: read, split, trace, assemble."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path

from insenv import datasets
from insenv.core.errors import InputError
from insenv.core.estimate import Limits
from insenv.core.recording import Recording
from insenv.data.cells.tumble import tumble
from insenv.data.load import read_recordings
from insenv.data.manifest import Manifest, load_manifest
from insenv.data.power import by_power_up
from insenv.data.reference import sentences
from insenv.data.remarks import remarks
from insenv.data.split import RowUse, other_folds, sentence_of_split, split, with_uses, without_tails
from insenv.data.turned_about import about_its_axis
from insenv.effects.base import DrivenEffect, Effect, NoiseEffect
from insenv.effects.catalogue import TUMBLE, by_key, catalogue
from insenv.identify.assemble import findings
from insenv.identify.clean.common import common_mode, common_remarks
from insenv.identify.clean.gains import clock_cautions, gain_cautions
from insenv.identify.clean.motion import motion_cautions
from insenv.identify.clean.plausibility import implausible, without_dead
from insenv.identify.findings import Findings
from insenv.identify.folds import by_other_folds
from insenv.identify.formula import formulas_of, with_laws
from insenv.identify.loop import Outcome, trace
from insenv.identify.own_levels import with_own_levels
from insenv.identify.positions.findings import position_findings
from insenv.identify.positions.on_axes.findings import unit_findings
from insenv.identify.positions.on_axes.trace import on_axes, trace_unit
from insenv.identify.positions.trace import trace_positions


def close(  # noqa: PLR0913 -- as the options of the command
    manifest: str | Path,
    effects: Sequence[str] | None = None,
    alpha: float = 0.01,
    seed: int = 0,
    progress: Callable[[str], None] = lambda text: None,
    limits: Limits | None = None,
    allow_code: bool = False,
    formula: bool = False,
) -> Findings:
    """Find the residual of the declared model and the effects that it lacks.

    Parameters
    ----------
    manifest : str or Path
        A manifest file, or the name of a recording of `insenv.datasets`.
    effects : sequence of str, optional
        Keys of the effects to try; all of the catalogue, and those of installed packages, by default.
    alpha : float
        Probability of a false discovery, per target.
    seed : int
        Of the simulated noise that calibrates the search.
    progress : callable
        Told what is being done.
    limits : Limits, optional
        Of the table, for the next experiment; without them it goes no faster than it has gone.
    allow_code : bool
        Whether the manifest may name effects as "module:Name".
    formula : bool
        Whether a formula is sought for what no effect explains (`insenv.identify.formula`).

    Raises
    ------
    InputError
        If anything given cannot be used.
    """
    _check(alpha, seed)
    tried = None if effects is None else _chosen(effects)
    read = opened(manifest, progress, allow_code)
    progress("reading the recording")
    return close_on(read, by_power_up(read_recordings(read)), tried, alpha, seed, progress, limits, formula)


def close_on(  # noqa: PLR0913 -- as of `close`
    read: Manifest,
    recordings: tuple[Recording, ...],
    tried: tuple[Effect, ...] | None = None,
    alpha: float = 0.01,
    seed: int = 0,
    progress: Callable[[str], None] = lambda text: None,
    limits: Limits | None = None,
    formula: bool = False,
) -> Findings:
    """As `close`, on recordings in memory, one per run, that are as ``read`` says.

    Raises
    ------
    InputError
        If they cannot be used.
    """
    _check(alpha, seed)
    recordings, about = about_its_axis(recordings, read.model.targets)
    read, dead = without_dead(read, recordings)
    doubts = implausible(read, recordings)
    more = tuple(_effect(key, f"{read.path}: model.effects") for key in read.model.effects)
    tried = (*catalogue(), *more) if tried is None and more else tried
    if read.procedure == "multi-position" and on_axes(recordings):
        unit = trace_unit(read, recordings, tried, alpha, progress)
        found = unit_findings(read, recordings, unit, remarks(recordings), alpha, seed)
    elif read.procedure == "multi-position":
        traced = trace_positions(read, recordings, tried, alpha, progress)
        found = position_findings(read, recordings, traced, remarks(recordings), alpha, seed)
    else:
        uses = split(read, recordings)
        recordings = with_uses(recordings, uses)
        odd = remarks(recordings, [use.fit | use.held_out for use in uses])

        def searched(manifest: Manifest, uses: tuple[RowUse, ...]) -> Outcome:
            own = without_tails(recordings, uses) if manifest.procedure == "static" else (recordings, uses)
            chosen = _catalogue(manifest, recordings) if tried is None else tried
            return trace(manifest, *own, chosen, alpha, seed, progress)

        def settled(manifest: Manifest) -> tuple[Outcome, tuple[str, ...]]:
            first, folds = searched(manifest, uses), other_folds(manifest, recordings)
            return by_other_folds(first, folds, partial(searched, manifest), progress)

        outcome, other = with_own_levels(*settled(read), read, settled, progress)
        odd = (*odd, *(other or sentence_of_split(read, recordings)))
        outcome = with_laws(outcome, progress) if tried is None else outcome
        said = [name for name, channel in read.channels.items() if channel.source is not None]
        found = findings(read, recordings, outcome, (*odd, *sentences(recordings, said)), limits)
        if formula:
            found = _with_formulas(found, outcome, progress)
    common = common_mode(read, recordings)
    said_last = (*about, *dead, *common_remarks(common))
    found = replace(found, common_mode=common, remarks=(*found.remarks, *said_last), filing=read.filing())
    of_motion = motion_cautions(recordings, found.rows_rejected)
    for more_doubts in (gain_cautions(found, doubts), clock_cautions(read, found), of_motion, doubts):
        found = _with_doubts(found, more_doubts)
    return found


def _catalogue(read: Manifest, recordings: Sequence[Recording]) -> tuple[Effect, ...]:
    """All effects that may be found: of an accelerometer that gravity turns through those of its model equation too."""
    turned = any(tumble(recording, target) for recording in recordings for target in read.model.targets)
    return (*catalogue(), *TUMBLE) if turned else catalogue()


def _with_formulas(found: Findings, outcome: Outcome, progress: Callable[[str], None]) -> Findings:
    """The findings, with what a search among formulas came to on each target."""
    sought = formulas_of(outcome, progress)
    return replace(found, targets=tuple(replace(t, formulas=sought[t.target]) for t in found.targets))


def _check(alpha: float, seed: int) -> None:
    if not 0 < alpha < 1:
        raise InputError(f"alpha = {alpha:g}; wanted a probability between 0 and 1")
    if seed < 0:
        raise InputError(f"seed = {seed}; wanted zero or more")


def _with_doubts(found: Findings, doubts: Mapping[str, tuple[str, ...]]) -> Findings:
    """The findings, with doubts about each target first among its cautions."""
    targets = tuple(replace(t, cautions=(*doubts.get(t.target, ()), *t.cautions)) for t in found.targets)
    return replace(found, targets=targets)


def opened(
    manifest: str | Path, progress: Callable[[str], None] = lambda text: None, allow_code: bool = False
) -> Manifest:
    """A manifest file, or that of a recording of `insenv.datasets`, which is fetched where it is not here yet.

    Raises
    ------
    InputError
        If it cannot be used.
    """
    name = str(manifest)
    if name in datasets.names() and not Path(name).exists():
        if datasets.locate(name) is None:
            progress(f"fetching {name}")
            datasets.fetch(name)
        return datasets.load(name)
    if not Path(name).suffix and "/" not in name and not Path(name).exists():
        near = get_close_matches(name, datasets.names(), 1)
        hint = f"did you mean {near[0]!r}?" if near else "wanted a manifest in TOML, or one of `insenv list recordings`"
        raise InputError(f"{name}: neither a file nor a published recording; {hint}")
    return load_manifest(Path(manifest), allow_code=allow_code)


def _chosen(effects: Sequence[str]) -> tuple[Effect, ...]:
    return tuple(_effect(key.strip()) for key in dict.fromkeys(effects))


def _effect(key: str, where: str = "effects to try") -> Effect:
    """One of the effects to try."""
    effect = by_key(key, where=where)
    if isinstance(effect, NoiseEffect):
        raise InputError(f"{where}: {key!r} is noise, which is always fitted; wanted other effects")
    if isinstance(effect, DrivenEffect):
        raise InputError(f"{where}: {key!r} is driven by chance and cannot be fitted; wanted other effects")
    return effect
