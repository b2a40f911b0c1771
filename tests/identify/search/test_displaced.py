"""An effect that would take the place of one which explains more is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from simulated_runs import FITTED, gyro_run, manifest, use

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
