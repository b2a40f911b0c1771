"""Increments of a sampler, or a recorder, whose stamps wander by a per cent: what was turned is neither more nor less.

Rates by the stamps are too large by twice the square of what stamps are wrong by; weighted by steps that the increments
do not have they are so too. A gyro of 1 rad/s has 2e-4 of that. Seeds are fixed; four deviations of the sampler's case,
6e-5.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.core.recording import Floats
from insenv.data.exposure import expose
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.reference import with_reference

N, DT, RATE, WANDERS = 12_000, 0.004, 1.0, 0.01

MANIFEST = """\
data = "run.csv"
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "gyro", unit = "rad", quantity = "increment" }
table_rate = { column = "rate", unit = "rad/s", source = "encoder" }
[model]
target = "gyro"
declared = ["bias", "scale_factor"]
"""


def logged(folder: Path, sampler: bool, seed: int) -> tuple[Path, Floats]:
    """A log of a table that turns steadily both ways, and the increments; stamps are the sampler's, or wander alone."""
    rng = np.random.default_rng(seed)
    even = DT * np.arange(float(N))
    stamps = even + WANDERS * DT * rng.standard_normal(N)
    at = stamps if sampler else even
    rate = np.where(np.arange(N) % 4000 < 2000, RATE, -RATE)
    increments = rate * np.append(DT, np.diff(at)) + 1e-7 * rng.standard_normal(N)
    shown = rate + 1e-3 * rng.standard_normal(N)
    np.savetxt(
        folder / "run.csv",
        np.column_stack([stamps, increments, shown]),
        delimiter=",", header="t,gyro,rate", comments="", fmt=("%.9f", "%.12e", "%.9f"),
    )  # fmt: skip
    (folder / "run.toml").write_text(MANIFEST)
    return folder / "run.toml", increments


@pytest.mark.parametrize("sampler", [True, False])
def test_means_are_what_was_turned_over_the_time(tmp_path: Path, sampler: bool) -> None:
    path, increments = logged(tmp_path, sampler, 1)
    (recording,) = map(with_reference, read_recordings(load_manifest(path)))
    exposure = expose(recording, "gyro")
    weight = exposure.count if exposure.covered is None else exposure.covered
    for start in range(100, N - 2000, 2000):
        rows = slice(start, start + 1800)
        mean = float(np.sum((weight * exposure.y)[rows]) / np.sum(weight[rows]))
        told = float(np.sum(increments[rows]) / (1800 * DT))
        # At either end a stamp may be wrong by four deviations, of 1800 rows.
        assert mean == pytest.approx(told, rel=8 * WANDERS / 1800)


@pytest.mark.parametrize("sampler", [True, False])
def test_rates_are_by_the_clock_that_the_increments_have(tmp_path: Path, sampler: bool) -> None:
    """By the other one they scatter by a per cent."""
    path, _ = logged(tmp_path, sampler, 2)
    (recording,) = read_recordings(load_manifest(path))
    channel = recording.channels["gyro"]
    assert channel.by_period is not sampler
    assert float(np.median(np.abs(np.diff(channel.values)))) < 1e-3
