"""Events of a unit at rest: left out, told with rows and size, and never taken for a law; laws are not eaten."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recorded.mems_bench import ACCELS, FULL, Bench, bench
from simulated_runs import closed, gyro_run, manifest

from insenv.core.recording import Channel, Recording
from insenv.identify.clean.bursts import bursts
from insenv.report.json import to_json
from insenv.report.text import summary

QUIET = Bench()
SLOW = {"bias_step", "bias_warm_up", "bias_drift", "spline_time"}


def slowly(recording: Recording, curve: str, size: float) -> Recording:
    """A law on accel_x: one that stays, wanders off or comes back every time."""
    t = recording.t
    shape = {
        "step": (t > 300) * 1.0,
        "late step": (t > 940) * 1.0,
        "drift": t / t[-1],
        "warm-up": np.exp(-t / 100.0),
        "slow tone": np.sin(2 * np.pi * t / 37.0),
    }[curve]
    channel = recording.channels["accel_x"]
    new = replace(channel, values=channel.values + size * shape)
    return replace(recording, channels={**recording.channels, "accel_x": new})


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ACCELS)
def test_a_burst_is_found_on_all_channels(seed: int, name: str) -> None:
    """30 mm/s^2 on the first axis, 18 on the last, where the mean of 10 s scatters by 3."""
    found = [b for b in bursts(bench(replace(FULL, settling=0.0), seed), name) if not b.settling]
    assert [(310 - 4 <= b.start / 100 <= 312, 326 <= b.stop / 100 <= 328 + 12) for b in found[:1]] == [(True, True)]
    assert [np.sign(b.size) for b in found] == [1, -1]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("name", ["accel_x", "gyro_z"])
def test_there_is_none_where_there_is_none(seed: int, name: str) -> None:
    """Seven robust deviations of some hundred means: by chance in less than one of 1e6."""
    assert bursts(bench(QUIET, seed), name) == ()


@pytest.mark.parametrize("curve", ["step", "late step", "drift", "warm-up", "slow tone"])
@pytest.mark.parametrize("size", [0.03, 0.3])
def test_a_law_is_no_burst(curve: str, size: float) -> None:
    assert bursts(slowly(bench(QUIET, 2), curve, size), "accel_x") == ()


def test_a_table_that_turns_has_no_bursts() -> None:
    assert bursts(gyro_run("staircase", 1, duration=900.0).recording, "gyro") == ()


@pytest.mark.parametrize("seed", [0, 1])
def test_a_mems_bench_shows_its_line_and_its_events_and_no_law(seed: int) -> None:
    found = closed(bench(FULL, seed), manifest(ACCELS, ("bias",)))
    for target in found.targets:
        assert not SLOW & {a.effect for a in target.added}, target.target
        lines = [a for a in target.added if a.effect == "tone"]
        assert len(lines) == 1, target.target
        f = lines[0].parameters[0]
        assert f.parameter == "f"
        assert abs(f.value - 0.56) < 0.03
        assert f.sd < 0.03
    rows = [r for r in to_json(found)["rows_rejected"] if r["cause"] == "burst"]
    assert {r["target"] for r in rows} == set(ACCELS)
    assert all(any(a < 31_900 < b for a, b in (r["rows"] for r in rows if r["target"] == n)) for n in ACCELS)
    assert "events, not laws" in " ".join(summary(found).split())


def test_a_real_step_is_still_a_step() -> None:
    found = closed(bench(replace(FULL, settling=0.0, step=0.06), 3), manifest(("accel_x",), ("bias",)))
    assert "bias_step" in {a.effect for a in found.targets[0].added}


def test_what_settles_at_the_start_is_no_warm_up() -> None:
    """A jump that is over within the first tenth: left out, and said."""
    quiet = gyro_run("rest", 5, duration=1200.0, with_temperature=False).recording
    gyro = quiet.channels["gyro"]
    jumped = Channel(gyro.values + 2e-5 * (quiet.t < 60.0), gyro.unit, gyro.covers)
    found = closed(replace(quiet, channels={**quiet.channels, "gyro": jumped}))
    assert not SLOW & {a.effect for a in found.targets[0].added}
    assert [(r.start, r.cause) for r in found.rows_rejected] == [(0, "burst")]


@pytest.mark.parametrize("seed", range(3))
def test_what_stays_within_half_a_rounding_step_is_no_burst(seed: int) -> None:
    """A reading that shows one step in a few rows of some seconds and else nothing: its level has no scatter."""
    random = np.random.default_rng(seed)
    recording = bench(QUIET, seed)
    values = np.zeros(len(recording))
    for start in (200, 420, 700):
        some = start * 100 + random.integers(0, 500, 60)
        values[some] = 0.001
    channel = replace(recording.channels["gyro_z"], values=values)
    changed = replace(recording, channels={**recording.channels, "gyro_z": channel})
    assert bursts(changed, "gyro_z") == ()
