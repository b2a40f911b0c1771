"""`insenv rate-test`: the evaluation of files, streamed, and its reports."""

from __future__ import annotations

import json
import re
import tracemalloc
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import rate_test_cases as case
from command import run
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from insenv.core.errors import InputError
from insenv.core.files import json_text
from insenv.core.rate_test import NORMALISATIONS, RateTest
from insenv.core.recording import Floats
from insenv.core.units import DEG, DEG_PER_HOUR
from insenv.data import stream
from insenv.data.load import read_recordings
from insenv.data.manifest import Manifest, load_manifest
from insenv.data.stream import stream_run
from insenv.rate_test import rate_test
from insenv.report.rate_test import rows
from insenv.report.rate_test.document import summary, to_html, to_json

FORMS = ("npz", "csv", "float64-le")


@pytest.fixture(scope="module")
def test(tmp_path_factory: pytest.TempPathFactory) -> RateTest:
    return rate_test(case.write(tmp_path_factory.mktemp("rate")))


def short_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "ROWS", 1000)
    monkeypatch.setattr(stream, "BYTES", 20_000)


# ---------------------------------------------------------------------------------------------------- evaluation


def test_the_fault_is_flagged_and_the_truth_is_found(test: RateTest) -> None:
    assert test.line is not None and test.static is not None
    assert sorted(round(f.rate / DEG) for f in test.line.flagged) == [-20, 20]
    fit = test.line.fit("without flagged")
    assert abs(fit.scale_factor.value - 1 - 0.5e-5) < 5 * fit.scale_factor.sd  # false alarm 6e-7
    assert test.line.fit("all points").nonlinearity["largest_output"].value > 5e-4
    assert len(test.line.of_each("all points")) == 2
    # The third file alone is at rest: its bias is 7 deg/h; those of the power-ups are 5, 6 and 7.
    assert abs(test.static.bias.value - 7 * DEG_PER_HOUR) < 5 * test.static.bias.sd
    assert len(test.bias_of_power_ups) == 3


def test_without_the_fault_nothing_is_flagged(tmp_path: Path) -> None:
    line = rate_test(case.write(tmp_path, fault=False)).line
    assert line is not None and not line.flagged


@pytest.mark.parametrize("form", FORMS)
def test_long_files_are_read_in_chunks_with_the_same_result(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = case.write(tmp_path, form=form, power_ups=1)
    whole = rate_test(path)
    short_chunks(monkeypatch)
    manifest = load_manifest(path)
    chunks = list(stream_run(manifest, manifest.runs[0]))
    assert len(chunks) > 3
    parts = rate_test(path)
    assert whole.line is not None and parts.line is not None
    for name in ("all points", "robust"):
        a, b = whole.line.fit(name), parts.line.fit(name)
        assert b.scale_factor.value == pytest.approx(a.scale_factor.value, rel=1e-10)
        assert b.bias.value == pytest.approx(a.bias.value, rel=1e-8)
    assert parts.static is not None and whole.static is not None
    assert parts.static.bias.value == pytest.approx(whole.static.bias.value, rel=1e-10)


@pytest.mark.parametrize("form", FORMS)
def test_chunks_hold_what_is_read_in_one(form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    manifest = load_manifest(case.write(tmp_path, form=form, power_ups=1))
    short_chunks(monkeypatch)
    shares: list[float] = []
    for run_, one in zip(manifest.runs, read_recordings(manifest), strict=True):
        chunks = list(stream_run(manifest, run_, shares.append))
        assert np.concatenate([c.t for c in chunks]) == pytest.approx(one.t, abs=1e-12)
        for name in one.channels:
            values = np.concatenate([c.channels[name].values for c in chunks])
            assert values == pytest.approx(one.channels[name].values, rel=1e-12), name
    assert max(shares) == 1.0 and min(shares) > 0


def test_a_wrapped_angle_goes_on_from_chunk_to_chunk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = case.write(tmp_path, power_ups=1)
    for file in tmp_path.glob("*.npz"):
        held = dict(np.load(file))
        held["angle"] = np.mod(held["angle"], 360.0)
        np.savez(file, **held)
    path.write_text(path.read_text().replace('unit = "deg" }', 'unit = "deg", wrapped = true }'))
    manifest = load_manifest(path)
    one = read_recordings(manifest)[0].channels["table_angle"].values
    short_chunks(monkeypatch)
    chunks = list(stream_run(manifest, manifest.runs[0]))
    assert np.concatenate([c.channels["table_angle"].values for c in chunks]) == pytest.approx(one, abs=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_a_fault_far_down_a_file_is_named_with_its_place(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = case.write(tmp_path, form=form, power_ups=1)
    file = next(tmp_path.glob("test_1.*"))
    if form == "csv":
        lines = file.read_text().split("\n")
        lines[3000] = "150.0,broken,0.0"
        file.write_text("\n".join(lines))
    elif form == "npz":
        held = dict(np.load(file))
        held["gyro"][2999] = np.nan
        np.savez(file, **held)
    else:
        rows = np.fromfile(file).reshape(-1, 3)
        rows[2999, 1] = np.nan
        rows.tofile(file)
    short_chunks(monkeypatch)
    with pytest.raises(InputError, match="line 3001" if form == "csv" else "row 2999"):
        rate_test(path)


@pytest.mark.parametrize("form", FORMS)
def test_memory_does_not_grow_with_the_recording(form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    short_chunks(monkeypatch)
    peaks = []
    for turns in (0, 1, 12):  # the first compiles and imports
        path = case.write(tmp_path / str(turns), form=form, power_ups=1, rates=(1 + turns) * (10.0, -10.0), fault=False)
        tracemalloc.start()
        try:
            rows = rate_test(path).rows
            peaks.append((rows, tracemalloc.get_traced_memory()[1]))
        finally:
            tracemalloc.stop()
    (_, _), (few, low), (many, high) = peaks
    assert many > 2 * few
    # A mean for each second stays, four numbers: a twentieth of the rows here, of 27 hours at 2000 Hz three megabytes.
    assert high - low < 8 * (many - few)


def test_a_test_at_rest_alone_has_no_line(tmp_path: Path) -> None:
    path = case.write(tmp_path, power_ups=0)
    found = rate_test(path)
    assert found.line is None and found.static is not None
    assert "no scale-factor line" in found.remarks[0]
    assert "Bias at rest" in to_html([found]) and "Scale factor" not in to_html([found])
    path.write_text(re.sub("table_angle.*", "", path.read_text()))
    untold = rate_test(path)
    assert untold.static is not None and untold.remarks[0].startswith("No channel tells the table's rate")


# ------------------------------------------------------------------------------------------------------- reports


class _Reader(HTMLParser):
    """Open elements and what the page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.fetched: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "br", "img"):
            self.open.append(tag)
        self.fetched += [v or "" for k, v in attrs if k in ("src", "href", "xlink:href")]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.fetched += [v or "" for k, v in attrs if k in ("src", "href", "xlink:href")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_whole_and_fetches_nothing(test: RateTest) -> None:
    page = to_html([test, test])
    reader = _Reader()
    reader.feed(page)
    assert not reader.open
    assert all(target.startswith(("#", "data:")) for target in reader.fetched)
    for words in (
        *NORMALISATIONS.values(),
        "Instruments side by side",
        "Rule, stated beforehand",
        "Earth rate removed",
    ):
        assert words in page
    assert page.count("<svg") == 2 * 3 + 1
    assert "nan" not in re.sub("<svg.*?</svg>|<style>.*?</style>", "", page, flags=re.DOTALL).lower()


def test_texts_from_a_file_are_escaped(tmp_path: Path) -> None:
    path = case.write(tmp_path, power_ups=0)
    path.write_text(path.read_text().replace('title = "test"', 'title = "<b>&"'))
    assert "<b>&" not in to_html([rate_test(path)])


def test_json_holds_the_result_in_si_units(test: RateTest) -> None:
    held = json.loads(json_text(to_json([test])))
    assert held == to_json([test])
    assert held["schema"] == "insenv.rate-test/1"
    one, line = held["instruments"][0], test.line
    assert line is not None
    assert one["line"]["fits"][0]["scale_factor"]["value"] == line.fits[0].scale_factor.value
    assert len(one["line"]["dwells"]) == len(line.dwells)
    assert one["line"]["flagged"][0]["rate"] == line.flagged[0].rate
    assert one["static"]["earth_note"].startswith("Earth rate removed")


def test_the_comparison_has_a_column_for_each_instrument(test: RateTest) -> None:
    grid = rows.comparison([test, test, test])
    assert len(grid.head) == 4 and all(len(row) == 4 for row in grid.rows)
    assert {"scale-factor repeatability [ppm]", "bias repeatability [deg/h]"} <= {row[0] for row in grid.rows}
    assert "flagged -20, +20 deg/s" in summary([test])


# ------------------------------------------------------------------------------------------------------ the command


def test_the_command_writes_both_reports(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = case.write(tmp_path / "a", "one", power_ups=1), case.write(tmp_path / "b", "two", power_ups=0)
    page, data = tmp_path / "r.html", tmp_path / "r.json"
    ended = run(
        capsys, monkeypatch, "rate-test", first, second, "--html", page, "--json", data, "--averaging", "0.3 s, 7 s"
    )
    assert (ended.status, ended.err) == (0, "")
    assert "one" in ended.out and "two" in ended.out and str(page) in ended.out
    assert page.read_text().startswith("<!DOCTYPE html>")
    held = json.loads(data.read_text())["instruments"]
    assert [i["title"] for i in held] == ["one", "two"]
    assert [s["averaging"] for s in held[1]["static"]["stability"]] == pytest.approx([0.05, 0.3, 7.0])


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        (("gyro_1", "gyro_1"), None),
        (('target = "gyro"', 'target = "accel_x"'), "accel_x"),
        (('unit = "deg" }', 'unit = "kg" }'), "kg"),
        (("test_2.npz", "gone.npz"), "no such data file"),
        (('"gyro", unit', '"gyros", unit'), "gyros"),
        (("[site]", "[sight]"), "sight"),
        (('target = "gyro"', 'target = ["gyro", "gyro"]'), "gyro"),
        (("declared", "declard"), "did you mean 'declared'"),
        (('tilt = "90 deg"', 'tilt = "0 deg"'), "sees nothing of its turning"),
        (("gyro = {", 'power = { column = "gyro" }\ngyro = {'), "wanted the number of the power-up"),
        (
            ("gyro = {", 'segment = { column = "gyro" }\ngyro = {'),
            "neither two rates of the table nor a second at rest",
        ),
        (("test_2.npz", "empty.npz"), "empty.npz"),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_is_written(
    change: tuple[str, str],
    wanted: str | None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = case.write(tmp_path, power_ups=1)
    path.write_text(path.read_text().replace(*change))
    (tmp_path / "empty.npz").touch()
    page = tmp_path / "r.html"
    ended = run(capsys, monkeypatch, "rate-test", path, "--html", page)
    if wanted is None:
        assert ended.status == 0
        return
    assert ended.status == 2
    assert ended.err.startswith("insenv: ") and ended.err.count("\n") == 1 and wanted in ended.err
    assert not page.exists() and not list(tmp_path.glob(".*.part"))


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (("--warm-up", "3 kg"), "--warm-up"),
        (("--warm-up=-3 s",), "warm_up"),
        (("--zeros", "some"), "zeros"),
        (("--averaging", "1 s, 2 kg"), "--averaging"),
        (("--averaging", ""), "--averaging"),
        (("nope.toml",), "nope.toml: the manifest cannot be read"),
        ((".",), ".: the manifest cannot be read"),
        (("--averaging", "1 s, -2 s"), "averaging"),
        (("--html", "nowhere/r.html"), "does not exist"),
        (("--html", "r.x", "--json", "r.x"), "two files"),
    ],
)
def test_bad_options_are_one_sentence(
    arguments: tuple[str, ...],
    wanted: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = run(capsys, monkeypatch, "rate-test", case.write(tmp_path, power_ups=1), *arguments)
    assert ended.status == 2
    assert ended.err.count("\n") == 1 and wanted in ended.err
    assert not list(tmp_path.glob("r.*"))


def test_a_run_at_another_rate_is_refused(tmp_path: Path) -> None:
    path = case.write(tmp_path, power_ups=1)
    file = tmp_path / "test_2.npz"
    held = dict(np.load(file))
    np.savez(file, **{**held, "t": 2 * held["t"]})
    with pytest.raises(InputError, match="one sampling rate"):
        rate_test(path)


@given(at=st.integers(0, 3000), byte=st.binary(min_size=1, max_size=4), form=st.sampled_from(FORMS))
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_is_read_in_chunks_as_in_one_or_refused_alike(
    at: int, byte: bytes, form: str, small: dict[str, bytes], tmp_path: Path
) -> None:
    path = case.write(tmp_path, form=form, power_ups=0)
    manifest = load_manifest(path)
    file = manifest.runs[0].file
    whole = small.setdefault(form, file.read_bytes())
    place = at * len(whole) // 3000
    file.write_bytes(whole[:place] + byte + whole[place + len(byte) :])
    with pytest.MonkeyPatch.context() as patch:
        short_chunks(patch)
        one, many = (_outcome(lambda r=r: r(manifest)) for r in (_in_one, _in_chunks))  # type: ignore[misc]
    if isinstance(one, str) or isinstance(many, str):
        assert isinstance(one, str) == isinstance(many, str), (one, many)
    else:
        assert many == pytest.approx(one, rel=1e-12, abs=1e-12)


@pytest.fixture(scope="module")
def small() -> dict[str, bytes]:
    return {}


def _in_one(manifest: Manifest) -> Floats:
    return read_recordings(manifest)[0].channels["gyro"].values


def _in_chunks(manifest: Manifest) -> Floats:
    return np.concatenate([c.channels["gyro"].values for c in stream_run(manifest, manifest.runs[0])])


def _outcome(read: Callable[[], Floats]) -> Floats | str:
    try:
        return read()
    except InputError as error:
        return str(error)
