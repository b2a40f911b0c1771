"""False discoveries of the whole procedure on recordings that the declared model explains completely."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from sequential import Shares
from simulated_runs import KINDS, declared_for, gyro_run, manifest, use

from insenv.effects.catalogue import CATALOGUE
from insenv.identify.assemble import findings
from insenv.identify.loop import Outcome, trace

#: Most runs; what is to be shown: not more than 2 % of runs get an effect, a line or a curve that is not there.
RUNS, SHARES = 200, Shares(good=0.02, bad=0.2, alarm=1e-3, miss=0.02)


def named(outcome: Outcome) -> list[object]:
    """Effects, curves, lines and holds that are named: all there are without rails, counts and another gain."""
    (track,) = outcome.tracks
    assert not track.prepared.rails and track.problem.coarse is None and track.problem.gain == 1.0
    hold = track.prepared.held.hold
    return [
        *((s.hit.candidate.effect.key, s.p_value) for s in track.steps),
        *track.prepared.lines,
        *([hold] if hold else ()),
    ]


@pytest.mark.slow
def test_false_discoveries_are_as_rare_as_they_are_said_to_be() -> None:
    """Fresh runs of five profiles, drawn noise and temperatures; alpha = 0.01 for each; sequential.

    At 2 % it fails with 5e-4, at the nominal 1 % with 2e-5; one with 20 % false discoveries would pass with 2 %, one
    with 15 % with 8 %. About 23 runs decide it. The first of each profile shows that what is named is what is told.
    """
    false: list[object] = []

    def runs() -> Iterator[bool]:
        for seed in range(RUNS):
            kind = KINDS[seed % len(KINDS)]
            run = gyro_run(kind, 60_000 + seed, duration=900.0, dt=0.2).recording
            asked = manifest(declared=declared_for(run))
            outcome = trace(asked, (run,), (use(len(run)),), CATALOGUE, seed=seed)
            found = named(outcome)
            if found:
                false.append((kind, seed, found))
            if seed < len(KINDS):
                (told,) = findings(asked, (run,), outcome).targets
                assert len(told.added) == len(found)
                assert found or told.held_out.after == told.held_out.before
            yield bool(found)

    assert SHARES.accept(runs()), false
