"""Several runs of a unit at rest for which one bias was declared: that it is not the same in them is said."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.close import close_on
from insenv.core.recording import Channel, Floats, Recording, Site
from insenv.identify.findings import TargetFindings

#: Warmth of three minutes [degC]; the second one was taken in the sun.
WARMTH = (29.3, 30.8, 29.2)


def flicker(rng: np.random.Generator, n: int) -> Floats:
    """Noise whose power goes with one over the frequency."""
    f = np.fft.rfftfreq(n)
    f[0] = 1.0
    return np.asarray(np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) / np.sqrt(f), n))


def said(seed: int, levels: tuple[float, ...], warmth: tuple[float, ...] = ()) -> TargetFindings:
    """The loop on three runs of a minute with one declared bias, whose true ones are ``levels`` [rad/s]."""
    rng = np.random.default_rng(seed)
    runs = []
    for k, level in enumerate(levels):
        t = np.arange(1.0, 601) / 10.0
        values = level + 0.002 * rng.standard_normal(len(t)) + 1e-4 * flicker(rng, len(t))
        channels = {"gyro_x": Channel(values, "rad/s")}
        if warmth:
            noise = 0.02 * rng.standard_normal(len(t))
            channels["temperature"] = Channel(273.15 + warmth[k] + 0.002 * t + noise, "K")
        runs.append(Recording(t, channels, site=Site(gravity=9.8), label=f"run {k}"))
    asked = manifest(("gyro_x",), ("bias",), bias="common")
    (target,) = closed(tuple(runs), asked).targets
    return target


def test_a_bias_of_each_run_is_said_where_one_was_declared() -> None:
    """Sixteen deviations of white noise apart; the noise takes it for a walk of its own."""
    for seed in range(4):
        target = said(seed, (0.0, 0.0016, -0.0002))
        assert target.verdict == "unexplained-structure"
        assert any("not the same in the runs" in reason for reason in target.reasons)


def test_what_the_temperature_may_have_made_is_a_set() -> None:
    target = said(1, tuple(1e-3 * (kelvins - 29.3) for kelvins in WARMTH), WARMTH)
    (added,) = target.added
    assert (added.effect, target.verdict) == ("bias_temperature", "confounded")
    assert {"bias", "rate_random_walk"} <= set(added.confounded_with)
    (c,) = added.parameters
    assert c.value == pytest.approx(1e-3, abs=4 * c.sd)


def test_the_same_bias_in_all_runs_is_nothing() -> None:
    assert all(said(seed, (0.0, 0.0, 0.0)).verdict == "nothing-significant" for seed in range(6))


def soaks(seed: int, cubic: float) -> TargetFindings:
    """The loop on six soaks of a chamber with a staircase of rates each, of a gyro switched off between them."""
    rng, runs = np.random.default_rng(seed), []
    steps = np.deg2rad([0.0, 10, -10, 20, -20, 30, -30, 40, -40, 50, -50])
    for celsius in (-40.0, -20.0, 0.0, 25.0, 50.0, 70.0):
        u = np.repeat(steps, 60)
        t = 0.2 * np.arange(1.0, len(u) + 1)
        values = 1.001 * u + cubic * u**3 + 2e-5 * rng.standard_normal() + 1e-5 * rng.standard_normal(len(u))
        channels = {
            "gyro": Channel(values, "rad/s", "interval"),
            "table_rate": Channel(u, "rad/s", "interval", source="command"),
            "temperature": Channel(np.full(len(u), 273.15 + celsius), "K"),
        }
        runs.append(Recording(t, channels, label=f"{celsius:g} degC"))
    (target,) = close_on(manifest(("gyro",), ("bias", "scale_factor")), tuple(runs)).targets
    return target


@pytest.mark.parametrize("seed", range(2))
def test_what_each_run_tells_is_named_beside_biases_of_their_own(seed: int) -> None:
    """A cubic of the fastest steps, which are held out; that one bias was taken is a doubt, and alone without it."""
    for cubic in (2e-5, 0.0):
        found = soaks(seed, cubic)
        names = [{one.effect, *one.confounded_with} for one in found.added]
        assert len(names) == (cubic > 0) and all("scale_factor_cubic" in each for each in names)
        assert any("not the same in the runs" in reason for reason in found.reasons)
        assert found.verdict not in ("effects-found", "nothing-significant")
