"""A tone has one amplitude: a line that rings in a part of the time is none, and one that breathes is one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strangers import closed_at_rest

from insenv.identify.findings import TargetFindings

DT, N = 0.1, 6000
T = DT * np.arange(N)


def closed(folder: Path, wave: np.ndarray, seed: int = 0) -> TargetFindings:
    rate = 0.01 + 1e-3 * np.random.default_rng(seed).standard_normal(N) + wave
    return closed_at_rest(folder, T, rate, "0.1 s")


def line(envelope: np.ndarray) -> np.ndarray:
    return np.asarray(1e-3 * envelope * np.cos(2 * np.pi * 0.7 * T + 0.4))


@pytest.mark.parametrize("start", [60.0, 200.0, 290.0])
def test_what_rings_after_a_push_is_no_tone(tmp_path: Path, start: float) -> None:
    """A table that is pushed at ``start`` swings for a minute."""
    found = closed(tmp_path, line(2.0 * (start < T) * np.exp(-np.maximum(T - start, 0) / 25)))
    assert "tone" not in [one.effect for one in found.added]


@pytest.mark.parametrize(
    "envelope", [np.full(N, 0.3), 0.4 + 0.25 * np.cos(2 * np.pi * T / 200)], ids=["even", "breathes"]
)
def test_a_line_of_one_amplitude_or_nearly_is_one(tmp_path: Path, envelope: np.ndarray) -> None:
    found = closed(tmp_path, line(envelope))
    (tone,) = found.added
    assert tone.effect == "tone"
    assert {p.parameter: p.value for p in tone.parameters}["f"] == pytest.approx(0.7, abs=1e-3)
