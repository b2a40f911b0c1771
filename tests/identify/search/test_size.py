"""An effect whose coefficients could be anything is not named, whichever effect of the catalogue it is.

Generated with NumPy; seeds are fixed. Of noise alone 1 effect in 80 is further than 2.5 standard deviations from zero.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, norm
from scipy.stats import t as student
from simulated_runs import FITTED, closed, gyro_run, manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.effects.angle import AngleLockedRate
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.effects.rate.threshold import DeadBand
from insenv.effects.tone import Tone
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.uncertainty import coefficients_of, estimates
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.candidates import candidates
from insenv.identify.search.size import LEAST, as_normal, deviate, unsized

WHITE = 1e-5


@pytest.mark.parametrize(("z", "freedom"), [(4.2, 9.0), (1.0, 4.0), (3.0, 1e6)])
def test_a_size_that_few_swings_tell_is_as_rare_as_students_t(z: float, freedom: float) -> None:
    assert norm.sf(as_normal(z, freedom)) == pytest.approx(student.sf(z, freedom), rel=1e-9)
    assert as_normal(z, np.inf) == z


@pytest.fixture(scope="module")
def problem() -> Problem:
    """Bins of a gyro that swings in a room whose temperature changes."""
    run = gyro_run("sine", 7, duration=900.0, noise={"angle_random_walk": WHITE})
    return prepare(manifest(), (run.recording,), (use(len(run.recording), FITTED),), "gyro", holds=False).problem


def terms(problem: Problem) -> list[Term]:
    """Every effect that the recording can show, at the middle one of its shapes."""
    found, _ = candidates(problem, CATALOGUE)
    ours = ("bias", "scale_factor", "earth_rate")  # in the model, or bounded by the Earth itself
    others = [c for c in found if not c.generic and c.effect.id not in ours]
    named = [c.terms[len(c.terms) // 2] for c in others]
    return [*named, Term(Tone(), (0.03,))]


def with_size(problem: Problem, term: Term, size: float) -> Problem:
    """The bins with white noise, and an effect whose coefficients are so many standard deviations together."""
    rng = np.random.default_rng(3)
    y: Floats = WHITE * rng.standard_normal(problem.bins.n) / np.sqrt(problem.bins.width)
    bare = replace(problem, y=y, cache={})
    model = (Term(by_key("bias")), Term(by_key("scale_factor")), term)
    fit = solve(bare, model)
    theta, cov = coefficients_of(bare, fit, term)
    root = np.linalg.cholesky(cov)
    aim = size * root @ np.full(len(theta), 1 / np.sqrt(len(theta)))
    columns = (fit.design.matrix * fit.design.scale)[:, fit.design.term == 2]
    return replace(problem, y=y + columns @ (aim - theta), cache={})


def said(problem: Problem, term: Term) -> str:
    model = (Term(by_key("bias")), Term(by_key("scale_factor")), term)
    return unsized(problem, solve(problem, model), term)


def test_every_effect_of_the_catalogue_has_a_size_or_no_name(problem: Problem) -> None:
    seen = terms(problem)
    assert len(seen) > 15
    for term in seen:
        assert "its size is not told" in said(with_size(problem, term, 1.0), term), term.effect.key
        assert said(with_size(problem, term, 12.0), term) == "", term.effect.key


def test_a_drift_of_the_scale_factor_has_a_size_though_its_shape_is_right_only_nearly(problem: Problem) -> None:
    """A smooth discrepancy in time could be all of it: that is no reason against a drift."""
    drift = Term(by_key("scale_factor_drift"))
    strong = with_size(problem, drift, 15.0)
    rng = np.random.default_rng(4)
    slow = 4e-8 * np.cumsum(rng.standard_normal(problem.bins.n)) * problem.bins.width**0.5
    bent = replace(strong, y=strong.y + slow * problem.bins.mean(tuple(e.u for e in problem.exposures)), cache={})
    model = (Term(by_key("bias")), Term(by_key("scale_factor")), drift)
    assert unsized(bent, solve(bent, model), drift, (drift,)) == ""


def test_a_gain_that_follows_the_temperature_has_a_size_though_it_bends(problem: Problem) -> None:
    """Beside a late reference too: what the temperature does to a gain is told, whichever curve of it that is."""
    thermal = Term(by_key("scale_factor_temperature"))
    late = tuple(replace(e, motion=replace(e.motion, lag=0.05)) for e in problem.exposures)
    strong = replace(with_size(problem, thermal, 25.0), exposures=late, cache={})
    kelvins = [np.convolve(k, [0.5, 0.5], "valid") for e in late if (k := e.motion.temperature) is not None]
    waves = tuple(2e-4 * e.u * np.sin(2 * np.pi * k / np.ptp(k)) for e, k in zip(late, kelvins, strict=True))
    bent = replace(strong, y=strong.y + problem.bins.mean(waves), cache={})
    fit = solve(bent, (Term(by_key("bias")), Term(by_key("scale_factor")), thermal))
    (row,) = estimates(bent, fit, (thermal,))[thermal]
    assert abs(row.value) < LEAST * row.sd  # the straight line of it is less certain than the name
    assert unsized(bent, fit, thermal, (thermal,)) == ""


def test_an_exponential_slower_than_the_record_is_a_slope_and_no_size(problem: Problem) -> None:
    slow, slope = Term(by_key("bias_warm_up"), (3000.0,)), Term(by_key("bias_drift"))
    drifting = with_size(problem, slope, 30.0)
    assert "its size is not told" in said(drifting, slow)
    assert said(drifting, slope) == ""


def test_what_is_less_certain_than_credible_is_no_size(problem: Problem) -> None:
    """A drift of hundreds of times what is credible, four deviations from nothing."""
    drift = Term(by_key("bias_drift"))
    noisy = replace(problem, y=1e3 * np.random.default_rng(1).standard_normal(problem.bins.n), cache={})
    fit = solve(noisy, (Term(by_key("bias")), drift))
    theta, cov = coefficients_of(noisy, fit, drift)
    assert np.sqrt(cov[0, 0]) > noisy.limits(drift.effect.linear[0])[1]
    assert "its size is not told" in unsized(noisy, fit, drift)


def test_the_deviate_is_that_of_all_coefficients_together() -> None:
    cov = np.array([[4.0, 1.0], [1.0, 9.0]])
    theta = np.linalg.cholesky(cov) @ np.array([3.0, 4.0])
    assert deviate(theta, cov) == pytest.approx(norm.isf(chi2.sf(25.0, 2) / 2))
    assert deviate(theta[:1], cov[:1, :1]) == pytest.approx(abs(theta[0]) / 2.0)
    # Units do not matter, and what is far beyond any table is still far.
    units = np.diag([1e-9, 1e6])
    assert deviate(units @ theta, units @ cov @ units) == pytest.approx(deviate(theta, cov))
    assert deviate(1e3 * theta, cov) > 1e3 > LEAST


@pytest.mark.parametrize(("wider", "named"), [(1.0, True), (20.0, False)])
def test_a_curve_of_which_no_shape_is_told_is_any_curve(problem: Problem, wider: float, named: bool) -> None:
    """A ripple over twenty times the range of the rates bends once in it, as what a filter of the reference leaves."""
    (ripple,) = (term for term in terms(problem) if term.effect.id == "compensation_ripple")
    ripple = replace(ripple, shape=(ripple.shape[0], wider * ripple.shape[1]))
    sized = with_size(problem, ripple, 6.0)
    model = (Term(by_key("bias")), Term(by_key("scale_factor")), Term(by_key("timing_skew")), ripple)
    why = unsized(sized, solve(sized, model), ripple)
    assert (why == "") is named
    assert named or "is not told beside a reference that is late" in why


@pytest.mark.parametrize(("share", "named"), [(0.1, True), (0.002, False)])
def test_a_hysteresis_of_any_radius_is_what_a_lag_leaves(problem: Problem, share: float, named: bool) -> None:
    """Of a radius next to nothing only which way the rate changes is told."""
    largest = max(float(np.abs(e.u).max()) for e in problem.exposures)
    loop = Term(by_key("scale_factor_hysteresis"), (share * largest,))
    sized = with_size(problem, loop, 12.0)
    model = (Term(by_key("bias")), Term(by_key("scale_factor")), Term(by_key("timing_skew")), loop)
    why = unsized(sized, solve(sized, model), loop)
    assert (why == "") is named
    assert named or "its shape is not told beside a reference that is late: r = " in why


def test_a_curve_of_the_rate_is_as_uncertain_as_the_report_says(problem: Problem) -> None:
    """Where the rate bends what is left by another curve, a cubic that the report calls nothing has no name."""
    cubic = Term(by_key("scale_factor_cubic"))
    rates = tuple(e.u / np.abs(e.u).max() for e in problem.exposures)
    bent = with_size(problem, cubic, 25.0)
    wave = 60 * WHITE * problem.bins.mean(tuple(np.sin(9 * rate) for rate in rates))
    bent = replace(bent, y=bent.y + wave, cache={})
    fit = solve(bent, (Term(by_key("bias")), Term(by_key("scale_factor")), cubic))
    (row,) = estimates(bent, fit, (cubic,))[cubic]
    assert abs(row.value) < LEAST * row.sd
    assert unsized(bent, fit, cubic) == ""  # by noise alone it has one
    assert "its size is not told" in unsized(bent, fit, cubic, (cubic,))


def test_a_gain_is_the_line_through_any_curve_beside_a_late_reference_too(problem: Problem) -> None:
    """A curve of the rate that nobody foretells does not make the line through it any less certain."""
    gain, bias = Term(by_key("scale_factor")), Term(by_key("bias"))
    late = tuple(replace(e, motion=replace(e.motion, lag=0.05)) for e in problem.exposures)
    rates = tuple(e.u / np.abs(e.u).max() for e in late)
    y = problem.bins.mean(tuple(1e-2 * e.u + 60 * WHITE * np.sin(9 * x) for e, x in zip(late, rates, strict=True)))
    noise = WHITE * np.random.default_rng(5).standard_normal(problem.bins.n) / np.sqrt(problem.bins.width)
    bent = replace(problem, y=y + noise, exposures=late, cache={})
    fit = solve(bent, (bias, gain))
    theta, cov = coefficients_of(bent, fit, gain, (gain,))
    assert abs(theta[0] - 1e-2) < 1e-3
    assert cov == pytest.approx(coefficients_of(bent, fit, gain)[1])
    assert unsized(bent, fit, gain, (gain,)) == ""


def test_beside_a_late_reference_less_than_a_wave_of_the_angle_is_no_wave(problem: Problem) -> None:
    """A table that swings over 72 deg has half of a wave of order 2, and a whole one of order 5 alone."""
    (run,) = problem.exposures
    assert run.motion.angle is not None
    narrow = np.deg2rad(72) * run.motion.angle / np.ptp(run.motion.angle)
    for lag, seen in ((0.0, True), (0.02, False)):
        late = replace(run, motion=replace(run.motion, angle=narrow, lag=lag))
        found, _ = candidates(replace(problem, exposures=(late,), cache={}), (AngleLockedRate(2),))
        assert bool(found) is seen


def test_held_out_data_tell_the_size_of_what_has_no_shape(problem: Problem) -> None:
    drift, warm_up = Term(by_key("bias_drift")), Term(by_key("bias_warm_up"), (200.0,))
    for term, told in ((drift, True), (warm_up, False)):
        small = replace(with_size(problem, term, 1.0), commanded=True)
        fit = solve(small, (Term(by_key("bias")), Term(by_key("scale_factor")), term))
        assert unsized(small, fit, term)
        assert unsized(replace(small, commanded=False), fit, term, held_out=4.0)
        assert (unsized(small, fit, term, held_out=4.0) == "") is told
        assert unsized(small, fit, term, held_out=-4.0)
        nothing = replace(with_size(problem, term, 0.25), commanded=True)
        fit = solve(nothing, (Term(by_key("bias")), Term(by_key("scale_factor")), term))
        assert unsized(nothing, fit, term, held_out=9.0)


@pytest.mark.parametrize("key", ["scale_factor_warm_up", "scale_factor_drift"])
def test_a_gain_that_changes_is_told_beside_a_constant_one(problem: Problem, key: str) -> None:
    """A constant gain that nobody declared is the mean of one that settles slowly, or drifts."""
    rng = np.random.default_rng(5)
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    noise = WHITE * rng.standard_normal(problem.bins.n) / np.sqrt(problem.bins.width)
    shape = (600.0,) if key == "scale_factor_warm_up" else ()
    changes = Term(by_key(key), shape)
    model = (Term(by_key("bias")), changes)
    constant = replace(problem, y=noise - 0.01 * u, cache={})
    assert "not told beside a constant gain" in unsized(constant, solve(constant, model), changes)
    settles = replace(problem, y=noise - 0.01 * u * np.exp(-problem.bins.time / 600.0), cache={})
    assert unsized(settles, solve(settles, model), changes) == ""


def test_no_credible_size_pays_for_its_prior(problem: Problem) -> None:
    """An eccentricity of 1.8 deg had ten deviations of a prior, and another wave was named in its place."""
    for term in terms(problem):
        for param, sd in zip(term.effect.linear, problem.priors(term), strict=True):
            assert sd >= problem.limits(param)[1], term.effect.key


def test_a_dead_band_that_jumps_has_a_size(problem: Problem) -> None:
    """Its depth is its threshold, which the jump tells: by the slope below it alone neither is told."""
    u = np.concatenate([e.u for e in problem.exposures])
    d = 0.3 * float(np.abs(u).max())
    term = Term(DeadBand(whole=True), (d,))
    column = problem.columns(term)[:, 0]
    noise = WHITE * np.random.default_rng(5).standard_normal(problem.bins.n) / np.sqrt(problem.bins.width)
    made = replace(problem, y=noise + d * column, cache={})
    fit = solve(made, (Term(by_key("bias")), Term(by_key("scale_factor")), term))
    (c,), ((variance,),) = coefficients_of(made, fit, term)
    assert c == pytest.approx(d, abs=4 * np.sqrt(variance))  # false alarm 6e-5
    assert np.sqrt(variance) < 0.05 * d
    assert not unsized(made, fit, term)


@pytest.mark.parametrize(("share", "is_one"), [(1.0, True), (0.9, True), (0.67, False), (1.5, False)])
def test_what_loses_a_part_of_the_low_rates_is_no_dead_band(share: float, is_one: bool) -> None:
    assert (not DeadBand(whole=True).contradiction(np.array([share * 0.1, 0.1]))) == is_one
    assert not DeadBand().contradiction(np.array([0.05, 0.1]))  # numbers cut off towards zero
    bend = np.array([0.0015, 0.5])
    assert "lose 0.3 % of" in DeadBand().contradiction(bend)
    (d,) = DeadBand().consistent(bend)
    assert not DeadBand().contradiction(np.array([bend[0], d]))


@pytest.mark.parametrize("seed", range(3))
def test_a_dead_band_that_is_named_is_one_by_what_is_told_of_it(seed: int) -> None:
    """Of rates all above the threshold the depth alone is told: with it stood a threshold that contradicts it.

    A depth off by 4 deviations is one of 16 000.
    """
    rng, n = np.random.default_rng(seed), 6000
    rate: Floats = np.repeat(rng.choice([-1.0, 1.0], 60) * rng.uniform(0.25, 1.0, 60), 100)
    gyro: Floats = rate - 0.02 * np.sign(rate) + 3e-3 * rng.standard_normal(n)
    channels = {
        "gyro": Channel(gyro, "rad/s", "interval"),
        "table_rate": Channel(rate, "rad/s", "interval", source="command"),
    }
    run = Recording(0.1 * np.arange(1.0, n + 1), channels, label="run")
    (target,) = closed(run, manifest(), catalogue=(by_key("dead_band"),)).targets
    (found,) = target.added
    c, d = found.parameters
    assert abs(c.value - 0.02) < 4 * c.sd
    assert 0.24 * d.value < c.value and d.sd > d.value  # below the least rate nothing tells the threshold


@pytest.mark.parametrize("reference", ["command", "exact", "noisy"])
def test_beside_a_noisy_reference_a_size_is_no_chance_of_all_curves(problem: Problem, reference: str) -> None:
    """Of 1000 looks the largest is beyond 3.5 deviations in 37 %, beyond 8 in 1e-12."""
    term = Term(by_key("scale_factor_asymmetry"))
    model = (Term(by_key("bias")), Term(by_key("scale_factor")), term)
    rng = np.random.default_rng(3)
    read = tuple(replace(e, u=e.u + 1e-6 * rng.standard_normal(e.u.shape)) for e in problem.exposures)
    for size, told in ((3.5, reference != "noisy"), (8.0, True)):
        own = replace(with_size(problem, term, size), commanded=reference == "command", cache={})
        own = replace(own, exposures=read) if reference == "noisy" else own
        assert bool(unsized(own, solve(own, model), term, looks=1000.0)) is not told


@pytest.mark.parametrize("commanded", [True, False])
@pytest.mark.parametrize(("term", "small"), [(Term(by_key("bias_step"), (400.0,)), 3.5), (Term(Tone(), (0.03,)), 2.4)])
def test_what_a_measured_reference_may_have_itself_is_no_chance_of_all_looks(
    problem: Problem, term: Term, small: float, commanded: bool
) -> None:
    """It jumps and has lines as well: beside a command 3.5 deviations are a size, beside an encoder one of 1000.

    The amplitude of a line whose frequency was fitted is 1.4 times as certain as that of any.
    """
    model = (Term(by_key("bias")), Term(by_key("scale_factor")), term)
    for size, told in ((small, commanded), (8.0, True)):
        own = replace(with_size(problem, term, size), commanded=commanded, cache={})
        assert bool(unsized(own, solve(own, model), term, looks=1000.0)) is not told


@pytest.mark.parametrize("lag", [0.0, 0.02])
def test_beside_a_late_reference_a_wave_of_the_angle_is_no_chance_of_all_looks(problem: Problem, lag: float) -> None:
    """Wheels slip by where a robot heads: 4 deviations of 1000 looks are a wave beside one that is on time."""
    term = Term(AngleLockedRate(2))
    model = (Term(by_key("bias")), Term(by_key("scale_factor")), term)
    late = tuple(replace(e, motion=replace(e.motion, lag=lag)) for e in problem.exposures)
    for size, told in ((4.0, not lag), (8.0, True)):
        own = replace(with_size(problem, term, size), exposures=late, commanded=False, cache={})
        assert bool(unsized(own, solve(own, model), term, looks=1000.0)) is not told
