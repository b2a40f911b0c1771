"""Tones that are one wave that is no sine; and what is said of an effect that held-out data refuse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import FITTED, closed, gyro_run, manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.loop import trace
from insenv.identify.search.doubts.sizes import nothing_as_well
from insenv.identify.search.doubts.unfinished import unfinished
from insenv.identify.search.followers import followers
from insenv.identify.search.one_wave import wave
from insenv.identify.search.round import search
from insenv.identify.search.settle import dropped

SPAN = 3600.0


@pytest.mark.parametrize("multiples", [(1, 2, 4, 5, 7, 11), (1, 3, 5), (3, 5, 7), (2, 3, 4)])
def test_multiples_are_one_wave(multiples: tuple[int, ...]) -> None:
    # Off by a tenth of a wave in the whole time: a tone of some ten standard deviations.
    found = 37.3 / SPAN * np.array(multiples) + 0.1 / SPAN * np.resize([1, -1], len(multiples))
    assert wave(found, SPAN) == pytest.approx(37.3 / SPAN, rel=0.01)


@pytest.mark.parametrize("found", [(1.0, 2.0), (1.0, 2.13, 3.32), (1.0, 1.41, 4.0)])
def test_two_tones_or_unrelated_ones_are_none(found: tuple[float, ...]) -> None:
    assert wave(np.array(found) * 37.3 / SPAN, SPAN) is None


def test_tones_at_random_seldom_are() -> None:
    # Of 2000 triples 12 or 13 are by chance; 30 or more would come in one of 10 000 such tests.
    draws = np.random.default_rng(7).uniform(15.0, 500.0, (2000, 3)) / SPAN
    assert sum(wave(row, SPAN) is not None for row in draws) < 30


def test_a_refusal_has_the_p_value_by_which_it_was_asked() -> None:
    """Exact at its size a skew may have no evidence: of one recording "p = 1" was said to follow the fitted data."""
    run = gyro_run("sine", 5, duration=300.0, noise={"angle_random_walk": 1e-4})
    gyro, u = run.recording.channels["gyro"], run.motion.rate
    t, fitted = 0.1 * np.arange(len(u)), use(len(u), FITTED)
    late = np.interp(t - np.where(fitted.fit, 0.3, 0.1), t, u) - u  # another delay in the held-out rows
    recording = replace(
        run.recording, channels={**run.recording.channels, "gyro": replace(gyro, values=gyro.values + late)}
    )
    (track,) = trace(manifest(), (recording,), (fitted,), (by_key("timing_skew"),)).tracks
    (refusal,) = (r for r in track.refusals if r.fails)
    asked = search(track.problem, track.fit, track.candidates, 0, track.family, track.tones)
    (hit,) = (h for h in asked if h.candidate.effect.key == "timing_skew")
    assert np.log(refusal.hit.p_value) == pytest.approx(hit.log_p, rel=1e-6) and hit.log_p < np.log(0.01)
    assert any("timing_skew follows the fitted data" in reason for reason in unfinished(track, 0.01))


@pytest.mark.parametrize(("second", "told"), [(1.0, False), (2.7, True)])
def test_of_a_swing_at_one_frequency_a_wave_of_the_angle_may_be_one_of_the_acceleration(
    second: float, told: bool
) -> None:
    """A cause that goes with the size of the acceleration was stated to be locked to the angle with 8e-20."""
    t: Floats = 0.05 * np.arange(4000.0)
    w = np.where(t < 60.0, 1.6, 1.6 * second)
    angle = 3.2 * np.sin(0.05 * np.cumsum(w))
    noise = 2e-3 * np.random.default_rng(0).standard_normal(len(t))
    gyro = np.diff(angle, prepend=0.0) / 0.05 + noise + 1e-3 * np.cos(angle)
    channels = {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad", source="encoder")}
    tried = (by_key("angle_locked_rate:1"),)
    (target,) = closed(Recording(t, channels, label="run"), manifest(), catalogue=tried).targets
    assert [a.effect for a in target.added] == ["angle_locked_rate"]
    assert any("swings at one frequency" in reason for reason in target.reasons) is not told


def test_a_power_of_heat_is_named_though_no_angle_is_given() -> None:
    """It has an order, as waves of the angle do: a traceback was the answer, of a table's arc that nobody gave."""
    t: Floats = 1.0 * np.arange(600.0)
    heat = 293.0 + 5.0 * np.sin(t / 60.0)
    gyro = 1e-3 * (heat - 293.0) + 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s"), "temperature": Channel(heat, "K")}
    (target,) = closed(
        Recording(t, channels, label="run"), manifest(), catalogue=(by_key("bias_temperature:1"),)
    ).targets
    assert [a.effect for a in target.added] == ["bias_temperature"]


def test_what_is_certain_with_a_size_that_no_such_effect_has_is_a_doubt_of_its_own() -> None:
    """A gyro that gains where a lock-in would lose: the square of its threshold would be negative."""
    rng, rows = np.random.default_rng(6), 6000
    t = 0.1 * np.arange(1.0, rows + 1)
    rate = 0.3 * np.sin(2 * np.pi * t / 37.0)
    gyro = np.sign(rate) * np.sqrt(rate**2 + 2e-4) + 1e-3 * rng.standard_normal(rows)
    channels = {
        "gyro": Channel(gyro, "rad/s", "interval"),
        "table_rate": Channel(rate, "rad/s", "interval", source="command"),
    }
    run = Recording(t, channels)
    (track,) = trace(manifest(), (run,), (use(rows),), tuple(by_key(key) for key in ("lock_in", "bias_drift"))).tracks
    assert not track.steps
    (hit,) = (hit for hit in track.last_physical if hit.candidate.effect.id == "lock_in")
    assert hit.deviate == -np.inf and hit.incredible > 8
    (reason,) = (reason for reason in unfinished(track, 0.01) if "another cause is there" in reason)
    assert reason.startswith("lock_in would explain more") and "W_L_squared" in reason
    unsure = replace(track, last_physical=(replace(hit, incredible=4.0),))
    assert not any("another cause" in reason for reason in unfinished(unsure, 0.01))


@pytest.mark.parametrize(("deviations", "named"), [(0.4, False), (0.6, True)])
def test_a_lag_of_which_not_even_the_sign_is_told_has_no_name(deviations: float, named: bool) -> None:
    """That there is one is certain; of 0.4 of its deviation from nothing the other sign has 0.34."""
    run = gyro_run("sine", 5, duration=300.0, noise={"angle_random_walk": 1e-4})
    gyro, u = run.recording.channels["gyro"], run.motion.rate
    t = 0.1 * np.arange(len(u))
    late = replace(gyro, values=gyro.values + np.interp(t - 0.1, t, u) - u)
    recording = replace(run.recording, channels={**run.recording.channels, "gyro": late})
    (track,) = trace(manifest(), (recording,), (use(len(u)),), (by_key("timing_skew"),)).tracks
    own = estimates(track.problem, track.fit)
    wide = {term: tuple(replace(row, sd=abs(row.value) / deviations) for row in rows) for term, rows in own.items()}
    weak = nothing_as_well(track, wide)
    assert (weak is None) == named
    if weak is not None:
        without = dropped(track, *weak)
        (reason,) = (r for r in unfinished(without, 0.01) if "not even the sign" in r)
        assert reason.startswith("timing_skew follows the data")
        assert followers(replace(without, refusals=()), 0.01, doubted=True)
        assert followers(without, 0.01, doubted=True) == ()  # it was said


@pytest.mark.parametrize("loop", [True, False])
def test_a_lag_of_a_temperature_that_turned_back_once_may_be_a_hysteresis(loop: bool) -> None:
    """Of three loops of a chamber that rises and falls two were stated to be a lag or a rate; a lag is told from it."""
    rng, n = np.random.default_rng(4), 3600
    t = np.arange(1.0, n + 1)
    warm = np.interp(t, [0, 300, 900, 1300, 1500, 2400, n], [298.0, 298, 330, 330, 330, 290, 290])
    behind = np.empty(n)
    now = warm[0]
    for i, kelvin in enumerate(warm):
        now = min(max(now, kelvin - 4.0), kelvin + 4.0) if loop else now + (kelvin - now) / 250.0
        behind[i] = now
    gyro = (2e-5 if loop else 1e-5) * (warm - behind) + 5e-5 * rng.standard_normal(n)
    channels = {"gyro_x": Channel(gyro, "rad/s"), "temperature": Channel(warm, "K")}
    (target,) = closed(Recording(t, channels), manifest(("gyro_x",), ("bias",)), (use(n, FITTED),)).targets
    assert any("bias_thermal_hysteresis" in reason for reason in target.reasons) is loop
    if not loop:
        assert "bias_thermal_lag" in [one.effect for one in target.added]
