"""A scale factor that is another one beyond a rate, which was named a cubic, and a cubic, which is none."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import DEG_PER_HOUR, closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.findings import TargetFindings

N, DT = 12_000, 0.2
T = DT * np.arange(1.0, N + 1)
#: Where the knee is, the noise of a row, and what a law adds at the largest rate [rad/s].
KNEE, WHITE, MOST = float(np.deg2rad(25)), 20 * DEG_PER_HOUR, 40 * DEG_PER_HOUR


def rates(programme: str) -> Floats:
    """Ten levels of a staircase of both signs, or a swing, to 60 deg/s."""
    if programme == "swing":
        return np.asarray(np.deg2rad(60) * np.sin(2 * np.pi * T / 300))
    levels = np.deg2rad([6, -12, 18, -24, 30, -36, 42, -48, 54, -60, -6, 12, -18, 24, -30, 36, -42, 48, -54, 60])
    rate = levels[(np.arange(N) // 150) % 20]
    return np.asarray(np.convolve(rate, np.full(5, 0.2), "same"))


def said(programme: str, law: str, seed: int) -> TargetFindings:
    """The loop on a gyro beside its table, with bias and scale factor declared."""
    rate, rng = rates(programme), np.random.default_rng(seed)
    beyond = np.sign(rate) * np.maximum(np.abs(rate) - KNEE, 0.0)
    added = MOST * (beyond / np.abs(beyond).max() if law == "knee" else (rate / np.abs(rate).max()) ** 3)
    channels = {
        "gyro": Channel(rate + added + WHITE * rng.standard_normal(N), "rad/s", "interval"),
        "table_rate": Channel(rate, "rad/s", "interval"),
        "table_angle": Channel(np.cumsum(rate) * DT, "rad"),
    }
    return closed(Recording(T, channels, label="a")).targets[0]


@pytest.mark.parametrize("programme", ["staircase", "swing"])
def test_a_knee_has_its_name_and_its_rate(programme: str) -> None:
    """Within five deviations: by chance in one of a million."""
    found = said(programme, "knee", 1)
    assert [one.effect for one in found.added] == ["scale_factor_knee"]
    c, d = found.added[0].parameters
    beyond = float(np.abs(rates(programme)).max()) - KNEE
    assert abs(c.value - MOST / beyond) < 5 * c.sd
    assert abs(d.value - KNEE) < 5 * d.sd


@pytest.mark.parametrize("programme", ["staircase", "swing"])
def test_a_cubic_is_no_knee(programme: str) -> None:
    """A knee has a parameter more, and explains less."""
    found = said(programme, "cubic", 2)
    assert [one.effect for one in found.added] == ["scale_factor_cubic"]
    assert found.verdict == "effects-found"


@pytest.mark.parametrize("law", ["knee", "cubic"])
def test_a_knee_of_a_test_with_a_file_for_each_rate_has_its_name(law: str) -> None:
    """No file has rates on both sides of it: it was not tried, and a cubic stated."""
    rng, runs, n = np.random.default_rng(3), [], 600
    for level in np.deg2rad([5, -5, 10, -10, 20, -20, 30, -30, 40, -40, 50, -50, 60, -60]):
        beyond = np.sign(level) * max(abs(level) - KNEE, 0.0) / (np.deg2rad(60) - KNEE)
        added = MOST * (beyond if law == "knee" else (level / np.deg2rad(60)) ** 3)
        gyro = level + added + 2e-5 + WHITE * rng.standard_normal(n)
        rate = Channel(np.full(n, level), "rad/s", "interval", source="command")
        runs.append(Recording(T[:n], {"gyro": Channel(gyro, "rad/s", "interval"), "table_rate": rate}))
    found = closed(tuple(runs), manifest(declared=("bias", "scale_factor"))).targets[0]
    assert [one.effect for one in found.added] == [f"scale_factor_{law}"]
    if law == "knee":
        _, d = found.added[0].parameters
        assert abs(d.value - KNEE) < 5 * d.sd
