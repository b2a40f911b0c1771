"""How large each effect that was put in is by the engine's own likelihood: a second size, beside that of the study.

    python likelihood_sizes.py STORE LABEL      STORE/LABEL/sizes.json, deviations by number of case

The search is run; of what it added stays what it had named of the untouched recording too, and no curve without a
cause. By all rows, the held-out ones too, beside that, with noise fitted anew both times,

    deviations = sqrt(2 (l with the effect at its best shape - l without)).

Errors of the reference count for nothing here. Where the engine does not tell the effect from its model, at any shape,
it is 0. Units in attitudes have another likelihood, and none here; what changes a coefficient that is declared is no
effect of its own, and a rail, a burst or a line has no curve.
"""

from __future__ import annotations

import json
import math
import multiprocessing
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from inject import stem_of, truths
from injected_words import answer, named

from insenv.close import opened
from insenv.core.errors import InputError
from insenv.data.load import read_recordings
from insenv.data.power import by_power_up
from insenv.data.split import split, without_tails
from insenv.identify.clean.plausibility import without_dead
from insenv.identify.fit.gls import solve
from insenv.identify.loop import trace
from insenv.identify.search.all_rows import at_all_times, whole_of
from insenv.identify.search.round import by_fit_alone
from insenv.identify.search.scan import reference
from insenv.identify.search.tracks import Track

#: Seconds for one case.
LIMIT = 240.0


def main() -> None:
    store, label = Path(sys.argv[1]), sys.argv[2]
    path = store / label / "sizes.json"
    sizes = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    for number, truth in truths(store):
        if number in sizes or truth["kind"] == "attitudes":
            continue
        with multiprocessing.get_context("fork").Pool(1) as pool:
            was, _ = answer(store / label / stem_of(truth["recording"]))
            old = {n.effect for n in named(was) if n.target == truth["target"]} if was else set()
            asked = pool.apply_async(_size, (store / "cases" / number / "case.toml", truth, old - set(truth["names"])))
            try:
                sizes[number] = asked.get(LIMIT)
            except multiprocessing.TimeoutError:
                sizes[number] = None
        told = sizes[number]
        what = "not asked" if told is None else f"{told['deviations']:.1f} by {told['effect']}"
        print(f"{number} {truth['recording']} {truth['law']} {truth['strength']:.1f}: {what}", flush=True)
        path.write_text(json.dumps(sizes, indent=1), encoding="utf-8")


def _size(manifest: Path, truth: Mapping[str, Any], old: set[str]) -> dict[str, Any] | None:
    """Deviations of the best of the effect's names, and which; None where none is asked for, or nothing is read."""
    read = opened(manifest)
    if set(read.model.declared) & set(truth["names"]):
        return None
    try:
        recordings = by_power_up(read_recordings(read))
        read, _ = without_dead(read, recordings)
        uses = split(read, recordings)
        own = without_tails(recordings, uses) if read.procedure == "static" else (recordings, uses)
        outcome = trace(read, *own)
    except InputError:
        return None
    track = next(t for t in outcome.tracks if t.problem.target == truth["target"])
    return _of_track(track, set(truth["names"]), {*read.model.declared, *old})


def _of_track(track: Track, names: set[str], beside: set[str]) -> dict[str, Any] | None:
    whole = whole_of(track)
    model = tuple(t for t in track.fit.model if not t.effect.generic and _name(t.effect.key) in beside)
    fit = solve(whole, model, start=track.fit.noise.power)
    base = reference(whole, fit.model, fit.noise.power)
    tried = tuple(at_all_times(whole, c) for c in (*track.candidates, *track.few_waves) if _name(c.effect.key) in names)
    hits = by_fit_alone(whole, fit, base, tried, 0, track.family, tones=False)
    best = max(hits, key=lambda hit: hit.likelihood_ratio, default=None)
    if best is None:
        untold = any(_name(one.effect) in names for one in track.not_testable)
        return {"deviations": 0.0, "effect": "none that is told"} if tried or untold else None
    return {"deviations": math.sqrt(max(best.likelihood_ratio, 0.0)), "effect": best.candidate.effect.key}


def _name(key: str) -> str:
    return key.partition(":")[0]


if __name__ == "__main__":
    main()
