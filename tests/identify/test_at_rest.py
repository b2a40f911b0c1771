"""What a unit at rest cannot show: no specific force from an accelerometer's own noise, no rate from a gyro's.

One cause on several channels is a finding of its own. A turn that shows a large cross-coupling is no shaking.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from positions_cases import ACCELS, GYROS, Case, G, manifest, recording, scales
from scipy.signal import lfilter
from simulated_runs import manifest as series_manifest
from simulated_runs import use

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Channel, Recording, Site
from insenv.data.manifest import HeldOut
from insenv.effects.catalogue import by_key
from insenv.identify.clean.common import common_mode, common_remarks
from insenv.identify.positions.findings import position_findings
from insenv.identify.positions.gyros.factor import factor_of
from insenv.identify.positions.trace import trace_positions
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.candidates import candidates
from insenv.scenario import simulate

RATE = 50.0


def unit(seed: int, common: float = 0.0, tilts: float = 0.0) -> Recording:
    """A MEMS unit at rest for 200 s; ``common`` is the share of noise of one cause on all channels.

    ``tilts`` [rad] is how far it is tilted for the second half of each 40 s.
    """
    rng = np.random.default_rng(seed)
    n = round(200 * RATE)
    t = np.arange(1.0, n + 1) / RATE
    cause = rng.standard_normal(n)
    lean = tilts * ((t % 40) > 20)
    force = {"x": G * np.sin(lean), "y": np.zeros(n), "z": G * np.cos(lean)}
    channels = {}
    for axis in "xyz":
        noise = np.sqrt(1 - common) * rng.standard_normal((2, n)) + np.sqrt(common) * cause
        drift = 0.01 * np.sin(2 * np.pi * t / 150 + rng.uniform(0, 6))
        channels[f"accel_{axis}"] = Channel(force[axis] + 0.02 * noise[0] + drift, "m/s^2")
        channels[f"gyro_{axis}"] = Channel(0.002 * noise[1] + 1e-3, "rad/s")
    return Recording(t, channels, site=Site(gravity=G), label="unit")


def reasons(run: Recording) -> dict[str, str]:
    """Of the effects that gyro x of the recording cannot show, why."""
    asked = series_manifest(("gyro_x",), ("bias",))
    problem = prepare(asked, (run,), (use(len(run)),), "gyro_x", tones=False, holds=False).problem
    _, blind = candidates(problem, (by_key("g_sensitivity"), by_key("cross_axis")))
    return {one.effect: one.reason for one in blind}


def test_a_change_of_gravity_s_magnitude_is_no_tilt() -> None:
    """Accelerometers that warm up, or that motors shake, moved a gyro by a g-sensitivity in three recordings."""
    run = unit(1)
    warmed = run.channels["accel_z"]
    rise = 0.4 * np.arange(len(run)) / len(run)
    run = replace(run, channels={**run.channels, "accel_z": replace(warmed, values=warmed.values + rise)})
    assert "which no tilt changes" in reasons(run)["g_sensitivity"]


def test_an_accelerometers_own_noise_and_drift_are_no_specific_force() -> None:
    said = reasons(unit(1, common=0.4))
    assert "instruments at rest do by themselves" in said["g_sensitivity"]
    assert "no channel tells how the unit turned" in said["cross_axis"]


def test_tails_and_slow_noise_of_a_row_a_second_are_no_force() -> None:
    """Nothing averages them: by the median step alone all 20 such units moved."""
    assert all("instruments at rest do by" in reasons(slow(seed)).get("g_sensitivity", "") for seed in range(20))


def slow(seed: int) -> Recording:
    """A unit at rest read each second, its noise with the tails of a chip, and half of it left a row later."""
    rng = np.random.default_rng(seed)
    n = 1000
    gyros, accels = lfilter([1.0], [1.0, -0.5], rng.standard_t(4, (2, 3, n)))
    channels = {f"gyro_{axis}": Channel(0.006 * each, "rad/s") for axis, each in zip("xyz", gyros, strict=True)}
    channels |= {f"accel_{axis}": Channel(0.06 * each, "m/s^2") for axis, each in zip("xyz", accels, strict=True)}
    return Recording(np.arange(1.0, n + 1), channels, site=Site(gravity=G), label="slow")


def test_a_unit_that_sways_shows_no_cross_coupling() -> None:
    """About an axis between x and z, by far more than any noise: both read their shares of one motion."""
    run = unit(3)
    sway = 0.05 * np.sin(2 * np.pi * 0.3 * run.t)
    shares = {"gyro_x": 0.6, "gyro_z": 0.8}
    channels = {n: replace(c, values=c.values + shares.get(n, 0.0) * sway) for n, c in run.channels.items()}
    assert "no channel tells how the unit turned" in reasons(replace(run, channels=channels))["cross_axis"]


def test_a_unit_that_is_tilted_can_show_g_sensitivity() -> None:
    assert set(reasons(unit(1, tilts=0.05))) == {"cross_axis"}


def test_noise_of_one_cause_is_a_finding() -> None:
    asked = series_manifest(("gyro_x",), ("bias",))
    (found,) = common_mode(asked, (unit(2, common=0.4),))
    assert set(found.channels) == {*GYROS, *ACCELS}
    assert found.correlation == pytest.approx(0.4, abs=0.05)  # sd 0.01 each, the largest of 15
    assert "electronics or vibration" in common_remarks((found,))[0]


def test_independent_noise_is_none() -> None:
    """Ten units of 15 pairs at six deviations: no alarm but for 3e-7."""
    asked = series_manifest(("gyro_x",), ("bias",))
    assert all(common_mode(asked, (unit(seed),)) == () for seed in range(10))


@pytest.mark.parametrize("ppm", [100, 500, 10_000, 100_000])
def test_a_large_cross_coupling_is_as_visible_as_a_small_one(tmp_path: Path, ppm: int) -> None:
    turns = [["10 s", "60 deg"], ["10 s", "60 deg"], ["10 s", "50 deg"]]
    wrong = {"cross_axis": {"targets": "gyro_x", "c_x": "0", "c_y": "0", "c_z": f"{ppm} ppm"}}
    upright = {"vehicle.level_error": ["0 deg", "0 deg"], "profile.turns": turns, "duration": "70 s"}
    changes = {"undeclared": wrong, "model.target": "gyro_x", "held_out": {"start": "58 s"}} | upright
    (target,) = close(simulate("two_position/undeclared", tmp_path, 4, changes=changes)).targets
    assert [added.effect for added in target.added] == ["cross_axis"]
    found = {p.parameter: p for p in target.added[0].parameters}["c_z"]
    assert found.value == pytest.approx(1e-6 * ppm, rel=0.02)


# ------------------------------------------------------------------------------------------------- factors


@pytest.mark.parametrize(
    ("scales_", "words"),
    [
        ((0.505, 0.49, 0.5), "a factor of 2:"),
        ((9.8, 9.9, 9.7), "9.81 (g and m/s^2)"),
        ((1.75,), "a factor of 1.75:"),
        ((1.02, 0.97, 1.0), ""),
        ((0.5, 1.0, 1.0), ""),
    ],
)
def test_factors_in_words(scales_: tuple[float, ...], words: str) -> None:
    assert (words in factor_of(scales_)) if words else factor_of(scales_) == ""


def test_accelerometers_of_half_the_range_and_a_broken_axis_are_said() -> None:
    case = Case(accel=scales(-0.5, -0.49, -0.51), accel_bias=(0.1, -0.2, 4.9))
    model = manifest(ACCELS, ("accel_bias", "accel_scale_factor"), HeldOut())
    run = recording(case, 3)
    found = position_findings(model, (run,), trace_positions(model, (run,)), (), 0.01, 0)
    said = " ".join(found.targets[0].cautions)
    assert "a factor of 2: check the unit or the range setting" in said
    assert "accel_z has a bias of 0.5 g" in said


def test_gyros_of_twice_the_range_are_said_beside_their_scale_factor() -> None:
    model = manifest(GYROS, ("bias",), HeldOut())
    run = recording(Case(rests=20), 3)
    channels = {n: replace(c, values=2 * c.values) if n in GYROS else c for n, c in run.channels.items()}
    run = replace(run, channels=channels)
    found = position_findings(model, (run,), trace_positions(model, (run,)), (), 0.01, 0)
    for target in found.targets:
        (added,) = target.added
        assert (added.effect, target.verdict) == ("scale_factor", "effects-found")
        assert added.parameters[0].value == pytest.approx(1.0, abs=4 * added.parameters[0].sd)
        assert any("a factor of 2: check the unit" in caution for caution in target.cautions)


def test_a_gyro_whose_bias_goes_on_from_rest_to_rest_drifts_or_walks() -> None:
    model = manifest(GYROS, ("bias",), HeldOut())
    run = recording(Case(rests=20), 3)
    gone = np.ptp(run.channels["gyro_x"].values) * 1e-3 * np.linspace(0, 1, len(run.t))
    channels = dict(run.channels) | {
        "gyro_x": replace(run.channels["gyro_x"], values=run.channels["gyro_x"].values + gone)
    }
    run = replace(run, channels=channels)
    drifts, *others = position_findings(model, (run,), trace_positions(model, (run,)), (), 0.01, 0).targets
    (added,) = drifts.added
    assert (added.effect, added.confounded_with, drifts.verdict) == ("bias_drift", ("rate_random_walk",), "confounded")
    assert all(target.added == () for target in others)


def test_rests_that_are_none_are_said() -> None:
    model = manifest(ACCELS, ("accel_bias",), HeldOut())
    run = recording(Case(rests=20, accel_scatter=1.5), 3)
    found = position_findings(model, (run,), trace_positions(model, (run,)), (), 0.01, 0)
    assert any("the unit moved" in reason for reason in found.targets[0].reasons)


@pytest.mark.parametrize("number", [0.0, 0.01])
def test_a_channel_that_reads_one_number_is_left_out_and_said(tmp_path: Path, number: float) -> None:
    """A gyro whose dead band hides all at rest: it was structure (p = 0) or a division by zero; no chance is in it."""
    rng, n = np.random.default_rng(1), 1500
    gyro = np.where(np.arange(n) < 150, np.round(rng.normal(0, 0.05, n), 2), number)
    rows = np.column_stack([np.arange(n) / RATE, gyro, rng.normal(G, 0.02, n)])
    np.savetxt(tmp_path / "run.csv", rows, "%.9g", ",", header="t,g,a", comments="")
    text = (
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro_x = { column = "g", unit = "rad/s" }\naccel_x = { column = "a", unit = "m/s^2" }\n'
        '[model]\ntarget = ["gyro_x", "accel_x"]\ndeclared = ["bias"]\n[fit]\nrows = [[200, 1500]]\n'
    )
    (tmp_path / "run.toml").write_text(text)
    found = close(tmp_path / "run.toml")
    assert [target.target for target in found.targets] == ["accel_x"]
    assert any(f"gyro_x reads {number:g} rad/s in all rows that are fitted" in remark for remark in found.remarks)
    (tmp_path / "run.toml").write_text(text.replace('["gyro_x", "accel_x"]', '"gyro_x"'))
    with pytest.raises(InputError, match="same value in all rows that are fitted: a dead channel"):
        close(tmp_path / "run.toml")
