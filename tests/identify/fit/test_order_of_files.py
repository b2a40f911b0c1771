"""What is found does not depend on which file comes first, nor on a bias: both tell nothing of an instrument.

Generated with NumPy alone; seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify.findings import TargetFindings

MANIFEST = (
    '[channels]\ntime = { column = "t", unit = "s" }\n'
    'table_rate = { column = "u", unit = "deg/s", source = "command" }\n'
    'gyro = { column = "y", unit = "deg/s" }\n'
    '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
)


def judged(folder: Path, runs: Sequence[tuple[Floats, Floats, Floats]]) -> TargetFindings:
    """The findings on files of times [s], commands and readings [deg/s], in this order."""
    files = []
    for k, (t, u, y) in enumerate(runs):
        np.savez(folder / f"run{k}.npz", t=t, u=u, y=y)
        files.append(f'[[runs]]\nfile = "run{k}.npz"\n')
    (folder / "runs.toml").write_text(MANIFEST + "".join(files), encoding="utf-8")
    return close(folder / "runs.toml").targets[0]


def to_and_fro(most: float, seed: int) -> tuple[Floats, Floats, Floats]:
    """Twenty levels up to a rate, half a minute each, of a gyro whose gain is 0.3 % more beyond 50 deg/s."""
    rng = np.random.default_rng(seed)
    t = 0.1 * np.arange(6000.0)
    u = most * np.repeat(
        [0, 0.3, 0.5, 0.8, 1, 0, -0.3, -0.5, -0.8, -1, 0.4, 0.6, 0.9, -0.4, -0.6, -0.9, 1, -1, 0.7, 0], 300
    )
    more = 3e-3 * np.sign(u) * np.maximum(np.abs(u) - 50, 0)
    return t, u, 1.001 * u + more + 0.02 * rng.standard_normal(len(t))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0)])
def test_shapes_are_tried_over_the_range_of_all_files(order: tuple[int, ...], tmp_path: Path) -> None:
    """Files of one length, to 20, 60 and 100 deg/s: a grid over the first alone ended at 20."""
    every = [to_and_fro(most, seed) for seed, most in enumerate((20.0, 60.0, 100.0))]
    found = judged(tmp_path, [every[k] for k in order])
    (added,) = found.added
    assert added.effect == "scale_factor_knee"
    values = {p.parameter: (p.value, p.sd) for p in added.parameters}
    assert abs(values["c"][0] - 3e-3) < 3 * values["c"][1]
    assert abs(np.degrees(values["d"][0]) - 50) < 3 * np.degrees(values["d"][1])


@pytest.mark.parametrize("bias", [0.0, 2.0, 15.0])
def test_the_ends_of_dwells_at_one_rate_tell_no_gain(bias: float, tmp_path: Path) -> None:
    """There and back, the way back held out: half of the level was taken for a gain, and a drift was twice its size."""
    rng = np.random.default_rng(4)
    t = np.arange(1200.0)
    u = np.where(t < 600, 30.0, -30.0)
    y = (1.001 + 2e-5 * t) * u + bias + 0.02 * rng.standard_normal(len(t))
    found = judged(tmp_path, [(t, u, y)])
    (added,) = found.added
    assert added.effect == "scale_factor_drift"
    (c,) = added.parameters
    assert abs(c.value - 2e-5) < 3.5 * c.sd
