"""A cause of several axes, and one of them that shows nothing of it beside what was added later."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.fit.gls import solve
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.loop import trace
from insenv.identify.search.doubts.sizes import untold
from insenv.identify.search.settle import parted
from insenv.identify.search.tracks import Track

AXES = ("gyro_x", "gyro_y", "gyro_z")


def tracks(amounts: tuple[float, ...]) -> list[Track]:
    """A triad at rest for 300 s, each axis with white noise, a walk, and a drift by so many sigma of a row."""
    rng, n = np.random.default_rng(1), 1500
    noise = rng.standard_normal((3, n)) + 3e-3 * np.cumsum(rng.standard_normal((3, n)), axis=1)
    read = 1e-4 * (noise + np.outer(amounts, np.linspace(0, 1, n)))
    run = Recording(0.2 * np.arange(1.0, n + 1), {a: Channel(y, "rad/s") for a, y in zip(AXES, read, strict=True)})
    return list(trace(manifest(AXES, ("bias",)), (run,), (use(n, 0.7),), (by_key("bias_drift"),)).tracks)


def test_a_part_that_is_gone_is_left_off_that_axis_and_the_others_are_asked_again() -> None:
    """As a step that was found later takes it away: x was said to have 0.0017 +- 0.0065 m/s^2."""
    found = tracks((1.1, -1.1, 0.9))
    assert all(step.together == AXES for track in found for step in track.steps)
    assert parted(found) is found  # each is weak, and is there
    first, *others = found
    (step,) = first.steps
    own = first.fit.theta[first.fit.design.term == first.fit.model.index(step.hit.term)]
    less = replace(first.problem, y=first.problem.y - first.problem.columns(step.hit.term) @ own, cache={})
    fit = solve(less, first.fit.model, start=first.fit.noise.power)
    after = parted([replace(first, prepared=replace(first.prepared, problem=less), fit=fit), *others])
    assert all(not track.steps and step.hit.term not in track.fit.model and track.hits is None for track in after)
    (refusal,) = after[0].refusals
    assert refusal.unsized and "deviations from nothing" in refusal.reason
    assert not any(track.refusals for track in after[1:])


def test_a_weak_part_leaves_the_verdict_of_its_axis_open() -> None:
    """Of 0.9 sigma in a walk its size is 1.7 deviations; the axis with 3.1 is sure."""
    found = tracks((1.1, -1.1, 0.9))
    said = [untold(track, estimates(track.problem, track.fit)) for track in found]
    assert [len(one) for one in said] == [1, 0, 1]
    assert "on what gyro_x, gyro_y, gyro_z show together" in said[0][0]
