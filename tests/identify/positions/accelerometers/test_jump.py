"""A bias that jumps between two rests of a triad in many attitudes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from positions_cases import DT, Case, manifest, recording

from insenv.core.recording import Floats, Recording
from insenv.data.manifest import HeldOut
from insenv.effects.bias import BiasStep
from insenv.identify.positions.findings import position_findings
from insenv.identify.positions.model import Linear, Surroundings, triad_term
from insenv.identify.positions.trace import Positions, trace_positions

RESTS = 24
CASE = Case(rests=RESTS)
#: Time from rest to rest [s].
EVERY = CASE.rest_s + CASE.turn_s
MODEL = manifest(("accel_x", "accel_y", "accel_z"), ("accel_bias", "accel_scale_factor"), HeldOut())


def moved(seed: int, jump: Floats, at: int = RESTS // 2, walk: float = 0.0) -> Recording:
    """Rests whose biases jump by ``jump``, shape (3,), before rest ``at`` (from 0), and walk from rest to rest."""
    run = recording(CASE, seed)
    rest = np.minimum((np.arange(len(run)) * DT / EVERY).astype(int), RESTS - 1)
    wander = np.cumsum(walk * np.random.default_rng(seed + 1000).standard_normal((3, RESTS)), axis=1)
    more = jump[:, None] * (rest >= at) + wander[:, rest]
    channels = dict(run.channels)
    for axis, values in zip("xyz", more, strict=True):
        channel = channels[f"accel_{axis}"]
        channels[f"accel_{axis}"] = replace(channel, values=channel.values + values)
    return replace(run, channels=channels)


def traced(run: Recording) -> Positions:
    return trace_positions(MODEL, (run,))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("at", [RESTS // 2, 8])
def test_a_jump_between_two_rests_is_named_with_its_time_and_size(seed: int, at: int) -> None:
    jump = np.array([0.05, -0.05, 0.05])
    run = moved(seed, jump, at)
    found = traced(run)
    targets = position_findings(MODEL, (run,), found, (), 0.01, 0).targets
    for target, size in zip(targets, jump, strict=True):
        (added,) = target.added
        assert added.effect == "bias_step"
        c, t0 = added.parameters
        # Of 18 sizes one is five deviations off by chance once in 1e4 runs of these tests (Student's t on 9 and more).
        assert c.value == pytest.approx(size, abs=5 * c.sd)
        assert t0.value == pytest.approx(at * EVERY - CASE.turn_s / 2, abs=EVERY / 2 + 5 * t0.sd)


@pytest.mark.slow
@pytest.mark.parametrize("walk", [0.0, 5e-3])
def test_biases_that_walk_from_rest_to_rest_do_not_jump(walk: float) -> None:
    """False alarm 1 % each; three of 24 and more come by chance once in 600 times."""
    found = (traced(moved(seed, np.zeros(3), walk=walk)) for seed in range(24))
    assert sum(any(step.term.effect.id == BiasStep.id for step in one.accel.outcome.steps) for one in found) < 3


def test_a_jump_adds_to_every_rest_behind_it_and_to_no_other() -> None:
    term = triad_term(BiasStep(), (5.0,))
    offset = Linear.of((term,), Surroundings(np.array([1.0, 4.9, 5.1, 9.0]))).offset
    np.testing.assert_allclose(offset, np.array([0, 0, 1.0, 1.0])[None, :, None] * np.eye(3)[:, None, :])


@pytest.mark.parametrize(("size", "said"), [(0.02, True), (0.0, False)])
def test_a_jump_for_which_a_walk_stands_is_a_doubt(size: float, said: bool) -> None:
    """One of three is refused beside the largest walk that the rests allow, and nothing significant was missing."""
    for seed in (1, 2, 3):
        found = traced(moved(seed, np.array([size, -size, size]))).accel
        assert bool(found.outcome.steps or "the biases change" in " ".join(found.reasons)) == said
