"""Reports as one page of HTML that says what the findings say, and nothing else."""

import re
from collections.abc import Callable
from dataclasses import replace

import pytest
from html_text import Page, as_read
from made_findings import (
    EVERY,
    empty_covariates,
    one_target,
    several_targets,
    shown,
)

from insenv.identify.findings import Findings
from insenv.report import (
    figures,
    sentences,
    summary,
    to_html,
    to_json,
    words,
)

Make = Callable[[], Findings]
every = pytest.mark.parametrize("make", EVERY.values(), ids=EVERY.keys())


@pytest.fixture(scope="module", params=list(EVERY.values()), ids=list(EVERY))
def page(request: pytest.FixtureRequest) -> tuple[Findings, str]:
    return shown(request.param)


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
    assert "Explained: accel_x, accel_y · Nothing significant: gyro_z" in Page(shown(several_targets)[1]).text
    alike = several_targets()
    alike = replace(alike, targets=alike.targets[:2])
    assert "Explained: " not in as_read(alike)


def test_html_shows_figures_with_units() -> None:
    said = as_read(one_target(60))
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
    return shown(empty_covariates)


@pytest.mark.parametrize("field", ["before", "after", "noise_floor"])
def test_a_changed_number_changes_every_report(field: str, plain: tuple[Findings, str]) -> None:
    made, _ = plain
    target = made.targets[0]
    held_out = replace(target.held_out, **{field: getattr(target.held_out, field) * 1.07})
    changed = replace(made, targets=(replace(target, held_out=held_out),))
    assert to_json(changed) != to_json(made)
    assert summary(changed) != summary(made)
    assert as_read(changed) != as_read(made)


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
