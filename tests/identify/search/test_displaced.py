"""What explains more: an effect that would take its place is refused, one that what cannot be beats is doubted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulated_runs import FITTED, gyro_run, manifest, use
from strangers import closed_rate_file

from insenv.effects.catalogue import CATALOGUE
from insenv.identify.loop import trace


def test_no_curve_displaces_a_dead_band_that_explains_more() -> None:
    """Its edges are not sharp: low rates lose all but a twentieth, and those above lose as a lock-in does.

    A local anomaly was added for the edges; the rest of the band would then lose a part of the low rates alone, which
    no dead band does, and it was dropped.
    """
    run = gyro_run("sine", 4, duration=900.0, noise={"angle_random_walk": 1e-5})
    gyro, u = run.recording.channels["gyro"], run.motion.rate
    band = 0.1 * float(np.abs(u).max())
    tail = np.sign(u) * np.sqrt(np.maximum(u**2 - (0.5 * band) ** 2, 0.0)) - u
    values = gyro.values + np.where(np.abs(u) < band, -0.95 * u, tail)
    recording = replace(run.recording, channels={**run.recording.channels, "gyro": replace(gyro, values=values)})
    (track,) = trace(manifest(), (recording,), (use(len(recording), FITTED),), CATALOGUE).tracks
    assert "dead_band" in {step.hit.candidate.effect.key for step in track.steps}
    assert not any(
        r.displaced and r.hit.candidate.effect.key == "dead_band" and r.hit.likelihood_ratio > 500
        for r in track.refusals
    )


@pytest.mark.parametrize("corner", [0.0, 4e-3])
def test_a_knee_of_the_scale_factor_is_no_cube_and_no_dead_band(tmp_path: Path, corner: float) -> None:
    """From half of the largest rate on the gain is larger: a dead band of a hundredth fits that as well as the knee."""
    dt, top = 0.05, 0.5
    levels = top * np.concatenate([np.arange(1, 7), np.arange(-6, 0)]) / 6
    rate = np.repeat(np.tile(levels, 3), 160)
    t = dt * np.arange(1, len(rate) + 1)
    gyro = rate * 1.002 + corner * np.sign(rate) * np.maximum(np.abs(rate) - top / 2, 0)
    gyro += 3e-4 * np.random.default_rng(1).standard_normal(len(t))
    found = closed_rate_file(tmp_path, t, gyro, rate)
    assert [one.effect for one in found.added] == (["scale_factor_knee"] if corner else [])
    assert not any("would explain far more" in reason for reason in found.reasons)
    assert (found.verdict == "nothing-significant") is not bool(corner)
