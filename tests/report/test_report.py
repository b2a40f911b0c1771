"""Reports as text: what was found, in words."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from html_text import Page, as_read
from made_findings import (
    EVERY,
    confounded,
    empty_covariates,
    findings,
    gyro,
    nothing_significant,
    one_target,
    several_targets,
    shown,
)

from insenv.effects.catalogue import ALL
from insenv.effects.own import RESERVED
from insenv.identify.findings import (
    VERDICTS,
    Added,
    Estimate,
    Findings,
    NextExperiment,
    Rejected,
    TargetFindings,
    WholeError,
)
from insenv.identify.fit.heldout import CHANCE
from insenv.identify.prepare.excess import TOLERANCE
from insenv.identify.prepare.spectral.lines import FALSE_ALARM
from insenv.report import (
    estimates,
    found,
    sentences,
    summary,
    to_json,
    words,
)

Make = Callable[[], Findings]
every = pytest.mark.parametrize("make", EVERY.values(), ids=EVERY.keys())


#: Ids of the contract's table of effects.
IDS = """
bias bias_drift bias_warm_up bias_step bias_temperature bias_temperature_rate bias_thermal_lag
bias_thermal_hysteresis scale_factor
scale_factor_drift scale_factor_warm_up scale_factor_temperature scale_factor_asymmetry scale_factor_cubic
scale_factor_anomaly scale_factor_knee lock_in lock_in_wander rate_lock sine_response compensation_ripple
encoder_harmonic angle_locked_rate magnetic_field wobble earth_rate timing_skew sample_hold saturation
g_sensitivity cross_axis tone base_tilt base_settling encoder_backlash scale_factor_hysteresis dead_band bias_direction
output_bandwidth self_heating settling_after_turn centripetal_acceleration lever_arm table_tilt vibration_rectification
non_orthogonality misalignment accel_scale_factor accel_bias accel_asymmetry accel_second_order size_effect
accel_third_order accel_cross_coupling accel_misalignment
force_delay spline_time spline_temperature spline_rate spline_angle angle_random_walk bias_instability
rate_random_walk quantization
unit_mounting mounting_shift base_level base_heading axis_non_orthogonality encoder_eccentricity
"""


@every
def test_summary_opens_with_the_verdict_and_keeps_its_width(make: Make) -> None:
    made = make()
    lines = summary(made, 90).split("\n")
    opening = " ".join(lines[: lines.index("")])
    assert opening == sentences.overall(made)
    assert max(map(len, lines)) <= 90
    assert not any(line != line.rstrip() for line in lines)


def test_reasons_of_refusals_are_as_wide_as_the_terminal() -> None:
    made = one_target(60)
    reason = "its W_L_squared would be -7.44e-07, beyond the credible 0 to 0.001, and " + "so on " * 20
    refused = Rejected("lock_in", 1.0, 0.0, reason.strip())
    lines = summary(replace(made, targets=(replace(made.targets[0], rejected=(refused,)),)), 72).split("\n")
    first = next(i for i, line in enumerate(lines) if line.startswith("  lock_in"))
    last = next(i for i in range(first + 1, len(lines)) if lines[i][:4].strip())
    assert max(map(len, lines)) <= 72 and last - first > 2
    start = lines[first].index("its")
    assert all(line[:start].strip() == "" and line[start] != " " for line in lines[first + 1 : last] if line)
    assert " ".join(line[start:] for line in lines[first:last] if line) == reason.strip()


def test_summary_shows_figures_with_units() -> None:
    said = summary(one_target(60))
    for figure in (
        "0.0846 deg/h", "0.0208 deg/h", "-75%", "0.2475 ± 0.0006 arcsec", "p = 1×10⁻⁹",
        "0.00806 ± 0.00019",
        "bias_temperature_rate   p = 2×10⁻⁵  held-out worse", "needs accel_x: g_sensitivity",
        "reverse the table",
    ):  # fmt: skip
        assert figure in said
    assert "c = 9.790 ± 0.020 m/s²" in summary(several_targets())


def test_a_confounded_verdict_names_every_rival() -> None:
    said = summary(confounded(), 200)
    assert "cannot tell what: encoder harmonic (order 1), rate locked to the table angle (order 1) or" in said
    assert "encoder_harmonic:1, angle_locked_rate:1 or g_sensitivity" in said


def test_nothing_significant_claims_no_improvement() -> None:
    for said in (summary(nothing_significant()), Page(shown(nothing_significant)[1]).text):
        assert "Nothing significant" in said
        assert "with what was added" not in said
        assert "enlarged" not in said


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_has_words(verdict: str) -> None:
    target = replace(gyro(60), verdict=verdict)
    assert verdict in words.LABELS
    assert verdict not in sentences.headline(target)
    assert sentences.headline(target).endswith(".")


def test_every_effect_of_the_contract_has_a_description() -> None:
    assert all(words.meaning(key) and words.name(key) != key for key in IDS.split() if "_" in key)
    assert all(words.meaning(key) for key in IDS.split())
    assert words.name("unheard_of:2") == "unheard_of (order 2)"


def test_every_effect_that_there_is_has_a_description() -> None:
    assert {effect.id for effect in ALL} | set(RESERVED) == set(IDS.split())
    assert all(effect.title and effect.meaning for effect in ALL)


def test_the_method_names_the_limits_that_the_computation_uses() -> None:
    method = " ".join(words.METHOD)
    assert f"false alarm in {100 * FALSE_ALARM:g} % of recordings" in method
    assert f"by more than {100 * CHANCE:g} %" in method
    assert f"tolerance of {100 * TOLERANCE:g} %" in method


# What was found, in running text


def effect(kind: str, p: float = 1e-20, generic: bool = False, **values: tuple[float, float, str]) -> Added:
    parameters = tuple(Estimate(kind, name, *given) for name, given in values.items())
    return Added(kind, None, parameters, p, 90.0, (), 4.1e-7, 1.01e-7, generic=generic)


def tone(frequency: float, sd: float = 0.01, p: float = 1e-20) -> Added:
    return effect("tone", p, f=(frequency, sd, "Hz"), amplitude=(1e-5, 1e-7, "rad/s"))


def with_added(*added: Added, **changes: Any) -> Findings:
    made = empty_covariates()
    return replace(made, targets=(replace(made.targets[0], added=added, **changes),))


def step(at: float) -> Added:
    return effect("bias_step", c=(1e-6, 1e-8, "rad/s"), t0=(at, 0.3, "s"))


@pytest.mark.parametrize(
    ("added", "text"),
    [
        ([tone(29.929, 0.028), tone(18.98, 0.19), tone(9.1858, 0.0013), tone(20.743, 0.027)],
         "tones at 29.93, 18.98, 9.19 and 20.74 Hz"),
        ([tone(12.72, 0.1)], "a tone at 12.72 Hz"),
        ([tone(12.72, 0.5)], "a tone at 12.7 Hz"),
        ([tone(0.039098, 1.4e-5)], "a tone at 39.10 mHz"),
        ([tone(30.0), tone(0.0391, 1e-5)], "tones at 30.00 and 0.0391 Hz"),
        ([tone(12.0, 0.0), tone(8.0, float("nan"))], "tones at 12.00 and 8.00 Hz"),
        ([step(2214.3)], "a step of the bias at 2214 s"),
        ([step(2214.3), step(2537.1)], "two steps of the bias (at 2214 and 2537 s)"),
        ([effect("tone")], "tone"),
        ([effect("lock_in")] * 2, "lock-in (twice)"),
        ([effect("lock_in"), tone(8.0), tone(9.0)], "lock-in, and tones at 8.000 and 9.000 Hz"),
    ],
)  # fmt: skip
def test_found_effects_are_named_by_where_they_sit(added: list[Added], text: str) -> None:
    assert found.listed(added) == text


def test_the_same_probability_is_said_once() -> None:
    first, second = found.chances([tone(5.0), tone(6.0, p=0.004), tone(7.0, p=1e-30)])
    assert first == "Tones at 5.000 and 7.000 Hz: chance of seeing this from noise alone, each: p < 10⁻¹⁵."
    assert second == "A tone at 6.000 Hz: chance of seeing this from noise alone: p = 0.004."


def test_the_error_of_the_whole_search_stands_beside_the_p_value() -> None:
    agrees = replace(tone(5.0, p=0.004), whole=lambda: WholeError(0.006, 999, True))
    least = replace(tone(6.0), whole=lambda: WholeError(0.001, 999, True))
    differs = replace(tone(7.0, p=1e-9), whole=lambda: WholeError(0.041, 999, False))
    made = with_added(agrees, least, differs)
    for text in (summary(made), as_read(made)):
        said = " ".join(text.split())
        assert "p = 0.004 (by signs 0.006)" in said and "(by signs ≤ 0.001)" in said
        assert said.count("with signs by chance the search finds as much") == 1
        assert "in 4.1% of 999 draws, more often than p = 1×10⁻⁹ says" in said
    told = [one.get("whole_search") for one in to_json(made)["added"]]
    assert told[0] == {"p_value": 0.006, "draws": 999, "agrees": True} and told[2]["agrees"] is False


def test_several_tones_share_one_heading_and_one_meaning() -> None:
    made = with_added(tone(5.0), tone(7.0))
    for said in (summary(made), as_read(made)):
        assert "lacked tones at 5.000 and 7.000 Hz." in said
        assert said.count(words.meaning("tone")) == 1
        assert said.count("(both together)") == 2


def test_a_candidate_whose_like_was_added_is_called_another() -> None:
    said = as_read(with_added(tone(5.0)))
    assert "tone (another) tone 0.3" in said
    assert said.count("(another)") == 1


def test_a_curve_without_a_cause_is_shown_by_its_range() -> None:
    coefficients: dict[str, Any] = {f"c{i}": (i * 1e-7, 1e-8, "rad/s") for i in range(1, 9)}
    curve = effect("spline_time", generic=True, **coefficients)
    for said in (summary(with_added(curve)), as_read(with_added(curve))):
        assert "8 coefficients from 0.0206 to 0.165 deg/h" in said
        assert "c3 =" not in said


def _estimate(name: str) -> Estimate:
    return Estimate(name, "c", 1e-6, 1e-8, "rad/s")


def test_an_estimate_that_only_one_model_has_shows_a_dash() -> None:
    both, dropped, fresh = (_estimate(name) for name in ("bias", "bias_drift", "lock_in"))
    rows = estimates.pairs((both, dropped), (both, fresh))
    assert [(r.effect, r.before == "—", r.after == "—", r.shift == "—") for r in rows] == [
        ("bias", False, False, False),
        ("bias_drift", False, True, True),
        ("lock_in", True, False, True),
    ]
    made = with_added(tone(5.0), estimates_before=(both, dropped), estimates_after=(both, fresh))
    whole = with_added(tone(5.0), estimates_before=(both,), estimates_after=(both,))
    for show in (summary, as_read):
        assert "that model has no estimate of its own" in " ".join(show(made).split())
        assert "that model has no estimate of its own" not in " ".join(show(whole).split())


def test_an_estimate_is_shown_as_sure_as_it_is_stated_where_nothing_was_added() -> None:
    """Parts of a recording, or noise of a reference, may bear out less than the fit says of itself."""
    fitted = _estimate("bias")
    stated = replace(fitted, sd=40 * fitted.sd)
    made = with_added(estimates_before=(fitted,), estimates_after=(stated,), verdict="nothing-significant")
    (pair,) = estimates.pairs((fitted,), (stated,))
    assert pair.before != pair.after == pair.stated
    for show in (summary, as_read):
        assert pair.after in show(made) and pair.before not in show(made)


def _confounded(*others: Added) -> TargetFindings:
    rivals = replace(effect("timing_skew"), confounded_with=("tone", "sample_hold"))
    experiment = NextExperiment(("timing_skew", "tone", "sample_hold"), "a staircase of rates", None)
    made = with_added(rivals, *others, verdict="confounded", next_experiment=(experiment,))
    return made.targets[0]


def test_a_confounded_verdict_says_what_holds_all_the_same_and_what_to_do() -> None:
    said = " ".join(sentences.sureness(_confounded(), 0.01))
    assert "Whichever it is (fitted as timing skew), on data that no fit saw the error" in said
    assert "from 0.0846 deg/h to 0.0208 deg/h rms (-75%)" in said
    assert said.endswith("to tell timing skew, tone, and sample and hold apart – a staircase of rates.")


def test_what_is_sure_beside_a_confounded_set_is_said_to_be_so() -> None:
    assert sentences.headline(_confounded(effect("lock_in")), "G") == (
        "The declared model of G lacked lock-in, and something else that this recording cannot tell: "
        "timing skew, tone, or sample and hold."
    )


def test_orders_of_one_effect_are_one_rival_and_a_bias_declared_for_all_runs_is_one_of_each() -> None:
    law = replace(effect("bias_temperature"), order=1, confounded_with=("bias_temperature:2", "bias", "tone"))
    estimate = Estimate("bias", "c", 1.0, 0.1, "rad/s")
    made = with_added(law, verdict="confounded", estimates_before=(estimate,)).targets[0]
    told = "bias over temperature (orders 1, 2), tone or bias of each run."
    assert sentences.headline(made, "G").endswith(f"cannot tell what: {told}")
    free = replace(made, estimates_before=())
    assert "of each run" not in sentences.headline(free, "G")


def test_what_several_targets_share_is_printed_once() -> None:
    one = gyro(60)
    pairs = (("tone", "bias_step"), ("tone", "bias_drift"))
    again = tuple(NextExperiment(pair, "a longer recording", 9.0) for pair in pairs)
    x, y = (replace(one, target=name, next_experiment=again) for name in ("gyro_x", "gyro_y"))
    z = replace(one, target="accel_z", not_testable=())
    w = replace(one, target="accel_w", not_testable=one.not_testable[:1])
    said = summary(findings((x, y, z, w)), 90)
    assert said.count("Not testable with this recording (gyro_x, gyro_y)") == 1
    assert said.count("Not testable with this recording") == 2
    assert said.count("a longer recording; separates tone and bias_step") == 2


@pytest.mark.parametrize(("after", "said"), [(2e-7, True), (1.01e-7, False), (0.5e-7, False)])
def test_an_excess_over_the_noise_is_claimed_only_where_there_is_one(after: float, said: bool) -> None:
    target = gyro(60)
    held_out = replace(target.held_out, after=after)
    target = replace(target, verdict="effects-found-incomplete", held_out=held_out)
    assert ("What is left on held-out data" in " ".join(sentences.sureness(target, 0.01))) is said


def test_p_values_in_reasons_read_as_elsewhere() -> None:
    target = replace(gyro(60), reasons=("the residual holds more (p = 2e-303)", "no line (best p = 0.3)"))
    said = sentences.sureness(target, 0.01)
    assert "The residual holds more (p < 10⁻¹⁵)." in said
    assert "No line (best p = 0.3)." in said


@pytest.mark.parametrize(("p_values", "text"), [([1.0, 0.13], "all p > 0.1"), ([0.045, 1.0], "smallest p = 0.045")])
def test_candidates_that_are_only_counted(p_values: list[float], text: str) -> None:
    assert sentences.rest(p_values) == f"not significant ({text})"


# Quantities and bins
