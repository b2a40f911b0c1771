"""Rests that miss gravity by more than a sound accelerometer does from rest to rest."""

import numpy as np

from insenv.core.units import STANDARD_GRAVITY
from insenv.effects.triad import AccelBias
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.checks.bent import not_repeated
from insenv.identify.positions.least_squares import solve
from insenv.identify.positions.model import Surroundings, triad_term


def said(
    scatter: float, few: bool = False, doubted: bool = False, noise: float = 1e-3, stated: float | None = None
) -> tuple[str, ...]:
    """Of 18 rests in drawn attitudes that scatter so much [m/s^2], each mean known to ``noise``."""
    rng = np.random.default_rng(5)
    unit = rng.standard_normal((18, 3))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    measured, every = STANDARD_GRAVITY * unit + scatter * rng.standard_normal((18, 3)), np.ones(18, bool)
    problem = Magnitudes(measured, np.full(18, STANDARD_GRAVITY), Surroundings(np.arange(18.0)), every, every)
    fit = solve(problem, [triad_term(AccelBias())])
    return not_repeated(problem, fit, np.arange(18), noise, few, doubted, stated)


def test_rests_that_miss_gravity_by_far_are_a_doubt_though_nothing_is_significant() -> None:
    """A drift of 0.35 m/s^2 in 18 rests left 0.12 m/s^2, was not significant, and nothing was said of it.

    The bound is half as much again as five deviations of a mean, 7.5 mm/s^2; a fourth of it comes near it in less than
    1 of 1e9 draws (chi-square of 15 degrees).
    """
    for scatter in (0.2, 0.015):
        (doubt,) = said(scatter)
        assert doubt.startswith("rests leave") and "would explain" not in doubt
    assert said(2e-3) == said(0.2, doubted=True) == ()


def test_few_rests_say_what_would_tell() -> None:
    """From 5 mm/s^2 on, five times what the mean of a rest is known to."""
    (doubt,) = said(0.03, few=True)
    assert "more attitudes would tell" in doubt
    assert said(1e-3, few=True) == ()


def test_rests_that_scatter_more_than_was_stated_are_a_doubt() -> None:
    """Nothing was said of 20 mm/s^2 of a step halfway, where 0.2 mm/s^2 were stated; false alarm 1e-3 at 1.5 times."""
    (doubt,) = said(4e-3, noise=7e-4, stated=2e-4)
    assert "0.2 mm/s^2 from rest to rest, as stated" in doubt
    assert said(7e-4, noise=7e-4, stated=2e-4) == said(4e-3, noise=7e-4) == ()
