"""Reports as JSON, by the contract."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_findings import (
    EVERY,
    gyro,
    hidden_in_the_earth_rate,
    not_finite,
    nothing_significant,
    one_target,
    several_targets,
    shown,
)

from insenv.core.errors import InputError
from insenv.effects.base import OUTPUT
from insenv.identify.findings import VERDICTS, Findings
from insenv.report import (
    summary,
    to_json,
    write_html,
    write_json,
)

Make = Callable[[], Findings]
every = pytest.mark.parametrize("make", EVERY.values(), ids=EVERY.keys())


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


@pytest.mark.parametrize("show", [lambda make: summary(make()), lambda make: shown(make)[1]], ids=["text", "page"])
def test_reports_show_the_azimuth_and_its_caution(show: Callable[[Make], str]) -> None:
    text = " ".join(show(hidden_in_the_earth_rate).split())
    assert "Azimuth of the input axis at table angle 0: 40.107 ± 0.006 deg (± 21 arcsec) before" in text
    assert "41 ± 9 deg after" in text
    assert "The azimuth may be off." in text
    assert "No residual shows it: on data that no fit saw" in text
    assert "Azimuth" not in show(one_target)


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
    found, drawn = shown(make)
    for page in (summary(found), drawn, json.dumps(to_json(found))):
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
