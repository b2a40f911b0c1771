"""The loop on a whole unit on a table whose axes are read: errors of the table, of the seat and of the instruments."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from on_axes_cases import DECLARED, DWELL, RATE, TABLE, Path3, found, outputs, proposed, recording, six_positions, usual

from insenv.core.errors import InputError
from insenv.core.recording import Channel, Mounting, Recording, Site
from insenv.core.unit.motion import UNIT
from insenv.data.manifest import HeldOut, Model, load_manifest
from insenv.data.save import save
from insenv.effects.base import Param
from insenv.identify.positions.on_axes.problem import Cause, Cells, OnAxes, Share, UnitTerm
from insenv.identify.positions.on_axes.terms import candidates
from insenv.identify.positions.on_axes.trace import as_means
from insenv.identify.positions.search import search

#: Errors of the table, effects of channels, and the effect that is to be named.
CAUSES: dict[str, tuple[dict[str, float], dict[str, dict[str, tuple[float, ...]]]]] = {
    "axis_non_orthogonality": ({"axes_zx.angle": 2e-4}, {}),
    "encoder_eccentricity": ({"encoder_x2.c": 2e-4}, {}),
    "size_effect": ({}, {"accel_x": {"size_effect": (0.1, 0.0, 0.3)}}),
    "g_sensitivity": ({}, {"gyro_y": {"g_sensitivity": (5e-7, 0.0, 0.0)}}),
}


@pytest.mark.parametrize("cause", CAUSES)
def test_one_undeclared_cause_is_named_and_lessens_the_held_out_error(tmp_path: Path, cause: str) -> None:
    findings = found(tmp_path, recording(outputs(*CAUSES[cause]), seed=3))
    added = {a.effect: a for target in findings.targets for a in target.added}
    assert list(added) == [cause] and findings.verdict in ("effects-found", "confounded")
    ratios = [t.held_out.after / t.held_out.before for t in findings.targets]
    assert min(ratios) < 0.95 and max(ratios) < 1.05
    wrong, effects = CAUSES[cause]
    for name, size in wrong.items():
        row = next(p for p in added[cause].parameters if p.parameter == name)
        assert abs(row.value - size) < 5 * row.sd < 0.3 * abs(size)


def test_a_seat_far_off_what_is_stated_is_told_though_rests_know_it_far_better_than_that(tmp_path: Path) -> None:
    """Seven times the stated deviation, which takes all of it: it was said that no attitudes tell it."""
    target = found(tmp_path, recording(outputs({"mounting.x": 2e-3}, {}), seed=3)).targets[0]
    (one,) = target.added
    assert (one.effect, target.verdict) == ("unit_mounting", "effects-found")
    row = next(p for p in one.parameters if p.parameter == "mounting.x")
    assert abs(row.value - 2e-3) < 5 * row.sd < 2e-3


def test_an_error_far_beyond_its_stated_deviation_is_named_though_the_rests_follow_it() -> None:
    # With 10 deviations of 3 arcsec the table's error follows the data, held-out ones too: by their error, a toss-up,
    # a third of these were refused. One in 44 is against it by two deviations: three of twelve in 2 of 1000 tests.
    cause = Cause("table", "axis_non_orthogonality", (Param("angle", "rad", 1e-3),))
    angle = UnitTerm(cause, (0,), ((Share("", "axes_xz.angle", "rad"),),))
    rng, named = np.random.default_rng(18), []
    for size in (0.0, 1.5e-4):
        for _ in range(12):
            column, held = rng.normal(size=(160, 1)), np.arange(160) % 4 == 3
            means, rest = size * column[:, 0] + 5e-6 * rng.normal(size=160), np.arange(160) // 4
            noise, still = 2.5e-11 * np.eye(160), np.zeros(160, bool)
            cells = Cells(3, column, column.copy(), means, noise, np.arange(160.0), 0, still, held, rest)
            problem = OnAxes((cells,), (1.0,), np.array([1.5e-5]))
            named.append(bool(search(problem, [], [angle], 1e-4, at_once=1).steps))
    assert not any(named[:12]) and sum(named[12:]) >= 10


def test_a_unit_that_slips_is_told_with_the_time(tmp_path: Path) -> None:
    early, late = outputs({}, {}), outputs({"mounting.x": 2e-4, "mounting.z": -1e-4}, {})
    slipped = {
        name: np.where(np.arange(len(v)) < 12 * 17 * RATE + 13 * RATE, v, late[name]) for name, v in early.items()
    }
    findings = found(tmp_path, recording(slipped, seed=1))
    (one,) = findings.targets[0].added
    assert one.effect == "mounting_shift" and f"from {12 * 17 + DWELL} s on" in one.remark
    assert one.parameters[0].value == pytest.approx(2e-4, abs=5 * one.parameters[0].sd)


def test_a_unit_that_slips_again_and_again_is_a_doubt(tmp_path: Path) -> None:
    """Beside the eccentricity of an encoder nine slips were stated."""
    runs = [
        outputs({"mounting.x": x, "mounting.z": z}, {}) for x, z in ((0, 0), (2e-4, 0), (-2e-4, 2e-4), (2e-4, -2e-4))
    ]
    part = np.minimum(np.arange(len(runs[0]["gyro_x"])) // (8 * 17 * RATE), 3)
    slipped = {name: np.choose(part, [one[name] for one in runs]) for name in runs[0]}
    target = found(tmp_path, recording(slipped, seed=1)).targets[0]
    assert [one.effect for one in target.added].count("mounting_shift") > 2
    assert target.verdict == "effects-found-incomplete"
    assert any("no mounting slips so often" in reason for reason in target.reasons)


def test_what_is_confounded_is_settled_by_the_run_that_is_proposed(tmp_path: Path) -> None:
    """At right angles a force is 0 or g: its square and its magnitude are the same."""
    bent: dict[str, dict[str, tuple[float, ...]]] = {"accel_y": {"accel_second_order": (9e-6,)}}
    first = recording(outputs({}, bent, usual(False)), 5, usual(False))
    one = found(tmp_path, first).targets[4]
    assert one.verdict == "confounded"
    assert {one.added[0].effect, *one.added[0].confounded_with} == {"accel_second_order", "accel_asymmetry"}
    best = one.next_experiment[0]
    assert best.procedure.startswith("half-way") and (best.expected_separation_sigma or 0) > 5
    path = proposed(best.procedure)
    second = recording(outputs({}, bent, path), 6, path, label="half-way")
    both = found(tmp_path, first, second).targets[4]
    assert both.verdict == "effects-found"
    assert [(a.effect, a.confounded_with) for a in both.added] == [("accel_second_order", ())]


def test_what_is_confounded_is_settled_by_the_unit_remounted(tmp_path: Path) -> None:
    """Turned by 90 deg about its z, and seated anew, by another small rotation."""
    bent: dict[str, dict[str, tuple[float, ...]]] = {"accel_y": {"accel_asymmetry": (1.5e-4,)}}
    first = recording(outputs({}, bent, usual(False)), 5, usual(False))
    one = found(tmp_path, first).targets[4]
    assert one.verdict == "confounded" and one.added[0].confounded_with == ("accel_second_order",)
    (remounted,) = [each for each in one.next_experiment if "mounted = 90 deg" in each.procedure]
    assert (remounted.expected_separation_sigma or 0) > 4
    path, turned = proposed(remounted.procedure), replace(TABLE, mounted=np.pi / 2)
    again = outputs({"mounting.x": 1e-4}, bent, path, turned)
    second = recording(again, 6, path, label="remounted", mounting=Mounting(gimbals=turned))
    both = found(tmp_path, first, second).targets[4]
    assert both.verdict == "effects-found"
    assert [(a.effect, a.confounded_with) for a in both.added] == [("accel_asymmetry", ())]


@pytest.mark.parametrize(
    ("cause", "wrong", "effects"),
    [
        ("encoder_eccentricity", {"encoder_x2.c": 2e-4}, {}),
        ("g_sensitivity", {}, {"gyro_z": {"g_sensitivity": (5e-7, 0.0, 0.0)}}),
    ],
)
def test_a_cause_of_which_six_positions_tell_a_part_is_named(
    tmp_path: Path, cause: str, wrong: dict[str, float], effects: dict[str, dict[str, tuple[float, ...]]]
) -> None:
    """Where the outer axis rests, its encoder shows nothing; those of the others do."""
    path = six_positions()
    findings = found(tmp_path, recording(outputs(wrong, effects, path), 5, path))
    assert {a.effect for target in findings.targets for a in target.added} == {cause}


def test_axes_that_turn_at_once_are_refused(tmp_path: Path) -> None:
    path: Path3 = [(0.0, 0.0, 0.0), (0.0, 1.0, 1.0), (0.0, 0.0, 1.0)]
    with pytest.raises(InputError, match="two axes turn at once, at .* wanted one axis after the other"):
        found(tmp_path, recording(outputs({}, {}, path), 1, path))


def test_a_unit_that_is_remounted_is_turned_about_its_z() -> None:
    turned, errors = replace(TABLE, mounted=np.pi / 2), np.zeros(len(TABLE.names))
    errors[0] = 1e-3
    vector = (np.array([1.0]), np.array([2.0]), np.array([3.0]))
    x, y, z = TABLE.inside(vector, np.zeros((3, 1)), np.zeros(len(TABLE.names)))
    again = turned.inside(vector, np.zeros((3, 1)), errors)
    np.testing.assert_allclose(np.ravel(again), np.ravel([y, -x + 1e-3 * z, z + 1e-3 * x]), atol=1e-5)


def test_a_whole_model_lacks_nothing(tmp_path: Path) -> None:
    """False alarm: 1 %."""
    whole: dict[str, dict[str, tuple[float, ...]]] = {
        "gyro_x": {"bias": (1e-5,), "scale_factor": (2e-4,), "misalignment": (0.0, 1e-4, 0.0)},
        "accel_z": {"accel_bias": (1e-3,), "accel_scale_factor": (-3e-4,)},
    }
    findings = found(tmp_path, recording(outputs({"mounting.y": 2e-4, "base.tilt_x": 3e-5}, whole), seed=2))
    assert findings.verdict == "nothing-significant"
    row = next(e for e in findings.targets[0].estimates_after if e.effect == "scale_factor")
    assert abs(row.value - 2e-4) < 4 * row.sd < 1e-4


def test_the_axes_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    run = recording(outputs({}, {}), seed=0)
    save(tmp_path / "unit.toml", [run], Model(UNIT, DECLARED, procedure="multi-position"))
    read = load_manifest(tmp_path / "unit.toml").runs[0].mounting.gimbals
    assert read == TABLE
    run = replace(run, mounting=Mounting(gimbals=replace(TABLE, mounted=0.5)))
    save(tmp_path / "unit.toml", [run], Model(UNIT, DECLARED, procedure="multi-position"))
    assert load_manifest(tmp_path / "unit.toml").runs[0].mounting == run.mounting


def test_what_the_axes_cannot_do_is_said(tmp_path: Path) -> None:
    run = recording(outputs({}, {}), seed=0)
    with pytest.raises(InputError, match="gravity"):
        found(tmp_path, replace(run, site=Site()))
    with pytest.raises(InputError, match="timing_skew"):
        found(tmp_path, run, declared=(*DECLARED, "timing_skew"))
    with pytest.raises(InputError, match="there are 27 rests|there are 26 rests"):
        found(tmp_path, run, held_out=HeldOut(positions=(40,)))


def test_the_whole_of_cross_coupling_or_its_parts_are_tried() -> None:
    def tried(declared: tuple[str, ...]) -> set[str]:
        return {t.effect.key for t in candidates(declared, TABLE, (), None, False).tried}

    assert "gyro.cross_axis" in tried(("bias",)) and "gyro.misalignment" not in tried(("bias",))
    assert "gyro.non_orthogonality" in tried(("misalignment",)) and "gyro.cross_axis" not in tried(("misalignment",))


def test_rows_and_times_that_are_held_out_hold_out_their_rests(tmp_path: Path) -> None:
    one = recording(outputs({}, {}), seed=1)
    rest = (DWELL + 5) * RATE
    for held_out in (HeldOut(rows=((20 * rest, 26 * rest),)), HeldOut(start=20.0 * rest / RATE)):
        by_row = found(tmp_path, one, held_out=held_out)
        by_name = found(tmp_path, one, held_out=HeldOut(positions=tuple(range(21, 27))))
        assert by_row.targets[0].held_out == by_name.targets[0].held_out


def test_readings_at_an_instant_are_made_means_of_their_rows() -> None:
    """Of a turn of one degree a row: within theta^2 / 12 of gravity, where half a row late is theta / 2."""
    theta, t = np.deg2rad(1.0), np.arange(90.0)
    still = Channel(np.zeros(90), "rad/s", "interval")
    channels = {name: still for name in UNIT} | {"accel_x": Channel(9.8 * np.sin(theta * t), "m/s^2")}
    made = as_means(Recording(t, channels)).channels
    exact = 9.8 * (np.cos(theta * (t[1:] - 1)) - np.cos(theta * t[1:])) / theta
    assert made["accel_x"].covers == "interval" and made["gyro_x"] is still
    assert np.max(np.abs(made["accel_x"].values[1:] - exact)) < 1.01 * 9.8 * theta**2 / 12
