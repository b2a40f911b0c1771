"""Other rows are held out where those that are by default hold what tells of an effect."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from insenv.close import close
from insenv.identify.findings import Findings

DT, LEVELS = 0.05, np.deg2rad([1, 2, 3, 4, 6, 8, 10, 15, 20, 30, 45, 60])


def closed(folder: Path, cubic: float, seed: int, more: str = "") -> Findings:
    """A staircase of rates that rises, to and fro at each level for 40 s, of a gyro with a cubic [s^2/rad^2]."""
    rng = np.random.default_rng(seed)
    n = round(20 / DT)
    u = np.concatenate([np.repeat([level, -level], n) for level in LEVELS])
    t = DT * np.arange(len(u))
    read = u * 1.002 + 1e-3 + cubic * u**3 + 2e-3 * rng.standard_normal(len(u))
    np.savetxt(folder / "run.csv", np.column_stack([t, read, u]), "%.9g", ",", header="t,g,w", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\n'
        'table_rate = { column = "w", unit = "rad/s", source = "encoder" }\n'
        f'[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n{more}'
    )
    return close(folder / "run.toml")


def test_a_cubic_that_the_held_out_rows_alone_tell_is_named_with_the_first_ones_held_out(tmp_path: Path) -> None:
    """The fitted rates go up to a sixth of the largest one, at which the cubic is a two-hundredth."""
    found = closed(tmp_path, 1e-3, 1)
    (target,) = found.targets
    (one,) = target.added
    assert "scale_factor_cubic" in (one.effect, *one.confounded_with)
    assert target.held_out.after <= target.held_out.before
    assert any("the first 40 % are held out here" in remark for remark in found.remarks)
    if one.effect == "scale_factor_cubic":
        (c,) = [row for row in one.parameters if row.parameter == "c"]
        assert abs(c.value - 1e-3) < 4 * c.sd  # 6e-5 by chance


def test_rows_that_a_manifest_holds_out_stay_held_out(tmp_path: Path) -> None:
    found = closed(tmp_path, 1e-3, 1, '[held_out]\nstart = "288 s"\n')
    (target,) = found.targets
    assert not target.added and any("scale_factor_cubic explains all rows" in reason for reason in target.reasons)
    assert not any("held out here" in remark for remark in found.remarks)


def test_a_gyro_without_a_fault_is_asked_once(tmp_path: Path) -> None:
    """Chance is asked twice more once in a million."""
    for seed in range(3):
        found = closed(tmp_path, 0.0, seed)
        assert not found.targets[0].added and not any("held out here" in remark for remark in found.remarks)
