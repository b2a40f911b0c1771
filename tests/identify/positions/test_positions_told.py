"""A manifest of positions and what is told of it: every form of report, and what is refused in a sentence."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from attitudes.traced import CALIBRATED, CROOKED, SCALED, names
from positions_cases import (
    ACCELS,
    GYROS,
    Case,
    manifest,
    recording,
    scales,
    tied,
)

from insenv.calibration import calibration
from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import HeldOut, Model, load_manifest
from insenv.data.save import save
from insenv.identify.findings import TargetFindings
from insenv.identify.positions.findings import position_findings
from insenv.identify.positions.trace import trace_positions
from insenv.report.html import to_html
from insenv.report.json import to_json
from insenv.report.text import summary


def saved(tmp_path: Path, run: Recording, model: Model, held_out: HeldOut | None = None) -> Path:
    path = tmp_path / "run.toml"
    save(path, [run], model, title="Simulated", held_out=held_out or HeldOut(positions="even"))
    return path


# ------------------------------------------------------------------------------------------------ command and reports


def test_the_command_reports_it_in_every_form(tmp_path: Path) -> None:
    case = Case(accel=SCALED + CROOKED, gyro=tied(6e-3, -5e-3, 4e-3))
    model = Model(ACCELS + GYROS, (*CALIBRATED, "bias"), procedure="multi-position")
    path = saved(tmp_path, recording(case, 5), model)
    assert load_manifest(path).held_out.positions == "even"
    findings = close(path)
    document = json.loads(json.dumps(to_json(findings), allow_nan=False))
    assert document["verdict"] == "effects-found"
    assert {(a["target"], a["effect"]) for a in document["added"]} == {(t, "non_orthogonality") for t in ACCELS + GYROS}
    assert document["held_out"]["accel_x"]["unit"] == "m/s^2"
    assert document["held_out"]["gyro_x"]["unit"] == "rad"
    for target in ACCELS + GYROS:
        block = document["held_out"][target]
        assert block["after"] < 0.7 * block["before"]
    y = next(a for a in document["added"] if a["target"] == "accel_y")
    assert [p["name"] for p in y["parameters"]] == ["c_x", "c_z"]
    text = summary(findings)
    assert "magnitudes of specific force at rest less gravity" in text and "40 rests" in text
    shown = re.sub(r"<script.*?</script>", "", to_html(findings), flags=re.DOTALL)  # which can draw all there is
    assert "rotations from rest to rest" in shown and "Allan" not in shown


def test_what_was_found_is_taken_out_of_the_whole_triad(tmp_path: Path) -> None:
    case = Case(accel=SCALED + CROOKED, gyro=tied(6e-3, -5e-3, 4e-3) + scales(0.02, 0.01, -0.01))
    run = recording(case, 5)
    (tmp_path / "run.toml").touch()
    model = manifest(ACCELS + GYROS, (*CALIBRATED, "bias"), path=str(tmp_path / "run.toml"))
    found = position_findings(model, (run,), trace_positions(model, (run,)), (), 0.01, 0)
    applied = calibration(found, model).apply(run)
    ideal = recording(replace(case, accel=np.zeros((3, 3)), gyro=np.zeros((3, 3)), accel_bias=(0, 0, 0)), 5)
    for name in ACCELS:
        error = applied.channels[name].values - ideal.channels[name].values
        assert float(np.sqrt(np.mean(error**2))) < 0.01  # of errors of some 0.1 m/s^2
    again = trace_positions(model, (applied,))
    assert again.gyro is not None
    for part in (again.accel, again.gyro, *again.at_rest):
        assert names(part.outcome) == []


def test_found_on_one_gyro_at_rest_alone_is_told_in_its_unit() -> None:
    matrix = np.zeros((3, 3))
    matrix[1] = 1e-4, -5e-5, 0.0
    run = recording(Case(g_sensitivity=matrix), 8)
    model = manifest(GYROS, ("bias",))
    found = position_findings(model, (run,), trace_positions(model, (run,)), (), 0.01, 0)
    x, y, _ = found.targets
    assert y.held_out.unit == "rad/s" and y.verdict == "effects-found"
    assert x.held_out.unit == "rad" and x.verdict == "nothing-significant"
    assert any("attitude from the accelerometers" in remark for remark in found.remarks)
    assert isinstance(y, TargetFindings) and "g-sensitivity" in summary(found)


# ---------------------------------------------------------------------------------------------------- what is refused


def refusal(tmp_path: Path, case: Case, model: Model, held_out: HeldOut | None = None, without: str = "") -> str:
    run = recording(case, 1)
    run = replace(run, channels={n: c for n, c in run.channels.items() if n != without})
    with pytest.raises(InputError) as error:
        close(saved(tmp_path, run, model, held_out))
    text = str(error.value)
    assert "\n" not in text and "run.toml" in text
    return text


def test_without_rests(tmp_path: Path) -> None:
    model = Model(ACCELS, CALIBRATED, procedure="multi-position")
    text = refusal(tmp_path, Case(rests=1, rest_s=20), model)
    assert "one rest found" in text and "several attitudes" in text
    text = refusal(tmp_path, Case(rests=30, rest_s=0.3), model)
    assert "rest found in simulated" in text


def test_with_an_axis_missing(tmp_path: Path) -> None:
    model = Model(ACCELS[:2], CALIBRATED, procedure="multi-position")
    assert "accel_z missing" in refusal(tmp_path, Case(rests=12), model, without="accel_z")
    model = Model(GYROS, ("bias",), procedure="multi-position")
    text = refusal(tmp_path, Case(rests=12), model, without="accel_y")
    assert "accel_y missing" in text and "attitude reference of the gyros" in text


def test_with_too_few_positions(tmp_path: Path) -> None:
    model = Model(ACCELS, CALIBRATED, procedure="multi-position")
    text = refusal(tmp_path, Case(rests=10), model)
    assert "5 rests to fit for 6 declared parameters" in text and "at least 8" in text


def test_with_positions_that_are_not_there(tmp_path: Path) -> None:
    model = Model(ACCELS, CALIBRATED, procedure="multi-position")
    text = refusal(tmp_path, Case(rests=12), model, HeldOut(positions=(3, 13)))
    assert "held_out.positions has 13; there are 12 rests" in text


@pytest.mark.parametrize("key", ["lock_in", "scale_factor", "earth_rate"])
def test_with_a_declared_effect_that_rests_do_not_show(tmp_path: Path, key: str) -> None:
    model = Model(ACCELS, (*CALIBRATED, key), procedure="multi-position")
    text = refusal(tmp_path, Case(rests=20), model)
    assert f"model.declared has {key!r}" in text and "accel_scale_factor" in text


# ----------------------------------------------------------------------------------------------------------- manifest


COUNTS = """
data = "a.csv"
[channels]
time = {{ column = "t", unit = "s" }}
accel_x = {{ column = "x", unit = "0.01 m/s^2", offset = 100 }}
accel_y = {{ column = "y", unit = "m/s^2"{more} }}
[model]
target = "accel_x"
declared = ["bias"]
"""


def counts(tmp_path: Path, more: str = "", rows: int = 3) -> Path:
    (tmp_path / "a.csv").write_text("t,x,y\n0,100,1\n1,200,2\n2,0,3\n")
    (tmp_path / "b.csv").write_text("x,y\n" + "1,7\n" * rows)
    path = tmp_path / "m.toml"
    path.write_text(COUNTS.format(more=more))
    return path


def test_an_offset_is_taken_off_before_the_unit(tmp_path: Path) -> None:
    (run,) = read_recordings(load_manifest(counts(tmp_path)))
    np.testing.assert_allclose(run.channels["accel_x"].values, [0.0, 1.0, -1.0])
    np.testing.assert_allclose(run.channels["accel_y"].values, [1.0, 2.0, 3.0])


def test_a_channel_may_have_a_file_of_its_own(tmp_path: Path) -> None:
    (run,) = read_recordings(load_manifest(counts(tmp_path, ', file = "b.csv"')))
    np.testing.assert_allclose(run.channels["accel_y"].values, [7.0, 7.0, 7.0])
    path = counts(tmp_path, ', file = "b.csv"', rows=2)
    with pytest.raises(InputError, match=r"b\.csv: has 2 rows against 3 in a\.csv"):
        read_recordings(load_manifest(path))


@pytest.mark.parametrize(
    ("positions", "wanted"),
    [('"evn"', "'even'"), ("[]", "counted from 1"), ("[0]", "counted from 1"), ("1.5", "'even'")],
)
def test_positions_that_name_nothing(tmp_path: Path, positions: str, wanted: str) -> None:
    path = counts(tmp_path)
    path.write_text(path.read_text() + f"[held_out]\npositions = {positions}\n")
    with pytest.raises(InputError) as error:
        load_manifest(path)
    assert "held_out.positions" in str(error.value) and wanted in str(error.value)


def test_positions_need_the_procedure(tmp_path: Path) -> None:
    path = counts(tmp_path)
    path.write_text(path.read_text() + '[held_out]\npositions = "even"\n')
    with pytest.raises(InputError, match="multi-position"):
        close(path)


def test_attitudes_in_a_manifest(tmp_path: Path) -> None:
    path = counts(tmp_path)
    text = path.read_text().replace("[model]", '[model]\nprocedure = "multi-position"')
    path.write_text(text + '[positions]\nup = ["+x", "-z", [0, 3, 4]]\ntolerance = "0.1 deg"\n')
    known = load_manifest(path).positions
    assert known is not None and known.tolerance == pytest.approx(np.deg2rad(0.1))
    np.testing.assert_allclose(np.array(known.up), np.array([[1.0, 0, 0], [0, 0, -1], [0, 0.6, 0.8]]))
    for wrong in ('["w"]', "[[0, 0, 0]]", "[[1, 2]]"):
        path.write_text(text + f"[positions]\nup = {wrong}\n")
        with pytest.raises(InputError, match=r"positions.up has .*wanted an axis"):
            load_manifest(path)
    path.write_text(path.read_text().replace("multi-position", "static"))
    with pytest.raises(InputError):
        load_manifest(path)
