"""The whole search as one statistic, and its error by signs. One design of 300 readings of a table, seeded."""

from dataclasses import replace

import numpy as np
import pytest
from studies.whole_error import design, noise, with_noise

from insenv.identify.findings import BY_SIGNS, WholeError
from insenv.identify.fit.evidence import HELD_OUT_SPREAD, held_out_deviate, log_tail
from insenv.identify.fit.gls import solve, whitened
from insenv.identify.fit.problem import Problem
from insenv.identify.search.doubts.unfinished import unfinished
from insenv.identify.search.round import by_fit_alone, with_term
from insenv.identify.search.scan import reference, score
from insenv.identify.search.settle import dropped
from insenv.identify.search.tracks import Step, Track
from insenv.identify.search.whole.directions import to_modes, to_series
from insenv.identify.search.whole.error import Residual, agree, by_chance, of_chance, whole_errors

#: Nulls and draws. The mean of 24 uniform p is off by 4 standard deviations of 0.059 in 6 of 100,000 seeds; 4 or more
#: of 24 are at most 0.01 in 9 of 100,000.
NULLS, DRAWS = 24, 99


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> Track:
    track = design(tmp_path_factory.mktemp("whole"), 1, 3)
    return with_noise(track, noise(0, 3, track.problem.bins.n))


def of_data(given: Residual) -> tuple[np.ndarray, np.ndarray]:
    """The residual itself as modes, as the directions look at it."""
    w = to_modes(given.whole.fitted, given.series[:, None].astype(np.float32))
    return w, to_modes(given.whole.held, given.held[:, None].astype(np.float32))


def test_directions_give_the_scores_of_the_scan(quiet: Track) -> None:
    given = Residual.of(quiet)
    weight, q, white = whitened(quiet.problem, quiet.fit)
    w = white[:, None].astype(np.float32)
    scanned = score(quiet.problem, quiet.fit, quiet.candidates, 0)
    wanted = {c.effect.key: s.q.max() for c, s in zip(quiet.candidates, scanned, strict=True) if s.testable}
    assert {one.key for one in given.whole.candidates} == wanted.keys()
    for one in given.whole.candidates:
        assert float(one.best(w)[0][0]) == pytest.approx(wanted[one.key], rel=1e-3, abs=1e-4), one.key


def test_directions_in_held_out_data_give_the_deviate_of_the_search(quiet: Track) -> None:
    given, problem = Residual.of(quiet), quiet.problem
    w, v = of_data(given)
    scale = float(np.sqrt(np.mean(to_series(given.whole.held, v) ** 2)))
    assert scale == pytest.approx(1.0, abs=1e-5)
    single = {c.effect.key: c.terms[0] for c in quiet.candidates if len(c.terms) == 1 and len(c.effect.linear) == 1}
    found: list[tuple[float, float]] = []
    for one in given.whole.candidates:
        if one.key in single and len(one.fitted) == 1:
            z, _ = one.held_out(*one.best(w)[1:], v)
            large = solve(problem, with_term(quiet.fit.model, single[one.key]), start=quiet.fit.noise.power)
            wanted, _ = held_out_deviate(problem, quiet.fit, large, 1e9)
            found.append((float(z[0]), wanted * HELD_OUT_SPREAD))
    z, wanted = np.array(found).T
    assert len(z) >= 5
    # The residual of the directions is scaled to unit variance, and the larger model fits its noise anew.
    assert np.corrcoef(z, wanted)[0, 1] > 0.98 and np.abs(z - wanted).max() < 0.5


def test_p_by_signs_is_uniform_where_nothing_is_to_be_found(quiet: Track) -> None:
    ps = []
    for k in range(NULLS):
        track = with_noise(quiet, noise(k, 5, quiet.problem.bins.n))
        given = Residual.of(track)
        searches = given.chance(k, DRAWS)
        told = given.whole.deviates(*of_data(given), np.random.default_rng(k))
        own = min(log_tail(float(z[0])) + np.log(searches.looks[key]) for key, (z, _) in told.items())
        ps.append((1 + np.sum(searches.least <= own)) / (DRAWS + 1))
    assert np.mean(ps) == pytest.approx(0.5, abs=4 * 0.059)
    assert np.sum(np.array(ps) <= 0.01) < 4


def test_a_drift_that_is_there_is_beyond_all_signs(quiet: Track) -> None:
    problem: Problem = quiet.problem
    term = next(c.terms[0] for c in quiet.candidates if c.effect.key == "scale_factor_asymmetry")
    column = problem.columns(term)[:, 0]
    track = with_noise(quiet, problem.y + column * 15e-6 / np.linalg.norm(column))
    (found,) = [c for c in track.candidates if c.terms[0] == term]
    base = reference(track.problem, track.fit.model, track.fit.noise.power)
    hit = by_fit_alone(track.problem, track.fit, base, (found,), 0, track.family, False)[0]
    fit = solve(track.problem, with_term(track.fit.model, hit.term))
    grown = replace(track, fit=fit, steps=(Step(hit, track.score, track.score, hit.p_value),))
    (error,) = (one() for one in whole_errors(grown, 0))
    assert error is not None and error.least and error.agrees and error.p == 1 / (error.draws + 1)
    together = replace(grown, steps=(replace(grown.steps[0], together=("gyro_x", "gyro_y")),))
    assert [one() for one in whole_errors(together, 0)] == [None]
    assert of_chance(grown, whole_errors(grown, 0), 0.01) == of_chance(together, [lambda: None], 0.01) == ()
    (reason,) = of_chance(grown, [lambda: WholeError(0.2, 999, False)], 0.01)
    assert BY_SIGNS in reason and reason.startswith("scale_factor_asymmetry")
    # What noise gives in a fifth of draws has no name, unless it is certain otherwise, or held-out data gain by it.
    often, few = [lambda: WholeError(0.2, 999, False)], [lambda: WholeError(0.04, 999, False)]
    step = replace(grown.steps[0], p_value=0.004)
    doubtful = replace(grown, steps=(step,))
    gone = by_chance(doubtful, often)
    assert gone is not None and gone[0] is step and BY_SIGNS in gone[1]
    assert by_chance(doubtful, few) is None
    assert by_chance(replace(grown, steps=(replace(step, p_value=1e-9),)), often) is None
    gains = replace(step, after=replace(step.after, rms=0.98 * step.before.rms))
    assert by_chance(replace(grown, steps=(gains,)), often) is None
    assert any(BY_SIGNS in reason for reason in unfinished(dropped(doubtful, *gone), 0.01))
    # What so few draws can say at least is no doubt, however little is allowed.
    assert of_chance(grown, [lambda: WholeError(0.001, 999, True)], 1e-4) == ()


def test_the_same_seed_gives_the_same_chance(quiet: Track) -> None:
    given = Residual.of(quiet)
    one, same, other = (given.chance(seed, DRAWS) for seed in (1, 1, 2))
    assert np.array_equal(one.least, same.least) and not np.array_equal(one.least, other.least)


def test_p_values_disagree_where_chance_has_more_than_they_let_expect() -> None:
    assert agree(0, 999, 1e-9) and agree(9, 999, 0.009) and agree(0, 999, 0.009)
    assert not agree(5, 999, 1e-9) and not agree(40, 999, 0.009)
    assert WholeError(0.001, 999, True).least and not WholeError(0.002, 999, True).least
