"""The explorable report in a real browser: offline, by keyboard, on a telephone, on paper; figures as the engine's."""

from __future__ import annotations

import pickle
import re
import shutil
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rate_test_cases
from click.testing import CliRunner
from made_findings import EVERY, nothing_significant
from made_story import made as made_story
from on_axes_cases import found as unit_found
from on_axes_cases import outputs as unit_outputs
from on_axes_cases import recording as unit_recording
from positions_cases import ACCELS, GYROS, Case, manifest, recording, scales, tied

from insenv import datasets
from insenv.cli import insenv
from insenv.close import close
from insenv.core.lazy import Lazy
from insenv.core.recording import Floats
from insenv.core.unit.motion import UNIT
from insenv.effects.catalogue import by_key
from insenv.identify.findings import Findings, TargetFindings
from insenv.identify.fit.gls import solve
from insenv.identify.fit.heldout import held_out_score
from insenv.identify.positions.evidence import held_out_error
from insenv.identify.positions.findings import position_findings
from insenv.identify.positions.gyros.means import RestMeans, RestTerm
from insenv.identify.positions.least_squares import solve as solve_positions
from insenv.identify.positions.model import triad_term
from insenv.identify.positions.on_axes.offered import offered as offered_of_unit
from insenv.identify.positions.on_axes.trace import UnitFound
from insenv.identify.positions.trace import trace_positions
from insenv.identify.switches import offered
from insenv.rate_test import rate_test
from insenv.report import to_html
from insenv.report.found import as_before
from insenv.report.rate_test.document import to_html as rate_pages
from insenv.report.story_html import to_html as story_page

sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright here: pip install insenv[browser]")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="no axe here: pip install insenv[browser]")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here (Debian: apt install chromium)")

EVIL = "</script><img src=x onerror=evil()><script>evil()</script> {{ 7 * 7 }}"
#: Largest relative difference of held-out errors; of models whose noise the page fits by itself.
SAME, ALIKE = 1e-4, 2e-3


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with sync_api.sync_playwright() as play:
        chromium = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Findings:
    """Two gyros at rest through a slow warming: one follows it, the other steps; 800 rows with a gap."""
    folder, rng = tmp_path_factory.mktemp("explorable"), np.random.default_rng(4)
    t = np.arange(800) * 0.5
    t[500:] += 60.0
    warm = 25 + 8 * np.sin(t / 80)
    x = 1e-4 + 4e-6 * (warm - 25) + rng.normal(0, 2e-5, len(t))
    y = -2e-4 + 6e-5 * (t > 120) + rng.normal(0, 2e-5, len(t))
    head = 't,"x, <b>","y",T </script><script>evil()</script>'.replace('"x, <b>"', "x <b>").replace('"', "")
    np.savetxt(folder / "a.csv", np.column_stack([t, x, y, warm]), delimiter=",", header=head, comments="", fmt="%.12g")
    temperature = head.split(",")[3]
    (folder / "<run>.toml").write_text(f'''
title = "{EVIL.replace('"', "'")}"
data = "a.csv"
[channels]
time = {{ column = "t", unit = "s" }}
gyro_x = {{ column = "x <b>", unit = "rad/s" }}
gyro_y = {{ column = "y", unit = "rad/s" }}
temperature = {{ column = "{temperature}", unit = "degC" }}
[model]
target = ["gyro_x", "gyro_y"]
declared = ["bias"]
[report]
operator = "{EVIL.replace('"', "'")}"
''')
    return close(folder / "<run>.toml", effects=("bias_temperature", "bias_step"))


@pytest.fixture(scope="module")
def path(found: Findings, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(to_html(found), "utf-8")
    return path


class Visit:
    """A page in a context of its own, offline; what it said and asked for."""

    def __init__(self, browser: Any, path: Path, address: str = "", **context: Any) -> None:
        self.said: list[str] = []
        self.asked: list[str] = []
        self.context = browser.new_context(offline=True, **context)
        self.page = self.context.new_page()
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(path.as_uri() + address)
        if "explorer" in path.read_text("utf-8").partition("<main>")[2]:
            self.page.wait_for_selector("html[data-ready]")

    def __enter__(self) -> Visit:
        return self

    def __exit__(self, *error: object) -> None:
        self.context.close()
        assert self.said == [] and len(self.asked) == 1, (self.said, self.asked)

    def axe_finds_nothing(self) -> None:
        """What Deque's axe-core has to say of contrast, names, headings and landmarks."""
        found = axe.Axe().run(self.page)
        assert found.violations_count == 0, found.generate_report()

    def fits_paper(self) -> None:
        """Nothing is cut off at the right of a sheet of A4, which is 182 mm wide between its margins."""
        size = self.page.viewport_size
        self.page.set_viewport_size({"width": 688, "height": 970})
        self.page.emulate_media(media="print")
        assert self.page.evaluate("document.documentElement.scrollWidth") <= 688  # noqa: PLR2004 -- 182 mm
        self.page.emulate_media(media="screen")
        self.page.set_viewport_size(size)

    def rms(self, ident: str) -> float:
        return float(self.page.get_attribute(f"#{ident}-explore", "data-rms"))


def _turn(box: Any) -> None:
    """Turn a switch without the mouse, by which some are: it waits for the page to stand still."""
    box.evaluate("box => box.click()")


def _engine(target: TargetFindings, turned: tuple[int, ...] = ()) -> float:
    """Held-out error of the final model with some switches turned, by the engine."""
    assert isinstance(target.switchable, Lazy)
    track = target.switchable.make.args[0]  # type: ignore[attr-defined]
    terms, switches = offered(track)
    final = [one.role in ("declared", "added") for one in switches]
    model = tuple(term for k, (term, on) in enumerate(zip(terms, final, strict=True)) if on != (k in turned))
    return held_out_score(track.problem, solve(track.problem, model)).rms


def _compare(visit: Visit, found: Findings) -> None:
    """Each switch, and each two that follow each other, give the engine's held-out error."""
    for number, target in enumerate(found.targets, 1):
        ident = f"t{number}"
        if len(found.targets) > 1:
            visit.page.click(f'[role=tab][aria-controls="{ident}"]')
        visit.page.wait_for_selector(f"#{ident}-explore[data-rms]")
        assert visit.rms(ident) == pytest.approx(_engine(target), rel=SAME)
        boxes = visit.page.query_selector_all(f"#{ident}-explore [data-switch]")
        labels = [box.evaluate("e => e.closest('label').textContent") or "" for box in boxes]
        splines = ["spline" in label for label in labels]
        for k, box in enumerate(boxes):
            box.click()
            assert visit.rms(ident) == pytest.approx(_engine(target, (k,)), rel=SAME), (target.target, k)
            if k + 1 < len(boxes):
                _turn(boxes[k + 1])
                expected = _engine(target, (k, k + 1))
                # A curve runs far beyond the data, which hardly tell its coefficients: they are insenv's.
                near = SAME if any(splines[k : k + 2]) else ALIKE
                assert visit.rms(ident) == pytest.approx(expected, rel=near), (target.target, k)
                _turn(boxes[k + 1])
            _turn(box)


def test_every_switch_gives_the_engines_error_on_held_out_data(browser: Any, path: Path, found: Findings) -> None:
    assert {one.effect for target in found.targets for one in target.added} == {"bias_temperature", "bias_step"}
    with Visit(browser, path) as visit:
        _compare(visit, found)
        assert visit.page.evaluate("document.documentElement.dataset.ready") == "yes"


@pytest.fixture(scope="module")
def attitudes() -> Findings:
    """A unit in 32 attitudes: crooked accelerometers, gyros of which each axis has a scale factor of its own."""
    case = Case(rests=32, accel=tied(3e-3, -2e-3, 2.5e-3), gyro=scales(6e-3, -8e-3, 7e-3))
    model, runs = manifest((*GYROS, *ACCELS), ("accel_bias", "accel_scale_factor", "bias")), (recording(case, 3),)
    return position_findings(model, runs, trace_positions(model, runs), (), 0.01, 0)


def _each_set_of_switches(visit: Visit, found: Findings) -> int:
    """In positions every model has the error of a fit of its own; returns how many were compared."""
    count = 0
    for number, target in enumerate(found.targets, 1):
        ident, part = f"t{number}", target.models.make.args[0]  # type: ignore[attr-defined]
        if as_before(target, found.targets):
            assert visit.page.query_selector(f"#{ident}-explore") is None
            continue
        visit.page.click(f'[role=tab][aria-controls="{ident}"]')
        visit.page.wait_for_selector(f"#{ident}-explore[data-rms]")
        assert visit.rms(ident) == pytest.approx(target.held_out.after, rel=SAME)
        boxes = visit.page.query_selector_all(f"#{ident}-explore [data-switch]")
        terms, keys = [], [box.evaluate("e => e.closest('label').querySelector('code').textContent") for box in boxes]
        for key in keys:
            known = {term.effect.key: term for term in part.outcome.after.terms}
            like = RestTerm if isinstance(part.problem, RestMeans) else triad_term
            terms.append(known.get(key) or like(by_key(key)))  # type: ignore[arg-type]
        for on in product((True, False), repeat=len(boxes)):
            wanted = solve_positions(part.problem, [term for term, one in zip(terms, on, strict=True) if one])
            if wanted.freedom < 1:
                continue
            for k in (k for k, box in enumerate(boxes) if box.is_checked() != on[k]):
                _turn(boxes[k])
            error = held_out_error(part.problem, wanted)
            assert visit.rms(ident) == pytest.approx(error, rel=SAME, nan_ok=True), (target.target, keys, on)
            count += 1
    return count


def test_positions_show_each_model_as_the_engine_fits_it(browser: Any, attitudes: Findings, tmp_path: Path) -> None:
    assert {one.effect for target in attitudes.targets for one in target.added} == {"non_orthogonality", "scale_factor"}
    (tmp_path / "positions.html").write_text(to_html(attitudes), "utf-8")
    with Visit(browser, tmp_path / "positions.html", viewport={"width": 390, "height": 800}) as visit:
        assert _each_set_of_switches(visit, attitudes) >= 2 * len(attitudes.targets)
        assert visit.page.evaluate("document.documentElement.scrollWidth") <= 390
        visit.axe_finds_nothing()
        visit.page.click('[role=tab][aria-controls="t4"]')
        visit.page.click("#t4-explore >> text=As found")
        coefficients = visit.page.inner_text("#t4-explore .scroll table")
        assert all(f", accel_{axis}" in coefficients for axis in "xyz") and "NaN" not in coefficients


@pytest.fixture(scope="module")
def on_a_table(tmp_path_factory: pytest.TempPathFactory) -> Findings:
    """A whole unit on a table of three axes: two of them are not at right angles, a gyro feels acceleration."""
    errors = {"axes_zx.angle": 2e-4}
    effects: dict[str, dict[str, tuple[float, ...]]] = {"gyro_y": {"g_sensitivity": (5e-7, 0.0, 0.0)}}
    return unit_found(tmp_path_factory.mktemp("unit"), unit_recording(unit_outputs(errors, effects), seed=3))


@pytest.fixture(scope="module")
def page_of_unit(on_a_table: Findings, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page_of_unit") / "unit.html"
    path.write_text(to_html(on_a_table), "utf-8")
    return path


def _left_of_unit(found: UnitFound, turned: Sequence[int]) -> Floats:
    """Residuals of a whole unit with some switches turned, by the engine."""
    rows = offered_of_unit(found)
    final = [row.switch.role in ("declared", "added") for row in rows]
    fit = solve_positions(found.problem, [row.term for k, row in enumerate(rows) if final[k] != (k in turned)])
    return found.problem.raw(fit.residual)


def _of_channel(found: UnitFound, name: str, left: Floats) -> float:
    """Held-out error of a channel."""
    channel = np.concatenate([np.full(len(part.means), part.channel) for part in found.problem.cells])
    used = found.problem.held_out & (channel == UNIT.index(name))
    return float(np.sqrt(np.mean(left[used] ** 2)))


def test_a_unit_on_a_table_gives_the_engines_error_of_each_channel(
    browser: Any, on_a_table: Findings, page_of_unit: Path
) -> None:
    added = {one.effect for target in on_a_table.targets for one in target.added}
    assert added == {"axis_non_orthogonality", "g_sensitivity"}
    assert len(page_of_unit.read_bytes()) <= 1_000_000
    left: dict[tuple[int, ...], Floats] = {}
    with Visit(browser, page_of_unit, viewport={"width": 390, "height": 800}) as visit:
        for number, target in enumerate(on_a_table.targets, 1):
            ident, was = f"t{number}", target.held_out
            unit, name = target.unit_switchable.make.args  # type: ignore[attr-defined]
            visit.page.click(f'[role=tab][aria-controls="{ident}"]')
            visit.page.wait_for_selector(f"#{ident}-explore[data-rms]")
            assert visit.rms(ident) == pytest.approx(was.after, rel=SAME)
            visit.page.click(f"#{ident}-explore >> text=Declared only")
            assert visit.rms(ident) == pytest.approx(was.before, rel=SAME)
            visit.page.click(f"#{ident}-explore >> text=As found")
            boxes = visit.page.query_selector_all(f"#{ident}-explore [data-switch]")
            order = [int(box.get_attribute("data-switch")) for box in boxes]
            assert len(boxes) >= 10
            for turned in [*((k,) for k in range(len(boxes))), *((k, k + 1) for k in range(0, len(boxes) - 1, 3))]:
                for k in turned:
                    _turn(boxes[k])
                switches = tuple(order[k] for k in turned)
                if switches not in left:
                    left[switches] = _left_of_unit(unit, switches)
                error = _of_channel(unit, name, left[switches])
                assert visit.rms(ident) == pytest.approx(error, rel=SAME), (name, switches)
                for k in turned:
                    _turn(boxes[k])
        assert visit.page.evaluate("document.documentElement.scrollWidth") <= 390
        visit.axe_finds_nothing()


def test_what_is_switched_of_a_unit_holds_on_every_tab(browser: Any, on_a_table: Findings, page_of_unit: Path) -> None:
    gyro, accel = on_a_table.targets[0], on_a_table.targets[3]
    with Visit(browser, page_of_unit) as visit:
        visit.page.click("#t1-explore >> text=Declared only")
        assert visit.rms("t1") == pytest.approx(gyro.held_out.before, rel=SAME)
        visit.page.click('[role=tab][aria-controls="t4"]')
        visit.page.wait_for_selector("#t4-explore[data-rms]")
        assert visit.rms("t4") == pytest.approx(accel.held_out.before, rel=SAME)
        visit.page.click("#t4-explore >> text=Copy as [held_out]")
        rests = tomllib.loads(visit.page.input_value("#t4-explore textarea"))["held_out"]["positions"]
        assert rests == list(range(1, 27))
        visit.page.click("#t4-explore >> text=As found")
        coefficients = visit.page.inner_text("#t4-explore .scroll table")
        assert "axes_zx.angle" in coefficients and "NaN" not in coefficients and "g-sensitivity" not in coefficients


def test_pickled_findings_give_the_same_page(found: Findings, path: Path) -> None:
    assert to_html(pickle.loads(pickle.dumps(found))) == path.read_text("utf-8")


def test_names_from_files_are_texts(browser: Any, path: Path) -> None:
    with Visit(browser, path) as visit:
        assert visit.page.inner_text("h1") == EVIL
        assert visit.page.query_selector("img") is None
        assert visit.page.evaluate("typeof evil") == "undefined"


def test_everything_is_reached_by_keyboard_and_kept_in_the_address(browser: Any, path: Path, found: Findings) -> None:
    with Visit(browser, path) as visit:
        page = visit.page
        page.focus("[role=tab][aria-selected=true]")
        page.keyboard.press("ArrowRight")
        page.wait_for_selector("#t2-explore[data-rms]")
        assert page.is_hidden("#t1") and page.get_attribute("[role=tab] >> nth=1", "aria-selected") == "true"
        page.focus("#t2-explore [data-switch]")
        page.keyboard.press("Space")
        page.focus("#t2-explore .plot[tabindex]")
        for key in ("ArrowRight", "ArrowRight", "+"):
            page.keyboard.press(key)
        assert "this model" in page.inner_text("#t2-explore .readout")
        page.click("#t2-explore >> text=Copy as [held_out]")
        rows = tomllib.loads(page.input_value("#t2-explore textarea"))["held_out"]["rows"]
        assert rows and all(0 <= first < end <= 800 for first, end in rows)
        page.click("#t2-explore >> text=Copy as CSV")
        lines = page.input_value("#t2-explore textarea").splitlines()
        assert lines[0].startswith("run,time [s],declared model") and len({line.count(",") for line in lines}) == 1
        address, error = page.evaluate("location.hash"), visit.rms("t2")
    with Visit(browser, path, address) as visit:
        assert visit.page.is_visible("#t2") and visit.rms("t2") == error
        assert error == pytest.approx(_engine(found.targets[1], (0,)), rel=SAME)
        assert visit.page.evaluate("location.hash") == address


def test_a_telephone_the_dark_and_paper(browser: Any, path: Path, tmp_path: Path) -> None:
    plain = tmp_path / "plain.html"
    plain.write_text(to_html(nothing_significant()), "utf-8")
    for place in (path, plain):
        with Visit(browser, place, viewport={"width": 390, "height": 800}, color_scheme="dark") as visit:
            assert visit.page.evaluate("document.documentElement.scrollWidth") <= 390
            visit.axe_finds_nothing()
            assert visit.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(20, 24, 29)"
            visit.page.emulate_media(media="print", color_scheme="dark")
            assert visit.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
            visit.fits_paper()
            visit.page.emulate_media(media="print", color_scheme="dark")
            for section in visit.page.query_selector_all("section[data-target]"):
                assert section.is_visible() and section.query_selector("figure svg").is_visible()
            for explorer in visit.page.query_selector_all(".explorer"):
                assert explorer.is_hidden()


def test_other_pages_fit_a_telephone_and_have_nothing_to_complain_of(browser: Any, tmp_path: Path) -> None:
    """No horizontal scroll at 390 px; a `Visit` fails where the console says anything or a request is made."""
    test = rate_test(rate_test_cases.write(tmp_path))
    pages = {"two rate tests": rate_pages([test, test]), "not finite": to_html(EVERY["not finite"]())}
    for name, text in pages.items():
        (tmp_path / "page.html").write_text(text, "utf-8")
        with Visit(browser, tmp_path / "page.html", viewport={"width": 390, "height": 800}) as visit:
            assert visit.page.evaluate("document.documentElement.scrollWidth") <= 390, name
            visit.axe_finds_nothing()
            visit.fits_paper()


@pytest.mark.slow  # a design is searched for
@pytest.mark.parametrize("kind", ["leaderboard", "design", "story"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_of_evaluation_design_and_story_in_both_themes(
    browser: Any, kind: str, scheme: str, tmp_path: Path, written: Mapping[str, str]
) -> None:
    (tmp_path / "page.html").write_text(written[kind], "utf-8")
    for width in (390, 1200):
        with Visit(
            browser, tmp_path / "page.html", viewport={"width": width, "height": 800}, color_scheme=scheme
        ) as visit:
            assert visit.page.evaluate("document.documentElement.scrollWidth") <= width
            visit.axe_finds_nothing()
            visit.fits_paper()
            drawings = visit.page.query_selector_all(".drawing svg")
            assert drawings and all(one.bounding_box()["width"] >= 500 for one in drawings)  # legible, moved by finger


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, str]:
    """Pages of other commands."""
    folder = tmp_path_factory.mktemp("written")
    plug_ins = ["--estimator", "north_gls,revolution", "--policy", "constant_rate"]
    judged = ["evaluate", "--env", "NorthFinder", *plug_ins, "--seeds", "2", "--html", str(folder / "leaderboard")]
    best = ["design", "north_finder/published", "--time", "100 s", "--no-verify", "--html", str(folder / "design")]
    for arguments in (judged, best):
        CliRunner().invoke(insenv, arguments, catch_exceptions=False)
    pages = {name: (folder / name).read_text("utf-8") for name in ("leaderboard", "design")}
    return {**pages, "story": story_page(made_story())}


def test_without_script_the_pictures_are_there(browser: Any, path: Path) -> None:
    context = browser.new_context(offline=True, java_script_enabled=False)
    page = context.new_page()
    page.goto(path.as_uri())
    assert page.is_visible("#t1 figure svg") and page.is_visible("#t2 figure svg") and page.is_hidden("#t1-explore")
    context.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("psins_lasergyro", 500_000),
        ("tofupilot_thermal", 1_000_000),
        ("ln100_updown", 1_000_000),
        ("imu_tk", 1_000_000),
        ("mikoff_imu0", 1_000_000),
        ("imucal", 1_000_000),
    ],
)
def test_measured_recordings(browser: Any, tmp_path: Path, name: str, most: int) -> None:
    if datasets.locate(name) is None:
        pytest.skip(f"{name} is not here: insenv datasets --fetch {name}")
    found = close(name)
    text = to_html(found)
    assert len(text.encode()) <= most
    (tmp_path / "page.html").write_text(text, "utf-8")
    assert re.search(r'class="explorer"', text)
    with Visit(browser, tmp_path / "page.html") as visit:
        _compare(visit, found) if found.procedure != "multi-position" else _each_set_of_switches(visit, found)
