"""A bias of each run, where one for all of them was taken and they do not have it.

The soaks of a chamber, or the rates of a table, have one bias with a file each, for with one of its own none would tell
what the temperature, or the rate, does to it. Where the unit was switched off between them their levels scatter, the
noise takes the scatter up as a walk, and beside such a walk nothing else is seen. What is asked then is what each run
tells by itself: the search is made again with a bias of each run, and what it names stands, beside the doubt that the
bias is not the same. What goes with the levels alone has no name by that, and keeps the doubt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from insenv.data.manifest.spec import Manifest
from insenv.identify.loop import Outcome
from insenv.identify.search.tracks import Progress, Track
from insenv.identify.search.unit.turn_on import turned_on_anew


def with_own_levels(
    outcome: Outcome,
    said: tuple[str, ...],
    manifest: Manifest,
    searched: Callable[[Manifest], tuple[Outcome, tuple[str, ...]]],
    progress: Progress,
) -> tuple[Outcome, tuple[str, ...]]:
    """The outcome, with what a search with a bias of each run names where nothing was named and the biases differ.

    Parameters
    ----------
    outcome : Outcome
        With one bias for all runs, as far as ``manifest`` leaves that open.
    said : tuple of str
        What is to be said of it.
    manifest : Manifest
    searched : callable
        The same search of another manifest: its outcome, and what is to be said.
    progress : callable
        Told what is being done.
    """
    apart = [_apart(track, outcome.alpha) for track in outcome.tracks]
    if manifest.model.bias is not None or not any(apart):
        return outcome, said
    progress("the bias is not the same in the runs: each has one of its own")
    other, more = searched(replace(manifest, model=replace(manifest.model, bias="per-run")))
    taken = [bool(why) and _named(new) for new, why in zip(other.tracks, apart, strict=True)]
    tracks = (
        replace(new, apart=why) if take else old
        for old, new, why, take in zip(outcome.tracks, other.tracks, apart, taken, strict=True)
    )
    return replace(outcome, tracks=tuple(tracks)), more if all(taken) else said


def _apart(track: Track, alpha: float) -> tuple[str, ...]:
    """That the biases of the runs differ, where nothing was named; else empty."""
    return () if _named(track) else turned_on_anew(track, alpha)


def _named(track: Track) -> bool:
    return any(not step.hit.candidate.generic for step in track.steps)
