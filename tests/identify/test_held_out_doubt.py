"""Held-out data beyond what the fitted noise foretells are a doubt of the model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from strangers import closed_at_rest

from insenv.close import close
from insenv.identify.findings import TargetFindings

DT = 0.02


def closed(folder: Path, other: float, seed: int) -> TargetFindings:
    """Means over 0.2 s of half a minute of a gyro beside a table that turns faster towards the end.

    There an ``other`` axis comes in, as it moves.
    """
    rng = np.random.default_rng(seed)
    t = DT * np.arange(1500)
    late = t > 0.6 * t[-1]
    rate = np.where(late, 1.0, 0.3) * (np.sin(0.9 * t) * np.sin(0.13 * t) + 0.5 * np.sin(2.1 * t))
    axis = lfilter([0.1], [1, -0.9], rng.standard_normal(len(t)))
    read = rate + np.where(late, other, 0.0) * axis + 0.003 + 0.005 * rng.standard_normal(len(t))
    np.savetxt(folder / "run.csv", np.column_stack([t, read, rate]), "%.9g", ",", header="t,g,w", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\n'
        'table_rate = { column = "w", unit = "rad/s", source = "encoder" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
        '[held_out]\naveraging = "0.2 s"\n'
    )
    (found,) = close(folder / "run.toml").targets
    return found


@pytest.mark.parametrize("seed", range(3))
def test_held_out_data_that_hold_more_than_the_fitted_ones_are_a_doubt(tmp_path: Path, seed: int) -> None:
    found = closed(tmp_path, 0.1, seed)
    assert found.verdict in ("unexplained-structure", "effects-found-incomplete")
    assert any("their level left out" in reason for reason in found.reasons)
    assert not any("scatter" in caution for caution in found.cautions)


def test_what_is_fitted_is_no_surer_than_held_out_data_bear_out(tmp_path: Path) -> None:
    """The fitted rows, and so the fit, are the same with the other axis and without: the deviation is not."""
    rows = [closed(tmp_path, other, 0) for other in (0.1, 0.0)]
    beside, alone = ({e.effect: e for e in found.estimates_after} for found in rows)
    (reason,) = [r for r in rows[0].reasons if "their level left out" in r]
    factor = float(reason.split(" by ")[1].split(" times")[0])
    assert factor > 2
    for effect in ("bias", "scale_factor"):
        assert beside[effect].value == pytest.approx(alone[effect].value, rel=1e-6)
        assert beside[effect].sd == pytest.approx(factor * alone[effect].sd, rel=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_faster_turns_alone_are_none(tmp_path: Path, seed: int) -> None:
    found = closed(tmp_path, 0.0, seed)
    assert found.verdict == "nothing-significant"
    assert not found.reasons


def tilted(folder: Path, begins: int, lasts: int, by: float = 0.25, seed: int = 0) -> TargetFindings:
    """Forty minutes of a tag, a mean a minute, whose accelerometer tilts ``by`` so much [m/s^2] in the fitted part."""
    n = np.arange(40)
    read = by * np.clip((n - begins) / lasts, 0, 1) + 0.02 * np.random.default_rng(seed).standard_normal(len(n))
    return closed_at_rest(folder, 60.0 * n, read, "60 s", "accel_x", "m/s^2")


@pytest.mark.parametrize(("begins", "lasts"), [(8, 8), (12, 8), (16, 4), (16, 8)])
def test_a_level_that_went_far_since_the_fit_is_not_called_nothing(tmp_path: Path, begins: int, lasts: int) -> None:
    """So few means tell no tilt from noise that wanders, which then explains all but that the level is elsewhere."""
    found = tilted(tmp_path, begins, lasts)
    assert found.verdict != "nothing-significant"


def test_a_level_that_stays_is_no_doubt(tmp_path: Path) -> None:
    assert tilted(tmp_path, 8, 8, 0.0, seed=1).verdict == "nothing-significant"
