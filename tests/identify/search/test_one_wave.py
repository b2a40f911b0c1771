"""Lines that are one: multiples of one frequency, and two as near as those of an amplitude that swings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strangers import closed_at_rest

from insenv.identify.search.one_wave import swinging, wave

DT = 0.01


def closed(folder: Path, added: np.ndarray, seed: int = 0) -> tuple[list[str], tuple[str, ...]]:
    rate = 0.01 + 1e-3 * np.random.default_rng(seed).standard_normal(len(added)) + added
    found = closed_at_rest(folder, DT * np.arange(len(added)), rate, "0.01 s")
    return [one.effect for one in found.added], found.reasons


def test_clicks_are_one_wave(tmp_path: Path) -> None:
    """Their lines are found in the samples: of a stranger's unit they were stated as eight tones, and no doubt."""
    added = 7e-3 * (np.arange(6000) % 81 == 0)
    effects, reasons = closed(tmp_path, added)
    assert effects.count("tone") >= 3
    assert any("one wave that is no sine" in reason for reason in reasons)


def test_lines_that_have_nothing_to_do_with_each_other_are_none(tmp_path: Path) -> None:
    t = DT * np.arange(6000)
    added = 3e-4 * sum(np.cos(2 * np.pi * f * t) for f in (3.17, 7.43, 11.9, 19.33))
    effects, reasons = closed(tmp_path, added)
    assert effects.count("tone") == 4 and not reasons


@pytest.mark.parametrize("waves", [5.0, 5.2])
def test_a_short_recording_shows_one_wave_if_its_lines_are_exact(waves: float) -> None:
    """Lines of a saw tooth seen for seven of its waves were stated as three tones."""
    assert wave(waves * np.array([1, 2, 4]) + np.array([0.0, 0.01, 0.04]), 1.0) == pytest.approx(waves)
    assert wave(waves * np.array([1, 2, 4]) + np.array([0.0, 0.29, 0.25]), 1.0) is None


@pytest.mark.parametrize("count", [3, 4, 5])
def test_few_waves_of_unrelated_lines_seldom_are(count: int) -> None:
    # Of 2000 triples some 22 are by chance, fewer of more lines: 45 or more would come in one of 10 000 such tests.
    draws = np.sort(np.random.default_rng(count).uniform(4.0, 20.0, (2000, count)))
    assert sum(wave(row, 1.0) is not None for row in draws) < 45


def test_a_line_whose_amplitude_swings_is_not_told_from_two(tmp_path: Path) -> None:
    t = DT * np.arange(6000)
    added = 5e-4 * (1 + 0.5 * np.cos(2 * np.pi * t / 8.0)) * np.cos(2 * np.pi * 23.0 * t)
    _, reasons = closed(tmp_path, added)
    assert any("whose amplitude swings in" in reason for reason in reasons)


def test_lines_far_apart_are_two() -> None:
    assert swinging(np.array([0.9, 1.0, 23.0, 23.4])) is None
    assert swinging(np.array([5.0, 23.0, 23.1, 23.15])) == (23.1, 23.15)
