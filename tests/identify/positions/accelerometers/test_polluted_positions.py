"""Attitudes that are off by far point somewhere all the same: they are no evidence, and good ones are."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.units import STANDARD_GRAVITY
from insenv.effects.catalogue import by_key
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.accelerometers.outliers import outliers
from insenv.identify.positions.model import Surroundings, triad_term
from insenv.identify.positions.search import search

ALPHA = 0.01
DECLARED = [triad_term(by_key(key)) for key in ("accel_bias", "accel_scale_factor")]
TRIED = [triad_term(by_key(key)) for key in ("bias_drift", "non_orthogonality")]
#: Attitudes, of which the last two fifths are held out, and the noise of one [m/s^2].
COUNT, NOISE = 240, 0.09


def names(seed: int, polluted: int, drift: float = 0.0) -> list[str]:
    """What is found in attitudes a second apart, the last ``polluted`` of them 12 to 25 m/s^2 off one way."""
    rng = np.random.default_rng(seed)
    up = rng.standard_normal((COUNT, 3))
    time = np.arange(COUNT, dtype=float)
    bias = np.array([-0.3, 0.2, -0.4]) + drift * np.outer(time, [1.0, 0.0, 0.0])
    measured = STANDARD_GRAVITY * up / np.linalg.norm(up, axis=1)[:, None] + bias
    measured += NOISE * rng.standard_normal((COUNT, 3))
    measured[COUNT - polluted :] += rng.uniform(12.0, 25.0, (polluted, 1)) * np.array([0.1, 0.9, 0.4])
    fitted = time < 0.6 * COUNT
    gravity = np.full(COUNT, STANDARD_GRAVITY)
    problem = Magnitudes(measured, gravity, Surroundings(time), fitted, ~fitted)
    return [step.term.effect.key for step in search(problem, DECLARED, TRIED, ALPHA).steps]


@pytest.mark.parametrize("polluted", [0, 5, 9])
def test_polluted_attitudes_are_no_evidence(polluted: int) -> None:
    # One of ten alike is a false alarm by chance once in ten (alpha each), three of ten once in 9000.
    assert sum(bool(names(seed, polluted)) for seed in range(10)) <= 2


def test_good_attitudes_are_evidence_beside_polluted_ones() -> None:
    # Six standard deviations of the fitted attitudes; with the polluted ones two of five were refused.
    found = [names(seed, 9, drift=2e-3) for seed in range(5)]
    assert all(each == ["bias_drift"] for each in found)


@pytest.mark.parametrize("seed", (0, 1, 7))
@pytest.mark.parametrize("off", [(), (7,), (3, 12)])
def test_rests_that_fit_no_triad_are_left_out_though_they_hide_each_other(seed: int, off: tuple[int, ...]) -> None:
    """Of 26 rests some miss gravity by a third of it; one of 5000 sound ones is left out by chance."""
    rng = np.random.default_rng(seed)
    up = rng.standard_normal((26, 3))
    measured = STANDARD_GRAVITY * up / np.linalg.norm(up, axis=1)[:, None] + 0.1 * rng.standard_normal(3)
    measured += 0.01 * rng.standard_normal((26, 3))
    measured[list(off)] *= 0.65
    every = np.ones(26, dtype=bool)
    problem = Magnitudes(measured, np.full(26, STANDARD_GRAVITY), Surroundings(np.arange(26.0)), every, every)
    assert np.flatnonzero(outliers(problem, [*DECLARED, *TRIED])).tolist() == list(off)


@pytest.mark.filterwarnings("error")
def test_a_rest_beside_which_nothing_is_left_is_no_overflow() -> None:
    """A rest in cm/s^2 among rests in m/s^2."""
    rng = np.random.default_rng(3)
    up = rng.standard_normal((26, 3))
    measured = STANDARD_GRAVITY * up / np.linalg.norm(up, axis=1)[:, None]
    measured[5] *= 100
    every = np.ones(26, dtype=bool)
    problem = Magnitudes(measured, np.full(26, STANDARD_GRAVITY), Surroundings(np.arange(26.0)), every, every)
    assert outliers(problem, [*DECLARED, *TRIED])[5]
