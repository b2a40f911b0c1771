"""A fitted gain that no gyro has is doubted, though the means of the whole record do not tell it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.identify.clean import plausibility
from insenv.identify.clean.gains import gain_cautions


def swung(folder: Path, gain: float, seed: int) -> Path:
    """A gyro beside the rate of a table that swings, 20 s at 50 Hz."""
    t = np.arange(0, 20.0, 0.02)
    rate = 0.5 * np.sin(2 * np.pi * 0.3 * t)
    gyro = gain * rate + 1e-3 * np.random.default_rng(seed).standard_normal(len(t))
    np.savetxt(folder / "run.csv", np.column_stack([t, gyro, rate]), delimiter=",", header="t,y,u", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\ngyro = { column = "y", unit = "rad/s" }\n'
        'table_rate = { column = "u", unit = "rad/s" }\n[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    )
    return folder / "run.toml"


@pytest.mark.parametrize(("gain", "doubted"), [(2.7, True), (1.02, False), (0.3, False)])
def test_a_gain_larger_than_any_is_doubted(
    gain: float, doubted: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Errors of a reference make a gain smaller: one of 0.3 may be theirs. By noise alone 1.02 is never 1.4."""
    monkeypatch.setattr(plausibility, "_turning", lambda *of: ())
    found = close(swung(tmp_path, gain, 0))
    (target,) = found.targets
    assert any("times the rate that it was exposed to" in said for said in target.cautions) == doubted
    assert not gain_cautions(found, {"gyro": ("said before",)})
