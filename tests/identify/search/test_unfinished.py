"""Tones that are one wave that is no sine."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.identify.search.unfinished import wave

SPAN = 3600.0


@pytest.mark.parametrize("multiples", [(1, 2, 4, 5, 7, 11), (1, 3, 5), (3, 5, 7), (2, 3, 4)])
def test_multiples_are_one_wave(multiples: tuple[int, ...]) -> None:
    # Off by a tenth of a wave in the whole time: a tone of some ten standard deviations.
    found = 37.3 / SPAN * np.array(multiples) + 0.1 / SPAN * np.resize([1, -1], len(multiples))
    assert wave(found, SPAN) == pytest.approx(37.3 / SPAN, rel=0.01)


@pytest.mark.parametrize("found", [(1.0, 2.0), (1.0, 2.13, 3.32), (1.0, 1.41, 4.0)])
def test_two_tones_or_unrelated_ones_are_none(found: tuple[float, ...]) -> None:
    assert wave(np.array(found) * 37.3 / SPAN, SPAN) is None


def test_tones_at_random_seldom_are() -> None:
    # Of 2000 triples 12 or 13 are by chance; 30 or more would come in one of 10 000 such tests.
    draws = np.random.default_rng(7).uniform(15.0, 500.0, (2000, 3)) / SPAN
    assert sum(wave(row, SPAN) is not None for row in draws) < 30
