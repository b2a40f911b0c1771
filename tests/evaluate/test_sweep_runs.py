"""Runs of a scenario as the job of a sweep: by Python and by the command."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command import interruptible, run
from scipy.stats import norm

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.evaluate.runs import Episodes, episodes, task_of
from insenv.evaluate.sweeps import moments
from insenv.sweep import Processes, stacked, sweep

#: The published north finder, 60 s at 10 Hz: quick, and no other.
QUICK = {"duration": "60 s", "instrument.sampling": "10 Hz"}
PUBLISHED = "north_finder/published"
JOBS = {
    "samples": Episodes(PUBLISHED, "north_gls", "constant_rate", '{"duration": "60 s"}', every=60),
    "dwells": Episodes(PUBLISHED, "revolution", "constant_rate", '{"duration": "100 s"}', path="dwells"),
}


@pytest.mark.parametrize("path", ["samples", "dwells"])
def test_chunks_and_processes_change_no_bit_of_a_run(path: str) -> None:
    job = JOBS[path]
    whole = job(range(3, 23))
    alone = job([17])
    for name, column in whole.items():
        np.testing.assert_array_equal(column[14:15], alone[name])
    found = stacked(sweep(job, 3, 20, backend=Processes(2), chunk=6).parts())
    for name, column in whole.items():
        np.testing.assert_array_equal(column, found[name])


def test_columns_of_a_table() -> None:
    table = episodes(PUBLISHED, "north_gls", "constant_rate", [4, 5], QUICK, every=60)
    names = ["seed", "time", "stopped", "estimate.azimuth", "estimate.scale_factor", "cov.azimuth.azimuth"]
    names += ["cov.azimuth.scale_factor", "cov.scale_factor.scale_factor", "truth.azimuth", "error.azimuth"]
    assert list(table) == names
    assert table["seed"].tolist() == [4, 5]
    off = (table["estimate.azimuth"] - table["truth.azimuth"] + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_array_equal(table["error.azimuth"], off)
    assert table["time"].tolist() == [60.0, 60.0]


@pytest.mark.slow
def test_both_paths_give_the_same_errors() -> None:
    """Dwells of 0.1 s of a gyro at 100 Hz beside the same gyro read at 10 Hz: every effect is a mean over its interval.

    400 runs each. Means and root mean squares within 5.2 standard errors of their difference: 4e-7 false alarms.
    """
    seconds = {"duration": "120 s"}
    drawn = episodes(PUBLISHED, "north_gls", "constant_rate", range(400), seconds, path="dwells", block=0.1)
    slow = {**seconds, "instrument.sampling": "10 Hz"}
    played = episodes(PUBLISHED, "north_gls", "constant_rate", range(1000, 1400), slow, every=120)
    bound = norm.isf(1e-7)
    a, b = drawn["error.azimuth"], played["error.azimuth"]
    assert abs(a.mean() - b.mean()) < bound * np.hypot(a.std(), b.std()) / 20
    assert abs(np.log(np.mean(a**2) / np.mean(b**2))) < bound * np.sqrt(2 * (2 / 400))
    np.testing.assert_allclose(drawn["cov.azimuth.azimuth"].mean(), played["cov.azimuth.azimuth"].mean(), rtol=0.02)


@pytest.mark.parametrize(
    ("scenario", "policy", "block", "what"),
    [
        ("north_finder/realistic", "constant_rate", None, "wanted the path sample by sample"),
        ("two_position/published_a", "published_schedule", None, "has no path 'dwells'"),
        ("rate_table/kvh13", "published_ladder", None, "has no path 'dwells'"),
        (PUBLISHED, "sweep_plugins:Looking", None, "looks at what is measured"),
        (PUBLISHED, "constant_rate", 0.3, "wanted a whole part of the step, 1 s"),
        (PUBLISHED, "constant_rate", 0.001, "wanted a whole part of the step, 1 s"),
    ],
)
def test_what_has_no_short_cut_is_refused(scenario: str, policy: str, block: float | None, what: str) -> None:
    with pytest.raises(InputError, match=what):
        episodes(scenario, "north_gls", policy, [0], path="dwells", block=block)


def test_wrong_settings_are_refused() -> None:
    with pytest.raises(InputError, match="path 'magic' given; wanted samples or dwells"):
        episodes(PUBLISHED, "north_gls", "constant_rate", [0], path="magic")
    with pytest.raises(InputError, match="with the path 'dwells' only"):
        episodes(PUBLISHED, "north_gls", "constant_rate", [0], block=0.1)


@pytest.mark.parametrize("scenario", ["north_finder/published", "two_position/published_a", "rate_table/kvh13"])
def test_every_environment_has_its_task(scenario: str) -> None:
    assert task_of(scenario).name.endswith(repr(scenario.split("/")[1]))


def test_moments_are_those_of_all_values() -> None:
    x: Floats = np.random.default_rng(0).standard_normal(1000) + 0.3
    found = moments([x[:300], x[300:]])
    assert found.mean[0] == pytest.approx(x.mean())
    assert found.deviation[0] == pytest.approx(x.std(ddof=1))
    assert found.rms[0] == pytest.approx(np.sqrt(np.mean(x**2)))
    # Of Gaussian values: s z / sqrt(n) and s z / sqrt(2 n), the second from the fourth moment of the sample.
    assert found.mean[1] == pytest.approx(1.96 / 1000**0.5, rel=0.1)
    assert found.deviation[1] == pytest.approx(1.96 / 2000**0.5, rel=0.2)


def test_intervals_hold_as_often_as_they_say() -> None:
    """2000 samples of 200 normals: 95 % of the intervals hold the truth; 5 standard errors: 6e-7 false alarms each."""
    x = np.random.default_rng(1).standard_normal((2000, 200))
    found = [moments([row]) for row in x]
    for name, true in (("mean", 0.0), ("deviation", 1.0), ("rms", 1.0)):
        inside = np.mean([abs(getattr(m, name)[0] - true) < getattr(m, name)[1] for m in found])
        # Of 200 values the fourth moment of a sample is small: its intervals hold a little less often.
        assert 0.95 - 5 * 0.005 - (0.01 if name != "mean" else 0) < inside < 0.95 + 5 * 0.005


COMMAND = ("sweep", PUBLISHED, "--policy", "constant_rate", "--estimator", "revolution", "--path", "dwells")


def test_the_command_shows_errors_and_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = run(capsys, monkeypatch, *COMMAND, "--seeds", 60)
    assert plain.status == 0
    for line in ("60 runs of 300 s", "azimuth [arcsec]", "mean error", "error / claimed"):
        assert line in plain.out
    store = tmp_path / "store"
    kept = run(capsys, monkeypatch, *COMMAND, "--seeds", 60, "--store", store)
    assert kept.out == plain.out
    (first, *_) = sorted(store.glob("runs-*.npz"))
    first.unlink()
    refused = run(capsys, monkeypatch, *COMMAND, "--seeds", 60, "--store", store)
    assert refused.status == 2 and "wanted --resume to go on" in refused.err
    resumed = run(capsys, monkeypatch, *COMMAND, "--seeds", 60, "--store", store, "--resume")
    assert resumed.out == plain.out
    other = run(capsys, monkeypatch, *COMMAND, "--seeds", 61, "--store", store, "--resume")
    assert other.status == 2 and "its number of runs is 60 and not 61" in other.err


@pytest.mark.parametrize(
    ("more", "what"),
    [
        (("--resume",), "--resume given without --store"),
        (("--seeds", "0"), "0 runs from seed 0 given"),
        (("--first", "-1"), "from seed -1 given"),
        (("--jobs", "0"), "0 processes given"),
        (("--jobs", "2", "--cluster", "tcp://x:1"), "wanted one of the two"),
        (("--block", "0.1"), "--block"),
    ],
)
def test_bad_options_end_with_one_sentence(
    more: tuple[str, ...], what: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = run(capsys, monkeypatch, *COMMAND, *more)
    assert ended.status == 2 and what in ended.err and ended.err.count("\n") == 1


def test_an_interruption_says_how_to_go_on(tmp_path: Path) -> None:
    store = tmp_path / "store"
    command = [sys.executable, "-m", "insenv.cli", "sweep", PUBLISHED, "--policy", "constant_rate"]
    command += ["--estimator", "revolution", "--seeds", "100000", "--store", str(store)]
    with interruptible():
        driver = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    deadline = time.monotonic() + 120
    while not list(store.glob("runs-*.npz")) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(driver.pid, signal.SIGINT)
    _, said = driver.communicate(timeout=60)
    assert driver.returncode == 130
    assert f"interrupted; what is done is in {store}, and the same command with --resume goes on" in said
    assert "Traceback" not in said
