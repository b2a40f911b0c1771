"""The design that all pages share: palette, policy, head, size of the pictures."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from made_findings import nothing_significant, one_target, shown

from insenv.core.errors import InputError
from insenv.core.filing import Filing, command, hashed, run_as
from insenv.data.manifest import load_manifest
from insenv.identify.prepare.samples import sample_spectrum
from insenv.report import explore, to_html, to_json
from insenv.report.drawing import PALETTE
from insenv.report.page import stylesheet

#: Least contrasts of WCAG 2.1, AA: of text, and of what is drawn.
TEXT, DRAWN = 4.5, 3.0
TEXTS = ("ink", "soft", "good", "watch", "bad", "after")
LINES = ("before", "before-mean", "after", "after-mean", "grey", *(f"series-{k}" for k in range(3, 9)))


def _themes() -> dict[str, dict[str, str]]:
    light, dark = re.findall(r":root \{(.*?)\}", stylesheet(), re.DOTALL)
    colours = [dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", text)) for text in (light, dark)]
    return {"light": colours[0], "dark": colours[1]}


def _linear(colour: str) -> np.ndarray:
    value = np.array([int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def _contrast(one: str, other: str) -> float:
    light, dark = sorted((float(_linear(c) @ (0.2126, 0.7152, 0.0722)) + 0.05 for c in (one, other)), reverse=True)
    return light / dark


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_and_lines_stand_out_of_their_ground(theme: str) -> None:
    colours = _themes()[theme]
    for names, least, grounds in ((TEXTS, TEXT, ("page", "wash")), (LINES, DRAWN, ("page", "held"))):
        for name in names:
            for ground in grounds:
                assert _contrast(colours[name], colours[ground]) > least, (name, ground)


#: Vienot, Brettel and Mollon, Color Res. Appl. 24 (1999) 243: linear RGB as protanopes and deuteranopes see it.
BLIND = {
    "protan": ((0.11238, 0.88762, 0.0), (0.11238, 0.88762, 0.0), (0.00401, -0.00401, 1.0)),
    "deutan": ((0.29275, 0.70725, 0.0), (0.29275, 0.70725, 0.0), (-0.02234, 0.02234, 1.0)),
}


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("kind", BLIND)
def test_before_and_after_are_told_apart_by_the_colour_blind(theme: str, kind: str) -> None:
    colours = _themes()[theme]
    for one, other in (("before", "after"), ("before-mean", "after-mean")):
        seen = [np.clip(np.array(BLIND[kind]) @ _linear(colours[name]), 0, 1) for name in (one, other)]
        assert np.abs(seen[0] - seen[1]).max() > 0.15, (one, other)


def test_pictures_and_pages_have_one_palette() -> None:
    assert _themes()["light"].items() >= PALETTE.items()
    assert _themes()["dark"].keys() <= _themes()["light"].keys()


def test_a_page_may_run_and_load_nothing_but_its_own() -> None:
    text = shown(nothing_significant)[1]
    (allowed,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert "default-src &#39;none&#39;" in allowed and "unsafe" not in allowed
    (style,) = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    assert base64.b64encode(hashlib.sha256(style.encode()).digest()).decode() in allowed
    assert " style=" not in text


def test_the_head_of_a_page_is_what_a_laboratory_files(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,gyro\n0,0\n")
    data = hashed([tmp_path / "a.csv", tmp_path / "a.csv", tmp_path / "gone.csv"])
    sha = hashlib.sha256(b"time,gyro\n0,0\n").hexdigest()
    assert [(one.name, one.sha256) for one in data] == [("a.csv", sha)]
    before = command()
    try:
        run_as(["close-loop", "my run.toml"])
        made = replace(one_target(60), filing=Filing("<b>Operator", "SN 42", "laboratory", "2026-11-22", data))
        document, text = to_json(made), to_html(made)
    finally:
        run_as(before.split()[1:])
    assert document["report"]["serial_number"] == "SN 42"
    assert document["data"] == [{"file": "a.csv", "sha256": sha}]
    assert document["command"] == "insenv close-loop 'my run.toml'" and document["version"]
    for said in ("&lt;b&gt;Operator", "SN 42", "laboratory", "2026-11-22", sha, "close-loop"):
        assert said in text
    json.dumps(document)


def test_what_comes_from_elsewhere_is_as_it_was() -> None:
    folder = files("insenv.report").joinpath("vendor")
    named = re.findall(r"`(uPlot\.[\w.]+)` \| `([0-9a-f]{64})`", folder.joinpath("README.md").read_text("utf-8"))
    assert len(named) == 3
    for name, sha in named:
        assert hashlib.sha256(folder.joinpath(name).read_bytes()).hexdigest() == sha, name


def test_the_pages_own_script_is_small_and_makes_no_markup_of_texts() -> None:
    own = "".join(explore.scripts()[1:])
    assert len(own.encode()) <= 40_000
    assert not re.search(r"innerHTML|outerHTML|insertAdjacent|document\.write|eval\(|fetch\(|XMLHttp|import\(", own)


def test_one_measurement_of_several_axes_is_drawn_once() -> None:
    made, once = shown(nothing_significant)
    twice = replace(made, targets=(made.targets[0], replace(made.targets[0], target="gyro_b")))
    text = to_html(twice)
    assert text.count("As for gyro: one measurement of all axes together") == 1
    assert text.count('<svg role="img"') == once.count('<svg role="img"')


def test_the_spectrum_of_samples_keeps_its_level_and_shows_a_line() -> None:
    # White noise of variance 4 every 10 ms: density 0.04; means over more than 1000 values, within 3 deviations.
    rng, dt = np.random.default_rng(2), 0.01
    t = np.arange(60_000) * dt
    found = sample_spectrum(2 * rng.normal(size=len(t)) + np.cos(2 * np.pi * 30 * t), dt, (), 1.0)
    assert found is not None and found.nyquist == 50.0
    quiet = (found.f > 40) & (found.f < 49)
    assert found.density[quiet].mean() == pytest.approx(0.04, rel=0.1)
    assert abs(found.f[found.largest.argmax()] - 30) < 1
    assert sample_spectrum(np.zeros(1000), dt, (), 1.0) is None


MANIFEST = """
data = "run.csv"
[channels]
time = {{ column = "t", unit = "s" }}
gyro = {{ column = "g", unit = "deg/s" }}
[model]
target = "gyro"
declared = ["bias"]
[report]
serial_number = 42
date = {date}
"""


def test_a_manifest_says_who_and_when(tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    path.write_text(MANIFEST.format(date="2026-11-22"))
    assert load_manifest(path).report == Filing("", "42", "", "2026-11-22")
    path.write_text(MANIFEST.format(date="[1]"))
    with pytest.raises(InputError, match=r"report.date = \[1\]; wanted a date or a text"):
        load_manifest(path)
