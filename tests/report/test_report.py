"""Reports: JSON by the contract, text and HTML that say what the findings say, and nothing else."""

import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_findings import (
    EVERY,
    confounded,
    empty_covariates,
    gyro,
    hidden_in_the_earth_rate,
    not_finite,
    nothing_significant,
    one_target,
    several_targets,
)

from insenv.core.errors import InputError
from insenv.core.units import dimension_of, scale_to_si
from insenv.effects.base import OUTPUT, CurveEffect, Param
from insenv.effects.catalogue import ALL, CATALOGUE
from insenv.effects.own import RESERVED
from insenv.identify.findings import VERDICTS, Added, Estimate, Findings, NextExperiment, TargetFindings
from insenv.identify.fit.heldout import CHANCE
from insenv.identify.search.excess import TOLERANCE
from insenv.identify.search.lines import FALSE_ALARM
from insenv.report import (
    binning,
    drawing,
    estimates,
    figures,
    found,
    sentences,
    summary,
    to_html,
    to_json,
    words,
    write_html,
    write_json,
)
from insenv.report.quantities import number, p_value, unit_for, with_sd

Make = Callable[[], Findings]
every = pytest.mark.parametrize("make", EVERY.values(), ids=EVERY.keys())

#: Ids of the contract's table of effects.
IDS = """
bias bias_drift bias_warm_up bias_step bias_temperature bias_temperature_rate bias_thermal_lag scale_factor
scale_factor_drift scale_factor_warm_up scale_factor_temperature scale_factor_asymmetry scale_factor_cubic
scale_factor_anomaly lock_in lock_in_wander rate_lock sine_response compensation_ripple encoder_harmonic
angle_locked_rate magnetic_field wobble earth_rate timing_skew sample_hold saturation
g_sensitivity cross_axis tone base_tilt base_settling encoder_backlash scale_factor_hysteresis dead_band
output_bandwidth self_heating settling_after_turn centripetal_acceleration lever_arm vibration_rectification
non_orthogonality misalignment accel_scale_factor accel_bias spline_time
spline_temperature spline_rate spline_angle angle_random_walk bias_instability rate_random_walk quantization
"""

#: Keys of the contract's example, block by block.
TOP = {
    "schema", "manifest", "rows", "duration_s", "verdict", "declared", "added", "held_out", "estimates",
    "noise", "rejected", "not_testable", "next_experiment",
}  # fmt: skip
ADDED = {
    "effect", "order", "parameters", "p_value", "confounded_with", "held_out_before", "held_out_after",
}  # fmt: skip
HELD_OUT = {"before", "after", "noise_floor", "unit", "averaging_s"}
PARAMETER = {"name", "value", "sd", "unit"}
NOISE = {"value", "sd", "unit"}


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _numbers(item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield value


# JSON


@every
def test_json_has_the_keys_of_the_contract(make: Make) -> None:
    made, document = make(), to_json(make())
    assert document.keys() >= TOP
    assert document["schema"] == "insenv.close-loop/1"
    assert document["verdict"] in VERDICTS
    for entry in document["added"]:
        assert entry.keys() >= ADDED
        assert all(parameter.keys() == PARAMETER for parameter in entry["parameters"])
    for entry in document["estimates"]["before"] + document["estimates"]["after"]:
        assert entry.keys() >= PARAMETER | {"effect"}
    assert all(entry.keys() >= {"effect", "p_value"} for entry in document["rejected"])
    assert all(entry.keys() >= {"effect", "needs"} for entry in document["not_testable"])
    experiments = document["next_experiment"]
    assert all(e.keys() >= {"separates", "procedure", "expected_separation_sigma"} for e in experiments)
    several = len(made.targets) > 1
    for held_out in document["held_out"].values() if several else [document["held_out"]]:
        assert held_out.keys() == HELD_OUT
    for noise in document["noise"].values() if several else [document["noise"]]:
        assert all(block.keys() == NOISE for block in noise.values())


def test_json_of_one_target_repeats_the_findings() -> None:
    made, document = one_target(), to_json(one_target())
    target = made.targets[0]
    assert document["declared"] == ["bias", "scale_factor", "earth_rate"]
    assert (document["rows"], document["duration_s"], document["alpha"]) == (120_000, 1200.0, 0.01)
    first = document["added"][0]
    assert (first["effect"], first["order"], first["likelihood_ratio"]) == ("encoder_harmonic", 1, 812.0)
    assert first["parameters"][0] == {"name": "c", "value": 1.2e-6, "sd": 3e-9, "unit": "rad"}
    assert document["added"][1]["order"] is None
    assert document["held_out"]["noise_floor"] == target.held_out.noise_floor
    assert document["noise"]["angle_random_walk"] == {"value": 8.7e-8, "sd": 1e-9, "unit": "rad/sqrt(s)"}
    assert document["remarks"] == list(made.remarks)
    assert "verdicts" not in document
    assert "target" not in first


def test_json_has_the_azimuth_its_caution_and_what_a_table_can_run() -> None:
    document = to_json(hidden_in_the_earth_rate())
    (azimuth,) = document["derived"]
    assert azimuth == {
        "name": "azimuth",
        "unit": "rad",
        "before": {"value": 0.7, "sd": 1e-4},
        "after": {"value": 0.71, "sd": 0.15},
    }
    assert document["cautions"] == ["The azimuth may be off."]
    first, second = document["next_experiment"]
    assert first["profile"] == {"kind": "reversal", "rate": "10 deg/s", "dwell": "144 s"}
    assert second["profile"] is None
    several = to_json(replace(several_targets(), targets=(*several_targets().targets, gyro(60))))
    assert several["cautions"] == {name: [] for name in several["verdicts"]}
    assert several["derived"] == []


@pytest.mark.parametrize("show", [summary, to_html])
def test_reports_show_the_azimuth_and_its_caution(show: Callable[[Findings], str]) -> None:
    text = " ".join(show(hidden_in_the_earth_rate()).split())
    assert "Azimuth of the input axis at table angle 0: 40.107 ± 0.006 deg (± 21 arcsec) before" in text
    assert "41 ± 9 deg after" in text
    assert "The azimuth may be off." in text
    assert "No residual shows it: on data that no fit saw" in text
    assert "Azimuth" not in show(one_target())


def test_json_of_several_targets_names_the_target_everywhere() -> None:
    document = to_json(several_targets())
    names = ["accel_x", "accel_y", "gyro_z"]
    assert document["verdicts"] == {
        "accel_x": "effects-found",
        "accel_y": "effects-found",
        "gyro_z": "nothing-significant",
    }
    assert list(document["held_out"]) == list(document["noise"]) == names
    assert document["held_out"]["accel_x"]["unit"] == "m/s^2"
    assert [a["target"] for a in document["added"]] == ["accel_x", "accel_y"]
    for entries in (document["rejected"], document["not_testable"], *document["estimates"].values()):
        assert list(dict.fromkeys(entry["target"] for entry in entries)) == names


@every
def test_no_page_has_a_name_where_a_unit_is_to_be(make: Make) -> None:
    found = make()
    for page in (summary(found), to_html(found), json.dumps(to_json(found))):
        assert OUTPUT not in page and not re.search(r"[/ (]\{[a-z]\}", page)


@every
def test_written_json_is_strict_and_reads_back(make: Make, tmp_path: Path) -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    path = write_json(make(), tmp_path / "out.json")
    document = json.loads(path.read_text("utf-8"), parse_constant=refuse)
    assert document == to_json(make())
    assert np.isfinite(list(_numbers(document))).all()
    assert [p.name for p in tmp_path.iterdir()] == ["out.json"]


def test_what_is_not_finite_becomes_null() -> None:
    document = to_json(not_finite())
    assert document["held_out"]["after"] is None
    assert document["held_out"]["noise_floor"] is None
    assert document["added"][0]["p_value"] is None


def test_numpy_scalars_become_plain_numbers() -> None:
    made = one_target(60)
    made = replace(made, rows=np.int64(7), duration=np.float64(3.0))  # type: ignore[arg-type]
    json.dumps(to_json(made), allow_nan=False)


def test_a_report_that_cannot_be_written_is_one_sentence_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    for write, path in (
        (write_json, tmp_path / "taken"),
        (write_json, tmp_path / "no folder" / "out"),
        (write_html, tmp_path / "no folder" / "out"),
    ):
        with pytest.raises(InputError, match=re.escape(str(path))) as raised:
            write(nothing_significant(), path)
        assert "\n" not in str(raised.value)
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def test_a_failed_write_keeps_the_file_that_was_there(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    broken = replace(nothing_significant(), remarks=(object(),))  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        write_json(broken, path)
    assert path.read_text() == "old"


# HTML


class Page(HTMLParser):
    """What a page consists of; raises where tags do not nest."""

    VOID = frozenset(["meta", "link", "br", "hr", "img", "input"])

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open, f"left open: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-1:]}"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if not {"style", "svg"} & set(self.open):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())


@pytest.fixture(scope="module", params=list(EVERY.values()), ids=list(EVERY))
def page(request: pytest.FixtureRequest) -> tuple[Findings, str]:
    made = request.param()
    return made, to_html(made)


def test_html_nests_and_refers_to_nothing_outside(page: tuple[Findings, str]) -> None:
    tags = Page(page[1]).tags
    assert not {tag for tag, _ in tags} & {
        "script",
        "link",
        "iframe",
        "object",
        "embed",
        "base",
        "form",
        "img",
    }
    for tag, attributes in tags:
        for key, value in attributes.items():
            assert not key.startswith("on"), (tag, key)
            if key in ("src", "href", "xlink:href", "action", "srcset"):
                assert value is not None and value.startswith(("#", "data:image/png;base64,")), (tag, key)
    markup = page[1].replace(page[0].source, "")
    assert not re.search(r"https?:|//[a-z]|@import|@font-face|javascript:", re.sub(r"base64,[^\"]*", "", markup))
    assert set(re.findall(r"url\((.)", markup)) <= {"#"}


def test_html_ids_are_unique_and_every_reference_is_met(page: tuple[Findings, str]) -> None:
    ids = [a["id"] for _, a in Page(page[1]).tags if "id" in a]
    # The definitions inside one picture may repeat one another's content, never across pictures.
    assert len(set(ids)) == len(ids)
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', page[1]))
    assert used <= set(ids)


def test_html_is_small_and_shows_every_picture(page: tuple[Findings, str]) -> None:
    made, text = page
    assert len(text.encode()) < 2_000_000
    pictures = sum(tag == "svg" and attributes.get("role") == "img" for tag, attributes in Page(text).tags)
    assert pictures == sum(4 + len(figures.covariates(target)) for target in made.targets)


def test_html_says_what_was_found(page: tuple[Findings, str]) -> None:
    made, text = page
    said = Page(text).text
    for target in made.targets:
        assert sentences.headline(target) in said
        for added in target.added:
            assert words.meaning(added.effect) in said
        for effect in (*(r.effect for r in target.rejected), *(n.effect for n in target.not_testable)):
            assert effect in said
        for experiment in target.next_experiment:
            assert experiment.procedure in said
    for remark in (*made.remarks, made.source, made.licence):
        assert remark in said


def test_one_banner_does_not_speak_for_targets_that_differ() -> None:
    assert "Explained: accel_x, accel_y · Nothing significant: gyro_z" in Page(to_html(several_targets())).text
    alike = several_targets()
    alike = replace(alike, targets=alike.targets[:2])
    assert "Explained: " not in Page(to_html(alike)).text


def test_html_shows_figures_with_units() -> None:
    said = Page(to_html(one_target(60))).text
    for figure in (
        "0.0846", "0.0208", "0.0202", "deg/h", "0.2475 ± 0.0006 arcsec", "412 ± 31 s", "-13.20 ± 0.21", "ppm",
        "-6.5", "9.1 sd", "held-out worse",
    ):  # fmt: skip
        assert figure in said


EVIL = "</title><script>alert(1)</script> \" onload='x' {{ 7 * 7 }} $\\frac{ & --> \x1b[2J"


def test_everything_from_a_file_is_escaped() -> None:
    made = one_target(60)
    target = replace(made.targets[0], target=EVIL, reasons=(EVIL,), declared=(EVIL,))
    added = replace(target.added[0], remark=EVIL, confounded_with=(EVIL,))
    target = replace(
        target,
        added=(added,),
        rejected=(replace(target.rejected[0], effect=EVIL, reason=EVIL),),
        not_testable=(replace(target.not_testable[0], effect=EVIL, needs=(EVIL,)),),
        next_experiment=(replace(target.next_experiment[0], procedure=EVIL, separates=(EVIL,)),),
        traces=replace(target.traces, covariates={}),
    )
    made = replace(made, title=EVIL, manifest=EVIL, source=EVIL, licence=EVIL, remarks=(EVIL,))
    made = replace(made, targets=(target, target))
    text = to_html(made)
    parsed = Page(text)
    assert "<script" not in text.lower()
    assert "{{ 7 * 7 }}" in parsed.text
    assert not any(key.startswith("on") for _, attributes in parsed.tags for key in attributes)
    assert "\x1b" not in summary(made)


@pytest.fixture(scope="module")
def plain() -> tuple[Findings, str]:
    made = empty_covariates()
    return made, to_html(made)


@pytest.mark.parametrize("field", ["before", "after", "noise_floor"])
def test_a_changed_number_changes_every_report(field: str, plain: tuple[Findings, str]) -> None:
    made, text = plain
    target = made.targets[0]
    held_out = replace(target.held_out, **{field: getattr(target.held_out, field) * 1.07})
    changed = replace(made, targets=(replace(target, held_out=held_out),))
    assert to_json(changed) != to_json(made)
    assert summary(changed) != summary(made)
    assert Page(to_html(changed)).text != Page(text).text


def test_a_changed_residual_changes_the_pictures_alone(plain: tuple[Findings, str]) -> None:
    made, text = plain
    target = made.targets[0]
    traces = replace(target.traces, after=target.traces.after * 1.5)
    other = to_html(replace(made, targets=(replace(target, traces=traces),)))
    assert Page(other).text == Page(text).text
    assert other != text


def test_the_same_findings_give_the_same_page(plain: tuple[Findings, str]) -> None:
    assert to_html(empty_covariates()) == plain[1]


def test_a_large_recording_gives_a_small_page() -> None:
    assert len(to_html(one_target(40_000)).encode()) < 2_000_000


# Text


@every
def test_summary_opens_with_the_verdict_and_keeps_its_width(make: Make) -> None:
    made = make()
    lines = summary(made, 90).split("\n")
    opening = " ".join(lines[: lines.index("")])
    assert opening == sentences.overall(made)
    assert max(map(len, lines)) <= 90
    assert not any(line != line.rstrip() for line in lines)


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
    for said in (summary(nothing_significant()), Page(to_html(nothing_significant())).text):
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


def test_several_tones_share_one_heading_and_one_meaning() -> None:
    made = with_added(tone(5.0), tone(7.0))
    for said in (summary(made), Page(to_html(made)).text):
        assert "lacked tones at 5.000 and 7.000 Hz." in said
        assert said.count(words.meaning("tone")) == 1
        assert said.count("(both together)") == 2


def test_a_candidate_whose_like_was_added_is_called_another() -> None:
    said = Page(to_html(with_added(tone(5.0)))).text
    assert "tone (another) tone 0.3" in said
    assert said.count("(another)") == 1


def test_a_curve_without_a_cause_is_shown_by_its_range() -> None:
    coefficients: dict[str, Any] = {f"c{i}": (i * 1e-7, 1e-8, "rad/s") for i in range(1, 9)}
    curve = effect("spline_time", generic=True, **coefficients)
    for said in (summary(with_added(curve)), Page(to_html(with_added(curve))).text):
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
    for show in (summary, lambda one: Page(to_html(one)).text):
        assert "that model has no estimate of its own" in " ".join(show(made).split())
        assert "that model has no estimate of its own" not in " ".join(show(whole).split())


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


def _parameters() -> Iterator[tuple[str, Param]]:
    for one in CATALOGUE:
        for param in (*one.linear, *(one.shapes if isinstance(one, CurveEffect) else ())):
            yield one.key, param


@pytest.mark.parametrize("output", ["rad/s", "m/s^2"])
@pytest.mark.parametrize("size", [1e-12, 1e-6, 1e-3, 1.0, 1e3])
def test_every_unit_of_the_catalogue_is_shown_in_one_of_the_same_dimension(output: str, size: float) -> None:
    ascii_text = str.maketrans({"²": "^2", "³": "^3", "µ": "u"})
    for key, param in _parameters():
        si = param.unit.replace(OUTPUT, output)
        unit = unit_for(si, size)
        label = re.sub(r"√(\w+)", r"sqrt(\1)", unit.label.translate(ascii_text)) or "1"
        if si not in ("", "1"):
            assert "rad" not in unit.label and " " not in unit.label, key
            factor, _ = scale_to_si(label, dimension_of(si), f"{key} {param.name} {si}")
            assert unit.factor == pytest.approx(factor, rel=1e-9), (key, si, label)


@pytest.mark.parametrize(
    ("kind", "si", "value", "text"),
    [
        ("angle_random_walk", "rad/s sqrt(s)", np.deg2rad(4e-5) / 60, "(4.0 ± 0.4)×10⁻⁵ deg/√h"),
        ("angle_random_walk", "m/s^2 sqrt(s)", 6e-5, "0.0036 ± 0.0004 m/s/√h"),
        ("bias_instability", "rad/s", np.deg2rad(0.1), "360 ± 40 deg/h"),
        ("bias_instability", "m/s^2", 9.80665e-4, "100 ± 10 µg"),
        ("rate_random_walk", "rad/s/sqrt(s)", np.deg2rad(0.5) / 3600 / 60, "0.50 ± 0.05 deg/h/√h"),
        ("quantization", "rad/s s", np.deg2rad(9.0) / 3600, "9.0 ± 0.9 arcsec"),
        ("quantization", "m/s^2 s", 0.0016, "0.00160 ± 0.00016 m/s"),
        ("base_tilt", "m/s^3", 0.012 / 3600, "12.0 ± 1.2 mm/s²/h"),
        ("base_tilt", "m/s^3", 9.80665e-5 / 3600, "10.0 ± 1.0 µg/h"),
        ("bias_temperature", "rad/s/K^2", np.deg2rad(200.0) / 3600, "200 ± 20 deg/h/K²"),
    ],
)
def test_figures_of_a_sensor_have_the_units_of_the_field(kind: str, si: str, value: float, text: str) -> None:
    shown = estimates.value(Estimate(kind, "x", value, 0.1 * value, si))
    assert shown == text


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (9.79123, 0.0412, "9.79 ± 0.04"),
        (9.79123, 0.0203, "9.791 ± 0.020"),
        (412.3, 31.2, "412 ± 31"),
        (1.2e-7, 3e-9, "(1.200 ± 0.030)×10⁻⁷"),
        (1.234e9, 5e6, "(1.234 ± 0.005)×10⁹"),
        (0.0, 6e-4, "(0 ± 6)×10⁻⁴"),
        (-0.5, 0.0, "-0.5000"),
        (3.0, float("nan"), "3.000"),
        (float("nan"), 1.0, "—"),
        (1.0, 0.0996, "1.00 ± 0.10"),
        (5123.0, 812.0, "(5.1 ± 0.8)×10³"),
        (5123.0, 12.0, "5123 ± 12"),
        (-48.3, 41.0, "-50 ± 40"),
        (148.0, 37.0, "150 ± 40"),
        (-0.01, 0.8, "0.0 ± 0.8"),
    ],
)
def test_a_value_is_rounded_to_what_its_sd_supports(value: float, sd: float, text: str) -> None:
    assert with_sd(value, sd) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.000123, "1.23×10⁻⁴"),
        (0.123, "0.123"),
        (99999.6, "1.00×10⁵"),
        (12345.0, "12345"),
        (0.0, "0"),
        (-2.5, "-2.50"),
    ],
)
def test_numbers_keep_three_digits(value: float, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("p", "text"),
    [(0.4, "= 0.4"), (3e-20, "< 10⁻¹⁵"), (0.0, "< 10⁻¹⁵"), (2e-5, "= 2×10⁻⁵"), (9.7e-6, "= 1×10⁻⁵")],
)
def test_p_values_are_shown_with_their_relation(p: float, text: str) -> None:
    assert p_value(p) == text


@pytest.mark.parametrize(
    ("si", "size", "label", "shown"),
    [
        ("rad/s", np.deg2rad(1.0) / 3600, "deg/h", 1.0),
        ("rad/s", np.deg2rad(2.0), "deg/s", 2.0),
        ("m/s^2", 9.8, "m/s²", 9.8),
        ("m/s^2", 0.0154, "mm/s²", 15.4),
        ("m/s^2", 9.80665e-5, "µg", 10.0),
        ("rad", np.deg2rad(5 / 3600), "arcsec", 5.0),
        ("", 2e-5, "ppm", 20.0),
        ("rad/sqrt(s)", np.deg2rad(0.003) / 60, "deg/√h", 0.003),
        ("rad/s/sqrt(s)", np.deg2rad(1.0) / 3600 / 60, "deg/h/√h", 1.0),
        ("rad/s/K", np.deg2rad(1.0) / 3600, "deg/h/K", 1.0),
        ("m/s^2/K", 0.003, "mm/s²/K", 3.0),
        ("rad/s/(m/s^2)", np.deg2rad(1.0) / 3600 / 9.80665, "deg/h/g", 1.0),
        ("furlong/s", 3.0, "furlong/s", 3.0),
    ],
)
def test_units_suit_an_engineer(si: str, size: float, label: str, shown: float) -> None:
    unit = unit_for(si, size)
    assert unit.label == label
    assert unit.of(size) == pytest.approx(shown, rel=1e-12)


def test_bins_mean_what_they_hold() -> None:
    x = np.repeat([0.0, 1.0, 2.0], [4, 4, 2])
    b = binning.means(x, np.array([1, 2, 3, 4, 5, 5, 5, 5, 9, 9.0]), 3)
    assert b.mean.tolist() == pytest.approx([2.5, 5.0, np.nan], nan_ok=True)
    assert b.error[:2].tolist() == pytest.approx([np.std([1, 2, 3, 4], ddof=1) / 2, 0.0])


def test_runs_stand_one_after_the_other_only_where_they_overlap() -> None:
    traces = gyro(60).traces
    line = binning.timeline(traces)
    assert (np.diff(line.x) > 0).all()
    later = replace(traces, t=np.linspace(5.0, 6.0, 60))
    np.testing.assert_array_equal(binning.timeline(later).x, later.t)


def test_an_averaged_spectrum_keeps_its_level() -> None:
    # White noise of density 1: 20000 exponential values; the mean over all bins is within 5 sigma (p < 1e-6).
    rng = np.random.default_rng(3)
    f = np.arange(1, 20001) / 100.0
    at, density = binning.smoothed(f, rng.exponential(size=len(f)))
    assert len(at) < 150
    assert abs(density[-1] - 1) < 5 / np.sqrt(1800)
    assert (np.diff(at) > 0).all()


def test_the_overview_shows_time_and_spectrum() -> None:
    left, right = figures.overview(gyro(60)).axes
    assert (left.get_xlabel(), left.get_ylabel()) == (
        "time, runs one after the other [s]",
        "residual [deg/h]",
    )
    assert (right.get_xlabel(), right.get_ylabel()) == ("frequency [Hz]", "two-sided root PSD [(deg/h)/√Hz]")


@pytest.mark.parametrize("low", [1e-9, 1e-3, 0.03, 0.5, 1.7, 4000.0])
@pytest.mark.parametrize("ratio", [1.3, 3.0, 9.0, 40.0, 900.0, 1e5, 1e9, 1e14])
def test_labels_of_logarithmic_axes_are_few_and_do_not_overlap(low: float, ratio: float) -> None:
    spectra = gyro(60).spectra
    tau, deviation = np.geomspace(low, low * ratio, 30), np.geomspace(1e-7, 1e-7 * ratio, 30)
    made = replace(
        spectra, tau=tau, allan_before=deviation, allan_after=deviation, allan_lower=deviation,
        allan_upper=deviation, allan_fitted=deviation, allan_declared=None,
    )  # fmt: skip
    figure = figures.allan(replace(gyro(60), spectra=made))
    figure.draw_without_rendering()
    (ax,) = figure.axes
    for axis, (first, last), side in ((ax.xaxis, ax.get_xlim(), "x"), (ax.yaxis, ax.get_ylim(), "y")):
        boxes = [t.label1.get_window_extent() for t in axis.get_major_ticks() if t.label1.get_text()]
        edges = sorted((getattr(b, f"{side}0"), getattr(b, f"{side}1")) for b in boxes)
        assert 2 <= len(boxes) <= 8
        assert all(a[1] < b[0] for a, b in zip(edges, edges[1:], strict=False)), (side, low, ratio)
        assert all(first <= tick <= last for tick in drawing.log_ticks(first, last))
        assert not any(label.get_text() for label in axis.get_minorticklabels())


def test_one_decade_is_labelled_in_plain_numbers() -> None:
    assert drawing.log_ticks(1.8, 52.0) == [2.0, 5.0, 10.0, 20.0, 50.0]


@pytest.mark.parametrize("size", [1e-7, 1e-3, 1.0, 1e4])
def test_a_residual_of_any_size_needs_no_factor_that_the_legend_would_hide(size: float) -> None:
    target = gyro(60)
    traces = replace(target.traces, before=size * target.traces.before, after=size * target.traces.after)
    figure = figures.against_time(replace(target, traces=traces))
    figure.draw_without_rendering()
    assert [ax.yaxis.get_offset_text().get_text() for ax in figure.axes] == ["", ""]


def test_a_table_that_only_swings_is_drawn_about_its_middle() -> None:
    target = gyro(600)
    swing = np.mod(np.deg2rad(12.0) * np.sin(np.arange(600.0)), 2 * np.pi)
    traces = replace(target.traces, covariates={"angle": swing})
    low, high = figures.against(replace(target, traces=traces), "angle").axes[-1].get_xlim()
    assert -16 < low < -12 and 12 < high < 16
    assert figures.against(target, "angle").axes[-1].get_xlim() == (0, 360)


def test_figures_cope_with_hardly_any_data() -> None:
    target = gyro(60)
    short = {name: getattr(target.traces, name)[:1] for name in ("t", "run", "held_out", "before", "after")}
    figures.against_time(
        replace(target, traces=replace(target.traces, covariates={}, **short))
    ).draw_without_rendering()


def test_drawing_is_lazy_and_leaves_pyplot_alone() -> None:
    code = (
        "import sys, insenv.report as report\n"
        "assert not {'matplotlib', 'jinja2'} & set(sys.modules), 'imported too early'\n"
        "from made_findings import nothing_significant\n"
        "report.to_html(nothing_significant())\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    here = Path(__file__).parents[1] / "cases"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=here, env={"PYTHONPATH": f"{here}:{here.parents[1]}"})
