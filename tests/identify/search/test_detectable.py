"""The smallest effect that would have been found is found, and a tenth of it is not.

The slow tests put an effect of exactly the amplitude stated into runs and count until it is decided: 95 % is asked for.
Each fails then with 5e-4; one that finds half would pass with 7 %, all four with 3e-5.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from sequential import Shares
from simulated_runs import Simulated, declared_for, drawn_noise, gyro_run, manifest, use

from insenv.core.recording import Recording
from insenv.effects.base import OUTPUT
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.effects.timing import SampleHold
from insenv.identify.findings import Detectable
from insenv.identify.fit.gls import solve
from insenv.identify.loop import trace
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.candidates import candidates
from insenv.identify.search.detectable import Sensitivity, _least, _strength
from insenv.identify.search.round import search
from insenv.identify.search.scan import Hit
from insenv.identify.search.tracks import Track

DURATION = 900.0


def traced(recording: Recording) -> Track:
    asked = manifest(declared=declared_for(recording), averaging=1.0)
    return trace(asked, (recording,), (use(len(recording)),), CATALOGUE).tracks[0]


def hits(track: Track) -> dict[str, Hit]:
    return {hit.candidate.effect.key: hit for hit in (*track.last_physical, *(track.hits or ()))}


def smallest(track: Track, key: str) -> Detectable | None:
    return Sensitivity(track.problem, track.fit).smallest(hits(track)[key], 0.01)


@cache
def of_quiet(kind: str, seed: int, key: str) -> Detectable | None:
    """Of a run without effects: what a whole search comes to there, of one effect and without its rounds."""
    recording = gyro_run(kind, seed, duration=DURATION).recording
    asked = manifest(declared=declared_for(recording), averaging=1.0)
    prepared = prepare(asked, (recording,), (use(len(recording)),), "gyro")
    problem, fit = prepared.problem, solve(prepared.problem, prepared.model)
    tried = [candidate for candidate in candidates(problem, CATALOGUE)[0] if candidate.effect.id != SampleHold.id]
    family = sum(not candidate.effect.unusual for candidate in tried) + 2
    (hit,) = search(problem, fit, tuple(c for c in tried if c.effect.key == key), 0, family, tones=False)
    return Sensitivity(problem, fit).smallest(hit, 0.01)


@pytest.mark.parametrize(("kind", "key"), [("staircase", "scale_factor_asymmetry"), ("rest", "bias_step")])
def test_it_is_what_the_whole_loop_comes_to(kind: str, key: str) -> None:
    told, quiet = smallest(traced(gyro_run(kind, 100, duration=DURATION).recording), key), of_quiet(kind, 100, key)
    assert told is not None and quiet is not None
    assert quiet.value == pytest.approx(told.value, rel=1e-6)


def with_amplitude(kind: str, seed: int, key: str, least: Detectable, share: float) -> Simulated:
    effect, k = by_key(key), len(by_key(key).linear)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    direction = [1.0] if k == 1 else [np.cos(phase), np.sin(phase)]
    shapes = [least.at[p.name][0] for p in effect.shapes]
    return gyro_run(kind, seed, ((key, np.array([*(share * least.value * np.array(direction)), *shapes])),), DURATION)


def found(kind: str, seed: int, key: str, share: float) -> bool:
    least = of_quiet(kind, seed, key)
    assert least is not None and least.value > 0
    return bool(traced(with_amplitude(kind, seed, key, least, share).recording).steps)


@pytest.mark.parametrize(
    ("kind", "key"),
    [("staircase", "scale_factor_asymmetry"), ("reversal", "encoder_harmonic:1"), ("rest", "bias_step")],
)
def test_twice_the_amplitude_is_found_and_a_tenth_is_not(kind: str, key: str) -> None:
    assert found(kind, 100, key, 2.0)
    assert not found(kind, 100, key, 0.1)


def test_it_grows_with_the_noise() -> None:
    noise = drawn_noise(np.random.default_rng(0))
    least = []
    for factor in (1.0, 3.0):
        louder = {key: factor * value for key, value in noise.items()}
        run = gyro_run("staircase", 5, duration=DURATION, noise=louder)
        least.append(smallest(traced(run.recording), "scale_factor_asymmetry"))
    assert least[0] is not None and least[1] is not None
    assert least[1].value == pytest.approx(3 * least[0].value, rel=0.02)


def test_what_has_no_single_size_has_none() -> None:
    track = traced(gyro_run("reversal", 5, duration=DURATION).recording)
    all_of_them = {key: smallest(track, key) for key in hits(track)}
    units = [unit for d in all_of_them.values() if d for unit in (d.unit, *(u for _, u in d.at.values()))]
    assert len(units) > 10 and not any(OUTPUT in unit for unit in units)  # each in the unit of what was measured
    assert all_of_them["bias_warm_up"] is not None and all_of_them["bias_warm_up"].at["tau"][1] == "s"
    assert all_of_them["scale_factor_anomaly"] is None  # at one rate it has no size, however significant it is
    assert all_of_them["bias_temperature:2"] is None  # per kelvin and per kelvin squared
    assert all_of_them["spline_time"] is None
    assert all_of_them["encoder_harmonic:1"] is not None


def test_a_jump_has_no_size_where_each_would_be_settling(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a short rest the start would be left out, wherever it jumps."""
    track = traced(gyro_run("rest", 3, duration=300.0).recording)
    assert smallest(track, "bias_step") is not None
    monkeypatch.setattr(Sensitivity, "_settles", lambda *_: True)
    assert smallest(track, "bias_step") is None


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_drift_at_rest_is_found_though_noise_could_be_a_walk(sign: float) -> None:
    """The noise of a short rest takes in most of a drift; here is half of it found with every seed, once promised."""
    noise = {"angle_random_walk": 5e-5, "bias_instability": 2e-6}
    quiet = traced(gyro_run("rest", 3, duration=300.0, noise=noise, with_temperature=False).recording)
    least = smallest(quiet, "bias_drift")
    assert least is not None
    drift = ("bias_drift", np.array([sign * least.value]))
    loud = gyro_run("rest", 3, (drift,), duration=300.0, noise=noise, with_temperature=False)
    assert [step.hit.candidate.effect.key for step in traced(loud.recording).steps] == ["bias_drift"]


def test_two_ways_agree_where_many_modes_tell_the_noise() -> None:
    """One nu for all noise, and the noise fitted to the data that are to be expected."""
    track = traced(gyro_run("staircase", 5, duration=DURATION).recording)
    sensitivity = Sensitivity(track.problem, track.fit)
    one = sensitivity._seen(hits(track)["timing_skew"].term)
    assert one is not None and one.freedom > 200
    ratio = np.sqrt(sensitivity._held_out(one.term, one.direction, track.fit) / one.information)
    assert _least(sensitivity._answer(one), 4.0) == pytest.approx(_strength(4.0, 1, one.freedom, ratio), rel=0.1)


def test_more_looks_and_less_freedom_ask_for_more() -> None:
    plain = _strength(3.5, 1, 500.0, 0.8)
    assert 3.5 < plain < 6.5
    assert _strength(4.5, 1, 500.0, 0.8) > plain
    assert _strength(3.5, 1, 12.0, 0.8) > plain
    assert _strength(3.5, 1, 500.0, 0.0) > plain


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "key"),
    [
        ("staircase", "scale_factor_asymmetry"),
        ("reversal", "encoder_harmonic:1"),
        ("rest", "bias_temperature:1"),
        ("rest", "bias_drift"),
    ],
)
def test_it_is_found_in_about_95_percent(kind: str, key: str) -> None:
    missed = Shares(good=0.05, bad=0.5, alarm=1e-3, miss=0.08)
    assert missed.accept(not found(kind, seed, key, 1.0) for seed in range(500, 540))
