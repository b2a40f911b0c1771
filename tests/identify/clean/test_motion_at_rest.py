"""A unit that is declared at rest and moves: the rows are left out and said, or the recording is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Channel, Recording
from insenv.data.manifest import load_manifest
from insenv.data.split import RowUse
from insenv.identify.clean.motion import at_rest
from insenv.identify.findings import Findings

DT, N = 0.02, 20000


def closed(folder: Path, gyro: np.ndarray, more: str = "") -> Findings:
    np.savetxt(folder / "run.csv", np.column_stack([np.arange(N) * DT, gyro]), "%.9g", ",", header="t,g", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        f'gyro = {{ column = "g", unit = "deg/s" }}\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n{more}'
    )
    return close(folder / "run.toml")


def turned(start: float, seconds: float, angle: float = 360.0) -> np.ndarray:
    """A still gyro that is turned by hand once: a bell of the rate."""
    t = np.arange(N) * DT
    bell = np.exp(-0.5 * ((t - start) / (seconds / 5)) ** 2)
    return 0.3 + np.random.default_rng(1).normal(0, 0.05, N) + angle * bell / (bell.sum() * DT)


def test_a_turn_by_hand_is_no_error_of_the_gyro(tmp_path: Path) -> None:
    found = closed(tmp_path, turned(100.0, 12.0))
    (target,) = found.targets
    assert not target.added
    assert found.rows_rejected and all(row.reason == "motion" for row in found.rows_rejected)
    covered = sum(row.stop - row.start for row in found.rows_rejected) * DT
    assert 12.0 < covered < 28.0  # the bell is seen until four of its deviations
    assert target.cautions[0].startswith("Declared at rest, but the unit moves")
    (bias,) = target.estimates_after
    assert bias.value == pytest.approx(np.radians(0.3), abs=5 * bias.sd)


def test_a_recording_that_only_moves_is_refused(tmp_path: Path) -> None:
    t = np.arange(N) * DT
    with pytest.raises(InputError, match="is declared at rest and moves in .*multi-position"):
        closed(tmp_path, 30 * np.sin(2 * np.pi * t / 60))


def test_slow_and_small_departures_are_the_instruments(tmp_path: Path) -> None:
    """A warm-up of 2 deg/s, or a bias of 20 deg/s, is no motion."""
    t = np.arange(N) * DT
    rng = np.random.default_rng(2)
    found = closed(tmp_path, 20 + 2 * np.exp(-t / 60) + rng.normal(0, 0.05, N))
    assert not found.rows_rejected
    assert [one.effect for one in found.targets[0].added] == ["bias_warm_up"]


def test_loud_noise_is_no_motion(tmp_path: Path) -> None:
    """White noise of 60 deg/s at 50 Hz: means of a second scatter by 8.5 deg/s, beyond the limit of a quiet gyro."""
    found = closed(tmp_path, np.random.default_rng(3).normal(0, 60, N))
    assert not found.rows_rejected


def heaving(size: float) -> Recording:
    """Three minutes at rest, of which 50 s on a stage that heaves at 0.2 Hz by ``size`` [m/s^2] and sways a little."""
    rng, t = np.random.default_rng(4), np.asarray(0.02 * np.arange(9000), np.float64)
    moves = np.where((t > 60) & (t < 110), np.sin(2 * np.pi * 0.2 * t), 0.0)
    channels = {"accel_z": Channel(9.8 + size * moves + 0.01 * rng.standard_normal(9000), "m/s^2")}
    channels["gyro_x"] = Channel(1e-3 * moves + 1e-3 * rng.standard_normal(9000), "rad/s")
    return Recording(t, channels, label="stage")


@pytest.mark.parametrize("target", ["accel_z", "gyro_x"])
def test_a_base_that_heaves_is_motion_of_every_channel(tmp_path: Path, target: str) -> None:
    """One per cent of gravity, far below what tips a unit: 0.14 m/s^2 of a stage that goes up and down by 90 mm."""
    (tmp_path / "m.toml").write_text(MANIFEST)
    use = RowUse(np.arange(9000) < 5400, np.arange(9000) >= 5400)
    kept, rows = at_rest(load_manifest(tmp_path / "m.toml"), (heaving(0.14),), (use,), target)
    assert [row.reason for row in rows] == ["motion"]
    assert 0.02 * rows[0].start == pytest.approx(58, abs=4) and 0.02 * rows[0].stop == pytest.approx(112, abs=4)
    assert not kept[0].fit[3000:5400].any()


def test_a_base_that_trembles_is_none(tmp_path: Path) -> None:
    """0.05 m/s^2 at most, as engines and passers-by make it."""
    (tmp_path / "m.toml").write_text(MANIFEST)
    use = RowUse(np.arange(9000) < 5400, np.arange(9000) >= 5400)
    assert not at_rest(load_manifest(tmp_path / "m.toml"), (heaving(0.05),), (use,), "accel_z")[1]


MANIFEST = """
data = "m.csv"
[channels]
time = { column = "t", unit = "s" }
accel_z = { column = "a", unit = "m/s^2" }
gyro_x = { column = "g", unit = "rad/s" }
[model]
target = ["accel_z", "gyro_x"]
declared = ["bias"]
"""


def then_turned(rest: int) -> np.ndarray:
    """A gyro at rest for ``rest`` rows, and turned by hand ever after, until it clips."""
    t = np.arange(N) * DT
    hand = np.clip(300 * np.sin(2 * np.pi * t / 7) * (np.arange(N) >= rest), -250, 250)
    return 0.3 + np.random.default_rng(4).normal(0, 0.05, N) + hand


@pytest.mark.parametrize("rest", [8000, 14000])
def test_fit_rows_alone_name_the_rest(tmp_path: Path, rest: int) -> None:
    """The advice of the refusal: what follows is not looked at, no motion, no rail and no knock of it is told."""
    with pytest.raises(InputError, match=r"is declared at rest and moves .*fit\.rows"):
        closed(tmp_path, then_turned(8000))
    found = closed(tmp_path, then_turned(rest), f"[fit]\nrows = [[0, {rest}]]\n")
    (target,) = found.targets
    assert not target.added and not target.cautions and not found.rows_rejected
    assert not any("mean rate at rest" in remark for remark in found.remarks)
    (bias,) = target.estimates_after
    assert bias.value == pytest.approx(np.radians(0.3), abs=4 * bias.sd)


def test_a_rest_behind_motion_is_named_by_rows(tmp_path: Path) -> None:
    """Most rows move; the median of all of them is no rest."""
    gyro = then_turned(6000)[::-1].copy()
    found = closed(
        tmp_path, gyro, f"[fit]\nrows = [[{N - 6000}, {N - 2000}]]\n[held_out]\nrows = [[{N - 2000}, {N}]]\n"
    )
    assert not found.targets[0].added
    assert sum(row.stop - row.start for row in found.rows_rejected) * DT <= 4.0  # what stands beside the motion


@pytest.mark.parametrize("turns", [0.0, 0.3])
def test_a_gyro_on_a_sled_is_judged_while_it_is_shaken(tmp_path: Path, turns: float) -> None:
    """To and fro by 3 m/s^2, and turned by 17 deg/s at most, or not: the second was refused as the first is."""
    t, rng = DT * np.arange(9000.0), np.random.default_rng(3)
    force = 3 * np.sin(2 * np.pi * t / 8) * (1 + 0.3 * np.sin(2 * np.pi * t / 50)) + 0.02 * rng.standard_normal(len(t))
    rate = 1e-5 * force + turns * np.sin(2 * np.pi * t / 20) + 1e-4 * rng.standard_normal(len(t))
    sled = Recording(t, {"accel_z": Channel(force, "m/s^2"), "gyro_x": Channel(rate, "rad/s")})
    (tmp_path / "m.toml").write_text(MANIFEST)
    use = RowUse(np.arange(9000) < 5400, np.arange(9000) >= 5400)
    if turns:
        with pytest.raises(InputError, match="is declared at rest and moves"):
            at_rest(load_manifest(tmp_path / "m.toml"), (sled,), (use,), "gyro_x")
    else:
        assert at_rest(load_manifest(tmp_path / "m.toml"), (sled,), (use,), "gyro_x") == ((use,), ())
