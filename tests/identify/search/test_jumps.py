"""A step of the bias is one event that lasts; of noise that jumps to and fro, and of bursts, it is none."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from simulated_runs import gyro_run, manifest, use

from insenv.core.recording import Floats
from insenv.effects.catalogue import CATALOGUE
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.loop import trace
from insenv.identify.search.doubts.unfinished import unfinished
from insenv.identify.search.jumps import is_step, one_of_many
from insenv.identify.search.settle import settled
from insenv.identify.search.tracks import Track

DURATION, WHITE = 600.0, 1e-5


@cache
def at_rest(size: float = 0.0) -> Track:
    """White noise of 1e-5 in means over a second, and a step at 240 s; 360 s are fitted, 240 s held out."""
    white = {"angle_random_walk": WHITE}
    added = (("bias_step", np.array([size, 240.0])),)
    run = gyro_run("rest", 4, added, duration=DURATION, noise=white, with_temperature=False).recording
    step = tuple(effect for effect in CATALOGUE if effect.id == "bias_step")
    (track,) = trace(manifest(declared=("bias",), averaging=1.0), (run,), (use(len(run)),), step).tracks
    return track


def said(level: Floats, at: float, events: tuple[float, ...] = ()) -> str:
    """What is said of a step at an instant, where the level of each bin is that."""
    track = at_rest()
    problem = replace(track.problem, y=track.problem.y + level, cache={})
    candidate = next(c for c in track.candidates if is_step(c.effect))
    fit = solve(problem, (*track.prepared.model, Term(candidate.effect, (at,))))
    return one_of_many(problem, fit, candidate, events)


def between(start: float, stop: float = DURATION) -> Floats:
    t = at_rest().problem.bins.time
    return np.asarray(2 * WHITE * ((t >= start) & (t < stop)), np.float64)


def test_one_step_that_lasts_is_one() -> None:
    assert said(between(200), 200) == ""


def test_a_level_that_comes_back_is_none() -> None:
    """The last minute of the fitted data and the first two of the held-out ones are off."""
    assert "come back in the later half" in said(between(300, 470), 300)


def test_jumps_to_and_fro_are_none() -> None:
    level = 3 * (between(60, 120) + between(200))
    assert "as much at other times" in said(level, 200)


@pytest.mark.parametrize(("events", "refused"), [((1.5,), False), ((0.5, 0.5), False), ((1.5, -3.0), True)])
def test_a_step_no_larger_than_bursts_beside_it_is_one_of_them(events: tuple[float, ...], refused: bool) -> None:
    sizes = tuple(2 * WHITE * size for size in events)
    assert ("bursts of its size" in said(between(200), 200, sizes)) is refused


def test_a_step_that_only_the_odds_against_events_hide_is_no_silence() -> None:
    """Of 1.3 deviations of a mean over a second: p = 7e-5 if noise does not jump, 7 % as it does."""
    assert unfinished(at_rest(), 0.01) == ()
    weak = at_rest(1.3 * WHITE)
    assert not weak.steps
    assert any("a step and a jump of the noise" in reason for reason in unfinished(weak, 0.01))


def test_rivals_of_a_step_beyond_the_smallest_probability_are_judged_by_all_looks() -> None:
    """A probability that is smaller than a number holds says nothing of how few looks there were."""
    track = at_rest(20 * WHITE)
    (step,) = track.steps
    surer = replace(step, p_value=0.0, hit=replace(step.hit, deviate=12.0))
    (rivalry,) = settled(replace(track, steps=(surer,)), 0.01, 0, lambda text: None).rivalries
    (usual,) = settled(track, 0.01, 0, lambda text: None).rivalries
    assert rivalry.keys == usual.keys
