"""Attitudes by hand: of one side alone, which tell bias from scale factor by little; at uneven times; too few."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.findings import Findings

HZ, REST, NOISE = 50, 4.0, 5e-3


def closed(folder: Path, most: float, count: int = 24, uneven: bool = False) -> Findings:
    """Accelerometers held still in some attitudes with z down but for ``most`` [rad], turned between.

    Of ``uneven`` rows the steps follow no clock.
    """
    rng = np.random.default_rng(1)
    rows: list[Floats] = []
    for _ in range(count):
        away, about = most * np.sqrt(rng.uniform()), rng.uniform(0, 2 * np.pi)
        down = np.array([np.sin(away) * np.cos(about), np.sin(away) * np.sin(about), -np.cos(away)])
        before = rows[-1][-1] / np.linalg.norm(rows[-1][-1]) if rows else down
        way = np.linspace(before, down, HZ)
        rows += [STANDARD_GRAVITY * way / np.linalg.norm(way, axis=1)[:, None] + 0.3 * rng.standard_normal((HZ, 3))]
        rows += [np.tile(STANDARD_GRAVITY * down, (round(REST * HZ), 1))]
    read = np.concatenate(rows)
    read += NOISE * rng.standard_normal(read.shape)
    t = np.arange(len(read)) / HZ
    if uneven:
        kept = np.cumsum(rng.integers(1, 7, len(t)))
        kept = kept[kept < len(t)]
        t, read = t[kept], read[kept]
    np.savetxt(folder / "run.csv", np.column_stack([t, read]), "%.6f", ",", header="t,x,y,z", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        + "".join(f'accel_{axis} = {{ column = "{axis}", unit = "m/s^2" }}\n' for axis in "xyz")
        + f'[site]\ngravity = "{STANDARD_GRAVITY} m/s^2"\n[model]\nprocedure = "multi-position"\n'
        'target = ["accel_x", "accel_y", "accel_z"]\ndeclared = ["accel_bias", "accel_scale_factor"]\n'
    )
    return close(folder / "run.toml")


@pytest.mark.parametrize(("most", "said"), [(0.6, True), (np.pi, False)])
def test_an_axis_that_points_one_way_in_all_rests_is_told(tmp_path: Path, most: float, said: bool) -> None:
    (z,) = (one for one in closed(tmp_path, most).targets if one.target == "accel_z")
    assert any("up and down tell" in caution for caution in z.cautions) is said


def test_rows_at_uneven_times_follow_each_other_for_nothing_has_to_be_met_between(tmp_path: Path) -> None:
    found = closed(tmp_path, np.pi, uneven=True)
    assert any("at their mean rate" in remark for remark in found.remarks)
    bias = [row for one in found.targets for row in one.estimates_after if row.effect == "accel_bias"]
    assert len(bias) == 3 and all(abs(row.value) < 5 * row.sd for row in bias)  # 2e-6 by chance


def test_too_few_attitudes_are_refused_with_how_long_a_rest_must_be(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"held still for 2 s or longer"):
        closed(tmp_path, np.pi, count=1)
