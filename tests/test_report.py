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
    not_finite,
    nothing_significant,
    one_target,
    several_targets,
)

from insenv.core.errors import InputError
from insenv.identify.findings import VERDICTS, Findings
from insenv.report import binning, figures, summary, to_html, to_json, words, write_html, write_json
from insenv.report.quantities import number, p_value, unit_for, with_sd

Make = Callable[[], Findings]
every = pytest.mark.parametrize("make", EVERY.values(), ids=EVERY.keys())

#: Ids of the contract's table of effects.
IDS = """
bias bias_drift bias_warm_up bias_step bias_temperature bias_temperature_rate bias_thermal_lag scale_factor
scale_factor_drift scale_factor_warm_up scale_factor_temperature scale_factor_asymmetry scale_factor_cubic
scale_factor_anomaly lock_in encoder_harmonic angle_locked_rate earth_rate timing_skew sample_hold
g_sensitivity cross_axis tone base_tilt non_orthogonality accel_scale_factor accel_bias spline_time
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
        if not self.open or self.open[-1] != "style":
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
    assert not re.search(
        r"https?:|//[a-z]|@import|@font-face|javascript:", re.sub(r"base64,[^\"]*", "", markup)
    )
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
    pictures = sum(tag == "svg" for tag, _ in Page(text).tags)
    assert pictures == sum(3 + len(figures.covariates(target)) for target in made.targets)


def test_html_says_what_was_found(page: tuple[Findings, str]) -> None:
    made, text = page
    said = Page(text).text
    for target in made.targets:
        assert words.headline(target) in said
        for added in target.added:
            assert words.meaning(added.effect) in said
        for effect in (*(r.effect for r in target.rejected), *(n.effect for n in target.not_testable)):
            assert effect in said
        for experiment in target.next_experiment:
            assert experiment.procedure in said
    for remark in (*made.remarks, made.source, made.licence):
        assert remark in said


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
    assert opening == words.overall(made)
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
    assert verdict not in words.headline(target)
    assert words.headline(target).endswith(".")


def test_every_effect_of_the_contract_has_a_description() -> None:
    assert list(words.EFFECTS) == IDS.split()
    assert all(words.meaning(key) for key in words.EFFECTS)
    assert words.name("unheard_of:2") == "unheard_of (order 2)"


# Quantities and bins


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


def test_figures_cope_with_hardly_any_data() -> None:
    target = gyro(60)
    short = {name: getattr(target.traces, name)[:1] for name in ("t", "run", "held_out", "before", "after")}
    figures.against_time(replace(target, traces=replace(target.traces, covariates={}, **short))).canvas.draw()


def test_drawing_is_lazy_and_leaves_pyplot_alone() -> None:
    code = (
        "import sys, insenv.report as report\n"
        "assert not {'matplotlib', 'jinja2'} & set(sys.modules), 'imported too early'\n"
        "from made_findings import nothing_significant\n"
        "report.to_html(nothing_significant())\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    here = Path(__file__).parent
    subprocess.run(
        [sys.executable, "-c", code], check=True, cwd=here, env={"PYTHONPATH": f"{here}:{here.parent}"}
    )
