"""One round of the search on one target: what is tried, how it is ranked, how surely."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, f
from simulated_runs import declared_for, gyro_run, manifest, shaped, use, with_effects

from insenv.core.recording import Channel, Recording
from insenv.effects.base import CurveEffect
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.candidates import Candidate, candidates
from insenv.identify.search.rivals import rivalry
from insenv.identify.search.round import search
from insenv.identify.search.scan import MOST_SHARED, _noise, likelihood_ratio, log_significance, reference, score

DURATION = 1200.0


def begun(recording: Recording) -> tuple[Problem, Model, Fit, tuple[Candidate, ...]]:
    """Problem, declared model, its fit, and the candidates beside it."""
    asked = manifest(declared=declared_for(recording))
    prepared = prepare(asked, (recording,), (use(len(recording)),), "gyro")
    declared = {term.effect.key for term in prepared.model}
    found, _ = candidates(prepared.problem, CATALOGUE)
    tried = tuple(c for c in found if c.effect.key not in declared and not c.generic)
    return prepared.problem, prepared.model, solve(prepared.problem, prepared.model), tried


def reading(recording: Recording, values: np.ndarray) -> Recording:
    """The recording with other readings of its gyro."""
    channel = replace(recording.channels["gyro"], values=values)
    return replace(recording, channels={**recording.channels, "gyro": channel})


@pytest.mark.parametrize(
    ("kind", "key", "theta"),
    [
        ("sine", "scale_factor_cubic", (1.0,)),
        ("staircase", "encoder_harmonic:2", (1.0, 0.3)),
        ("rest", "bias_step", (1.0, 400.0)),
        ("rest", "tone", (1.0, 0.3, 0.2131)),
    ],
)
def test_hits_come_in_order_and_the_injected_effect_leads(kind: str, key: str, theta: tuple[float, ...]) -> None:
    run, ((_, true),) = with_effects(kind, 31, ((key, shaped(key, theta)),), snr=20, duration=DURATION)
    problem, _, fit, tried = begun(run.recording)
    hits = search(problem, fit, tried, seed=0, family=len(tried) + 1)
    assert hits[0].candidate.effect.key == key
    assert [hit.rank for hit in hits] == sorted((hit.rank for hit in hits), reverse=True)
    assert all(0 <= hit.p_value <= 1 for hit in hits)
    assert hits[0].p_value < 1e-5
    assert len({hit.candidate.effect.key for hit in hits}) == len(hits)
    if len(theta) > 1 and key != "encoder_harmonic:2":
        assert hits[0].term.shape[-1] == pytest.approx(true[-1], rel=0.01)


def test_the_shape_is_refined_off_the_grid() -> None:
    """The likelihood ratio of the refined shape is no smaller than that of any shape on the grid."""
    theta = shaped("scale_factor_anomaly", (1.0, 0.21, 0.03))
    run, _ = with_effects("sine", 32, (("scale_factor_anomaly", theta),), snr=25, duration=DURATION)
    problem, model, fit, tried = begun(run.recording)
    candidate = next(c for c in tried if c.effect.key == "scale_factor_anomaly")
    (hit,) = (h for h in search(problem, fit, (candidate,), 0, 2) if h.candidate is candidate)
    base = reference(problem, model, fit.noise.power)
    on_grid = [likelihood_ratio(problem, base, (*model, term))[0] for term in candidate.terms]
    assert hit.term not in candidate.terms
    assert hit.likelihood_ratio > max(on_grid) - 0.05
    assert hit.term.shape[0] == pytest.approx(0.21, abs=0.02)


def test_a_likelihood_ratio_is_twice_the_difference_of_two_fits() -> None:
    run, _ = with_effects("sine", 33, (("scale_factor_cubic", np.array([1.0])),), snr=15, duration=DURATION)
    problem, model, fit, _ = begun(run.recording)
    larger = (*model, Term(by_key("scale_factor_cubic")))
    base = reference(problem, model, fit.noise.power)
    ratio, gained = likelihood_ratio(problem, base, larger)
    assert gained == 1
    assert ratio == pytest.approx(2 * (reference(problem, larger).noise.loglik - base.noise.loglik), abs=0.05)
    unchanged, gained = likelihood_ratio(problem, base, model)
    assert abs(unchanged) < 0.05 and gained == 0
    # A column that the model has already gains nothing.
    assert likelihood_ratio(problem, base, (*model, Term(by_key("bias"))))[1] == 0


def test_scores_on_white_noise_are_chi_square() -> None:
    """Median over 200 runs of simulated noise, at one shape: that of one degree of freedom is 0.455.

    The standard deviation of such a median is 0.08: five of them, false alarm 6e-7 for each of the effects.
    """
    problem, _, fit, tried = begun(gyro_run("sine", 34, duration=DURATION).recording)
    alone = tuple(c for c in tried if len(c.terms) == 1)
    assert len(alone) >= 8
    for scores in score(problem, fit, alone, seed=0):
        if scores.testable:
            assert scores.null_median == pytest.approx(chi2.median(scores.rank), abs=0.4 * np.sqrt(scores.rank))
            assert 1 <= scores.trials < 3


def test_more_shapes_are_more_trials() -> None:
    problem, _, fit, tried = begun(gyro_run("rest", 35, duration=DURATION).recording)
    trials = {c.effect.key: s.trials for c, s in zip(tried, score(problem, fit, tried, 0), strict=True)}
    assert trials["bias_step"] > 5
    assert trials["bias_warm_up"] < trials["bias_step"]
    for c in tried:
        assert trials[c.effect.key] <= len(c.terms) + 3


def test_significance_is_fishers_and_never_more_than_certain() -> None:
    assert log_significance(20.0, 2, 1e7) == pytest.approx(chi2.logsf(20.0, 2), rel=1e-3)
    # F on 2 and nu degrees of freedom has the tail (1 + 2 F / nu)^(-nu / 2), and the ratio grows with its logarithm.
    assert log_significance(20.0, 2, 10.0) == pytest.approx(-5 * 20 / 13)
    assert f.logsf(10.0, 2, 10.0) > log_significance(20.0, 2, 10.0) > chi2.logsf(20.0, 2)
    assert log_significance(20.0, 2, 10.0) > log_significance(20.0, 2, 100.0)
    assert log_significance(-1.0, 2, 10.0) == log_significance(5.0, 0, 10.0) == 0.0
    assert np.isfinite(log_significance(1e6, 3, 1e6))


@pytest.mark.parametrize("kind", ["constant", "sine", "rest"])
def test_candidates_are_those_with_channels_and_shapes(kind: str) -> None:
    problem, _, _, _ = begun(gyro_run(kind, 36, duration=DURATION).recording)
    found, blind = candidates(problem, CATALOGUE)
    keys, lacking = {c.effect.key for c in found}, {b.effect for b in blind}
    assert not keys & lacking
    assert "base_tilt" not in keys | lacking  # not an accelerometer
    assert ("encoder_harmonic:1" in keys) == (kind != "rest")
    assert ("bias_temperature:1") in keys
    for c in found:
        if isinstance(c.effect, CurveEffect):
            assert all(len(term.shape) == len(c.effect.shapes) for term in c.terms)


def test_one_curve_under_two_names_is_a_rivalry_and_an_unlike_one_is_not() -> None:
    """At a single rate eccentricity is a rate locked to the angle."""
    key = "encoder_harmonic:1"
    run, _ = with_effects("constant", 37, ((key, np.array([1.0, 0.4])),), snr=25, duration=DURATION)
    problem, model, fit, tried = begun(run.recording)
    hits = search(problem, fit, tried, 0, len(tried) + 1)
    rivals = rivalry(problem, model, Term(by_key(key)), hits, 0.01).rivals
    assert "angle_locked_rate:1" in rivals
    assert key not in rivals
    assert not {"bias_drift", "bias_temperature:1", "encoder_harmonic:2"} & set(rivals)


@pytest.mark.parametrize("size", [0.2, 0.5])
def test_an_effect_beyond_its_bound_is_not_credible(size: float) -> None:
    """An encoder that is wrong by that many radians is broken, not eccentric: the bound is a tenth."""
    run = gyro_run("reversal", 38, (("encoder_harmonic:1", np.array([size, 0.0])),), duration=DURATION)
    problem, _, fit, tried = begun(run.recording)
    alone = tuple(c for c in tried if c.effect.key == "encoder_harmonic:1")
    hit = next(
        h for h in search(problem, fit, alone, 0, len(alone) + 1) if h.candidate.effect.key == "encoder_harmonic:1"
    )
    assert hit.p_value == 1.0


@pytest.mark.parametrize(("duration", "credible"), [(60.0, True), (1200.0, False)])
def test_a_drift_of_the_scale_factor_is_credible_by_what_it_comes_to(duration: float, credible: bool) -> None:
    """6 % of the scale in a minute may be; more than all of it in twenty may not."""
    drift = (("scale_factor_drift", np.array([1e-3])),)
    run = gyro_run("sine", 38, drift, duration=duration, noise={"angle_random_walk": 1e-5})
    problem, _, fit, tried = begun(run.recording)
    alone = tuple(c for c in tried if c.effect.key == "scale_factor_drift")
    hits = search(problem, fit, alone, 0, len(alone) + 1)
    hit = next(h for h in hits if h.candidate.effect.key == "scale_factor_drift")
    assert (hit.p_value < 1e-6) == credible


def test_what_would_not_stand_out_at_its_largest_is_not_what_is_found() -> None:
    """An eccentricity of 0.18 rad known to 0.05: none that is credible, to 0.1, would be seen beside this noise."""
    run = gyro_run("reversal", 38, (("encoder_harmonic:1", np.array([0.18, 0.0])),), duration=DURATION)
    gyro = run.recording.channels["gyro"].values
    loud = gyro + 1.0 * np.random.default_rng(3).standard_normal(len(gyro))
    problem, _, fit, tried = begun(reading(run.recording, loud))
    alone = tuple(c for c in tried if c.effect.key == "encoder_harmonic:1")
    hit = next(
        h for h in search(problem, fit, alone, 0, len(alone) + 1) if h.candidate.effect.key == "encoder_harmonic:1"
    )
    assert (hit.p_value, "would not stand out" in hit.remark) == (1.0, True)


def test_an_effect_within_its_bound_is_named_however_strong() -> None:
    """A hundred standard deviations of the prior, thousands of the estimate."""
    run = gyro_run("reversal", 38, (("encoder_harmonic:1", np.array([0.099, 0.0])),), duration=DURATION)
    problem, _, fit, tried = begun(run.recording)
    hits = search(problem, fit, tried, 0, len(tried) + 1)
    assert hits[0].candidate.effect.key == "encoder_harmonic:1"


@pytest.mark.parametrize(("sweep", "told"), [(20.0, (4,)), (45.0, (2, 3, 4)), (360.0, (1, 2, 3, 4))])
def test_a_wave_of_the_angle_is_tried_on_a_quarter_of_it(sweep: float, told: tuple[int, ...]) -> None:
    """On less it is a gain: of a shaft that swings by 18 deg a fourth harmonic took 2 % of the scale factor."""
    t = 0.1 * np.arange(1.0, 3001)
    angle = 0.5 * np.deg2rad(1.2 * sweep) * np.sin(2 * np.pi * t / 20)
    gyro = np.gradient(angle, 0.1) + 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    one = Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(angle, "rad")})
    problem = prepare(manifest(), (one,), (use(len(t)),), "gyro", holds=False, tones=False).problem
    found, _ = candidates(problem, tuple(by_key(f"encoder_harmonic:{order}") for order in (1, 2, 3, 4)))
    assert tuple(int(c.effect.key[-1]) for c in found) == told


def test_the_noise_of_a_problem_is_what_its_seed_draws_however_many_modes_others_have() -> None:
    few, many = 300, MOST_SHARED + 5
    for modes in (few, many, few):
        drawn = np.random.Generator(np.random.SFC64(3)).standard_normal((modes, 200))
        np.testing.assert_array_equal(_noise(3, modes), drawn)
    assert np.shares_memory(_noise(3, few), _noise(3, few + 1))
