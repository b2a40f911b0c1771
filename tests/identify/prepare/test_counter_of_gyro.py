"""A gyro that counts, beside a table that turns steadily: the pattern of its own counts is no line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close

RATE, ARCSEC = 100.0, np.pi / 180 / 3600


def recorded(folder: Path, line: float = 0.0) -> Path:
    """Counts of one arcsec of a table that turns to and fro, some stamps late and rows lost."""
    rng = np.random.default_rng(3)
    t = np.arange(0, 160.0, 1 / RATE)
    rate = np.where((t / 20).astype(int) % 2, -0.17451, 0.17451)
    angle = np.cumsum(rate) / RATE
    sway = line / (2 * np.pi * 18.2) * np.cos(2 * np.pi * 18.2 * t)
    counts = np.diff(np.floor((angle + sway + 2e-8 * np.cumsum(rng.standard_normal(len(t)))) / ARCSEC))
    stamps = t[1:] + np.where(rng.random(len(t) - 1) < 0.003, 0.004, 0.0)
    rows = np.column_stack([stamps, counts, np.rad2deg(rate[1:])])[rng.random(len(t) - 1) > 0.001]
    np.savetxt(folder / "run.csv", rows, delimiter=",", fmt="%.9g", header="time,gyro,table_rate", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "time", unit = "s" }\n'
        'gyro = { column = "gyro", unit = "arcsec", quantity = "increment" }\n'
        'table_rate = { column = "table_rate", unit = "deg/s" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    )
    return folder / "run.toml"


def test_the_pattern_of_own_counts_is_no_tone(tmp_path: Path) -> None:
    (target,) = close(recorded(tmp_path)).targets
    assert [a.effect for a in target.added] == []


def test_a_line_of_more_than_a_count_is_one(tmp_path: Path) -> None:
    (target,) = close(recorded(tmp_path, line=1.5e-3)).targets
    assert [a.effect for a in target.added] == ["tone"]


@pytest.mark.parametrize(("pulse", "walk", "rates"), [(0.466, 0.1, (20, -20, 40, -40)), (1.5, 0.2, (5, -5, 25, -25))])
def test_counts_of_a_steady_rate_are_no_structure(
    pulse: float, walk: float, rates: tuple[float, ...], tmp_path: Path
) -> None:
    """Angle random walk [arcsec/sqrt(s)] far below a pulse: a hump, a wave of the angle, louder where it is fast."""
    rng, dt, n = np.random.default_rng(19), 0.1, 12000
    rate = np.repeat(rates, n // len(rates)) * 3600.0
    turned = np.cumsum((rate * (1 + 3e-6) + 2.0) * dt + walk * np.sqrt(dt) * rng.standard_normal(n))
    counts = np.diff(np.floor(np.concatenate([[0.0], turned]) / pulse + 0.37))
    rows = np.column_stack([dt * np.arange(1, n + 1), counts, rate / 3600])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", fmt="%.6g", header="time,pulses,rate", comments="")
    (tmp_path / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "time", unit = "s" }\n'
        f'gyro = {{ column = "pulses", unit = "{pulse} arcsec", quantity = "increment" }}\n'
        'table_rate = { column = "rate", unit = "deg/s", covers = "interval" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    )
    assert close(tmp_path / "run.toml").targets[0].verdict == "nothing-significant"
