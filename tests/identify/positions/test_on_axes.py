"""The loop on a whole unit on a table whose axes are read: errors of the table, of the seat and of the instruments."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Channel, Floats, Mounting, Recording, Site
from insenv.core.unit.gimbals import Gimbals
from insenv.core.unit.motion import GYROS, UNIT, Course, motions
from insenv.data.manifest import HeldOut, Model, load_manifest
from insenv.data.save import save
from insenv.effects.catalogue import by_key
from insenv.identify.findings import Findings
from insenv.identify.positions.on_axes.terms import candidates
from insenv.sensors.chain import Sensor

TABLE = Gimbals("zxy", sd=(3e-4, 3e-4, 3e-4, 5e-5, 5e-5, 3e-4, *8 * (0.0,)), most=3 * (2 * np.pi,), noise=2e-7)
SITE = Site(0.7, 0.0, 9.8)
#: Deviation of a sample's white noise: of rates, of forces.
WHITE = {True: 1.3e-5, False: 1.8e-3}
RATE, DWELL = 20, 12
DECLARED = ("bias", "scale_factor", "misalignment", "accel_bias", "accel_scale_factor", "non_orthogonality")
TARGETS = {name: "gyro" if name in GYROS else "accel" for name in UNIT}


#: Positions of the axes [quarters of a turn]: right angles but for every seventh step.
Path3 = list[tuple[float, ...]]


def usual(eighths: bool = True) -> Path3:
    now, found = np.zeros(3), list[tuple[float, ...]]([(0.0, 0.0, 0.0)])
    for k in range(26):
        now[(k * 2 + k // 5) % 3] += (0.5 if eighths and k % 7 == 0 else 1.0) * (1 if k % 4 < 2 else -1)
        found.append((float(now[0]), float(now[1]), float(now[2])))
    return found


def angles(path: Path3) -> tuple[Floats, Floats]:
    """Angles of the axes at edges and middles, shape (3, 2 n + 1), by turns of five seconds; which samples move."""
    grid, quarter = np.linspace(0, 1, 10 * RATE + 1)[1:], 0.5 * np.pi
    smooth = grid - np.sin(2 * np.pi * grid) / (2 * np.pi)
    parts, begun = [], np.array(path[0]) * quarter
    for before, after in pairwise(np.array(path) * quarter):
        parts += [
            np.repeat(before[:, None], 2 * DWELL * RATE, axis=1),
            before[:, None] + np.outer(after - before, smooth),
        ]
    moving = np.tile(np.repeat([0.0, 1.0], [DWELL * RATE, 5 * RATE]), len(path) - 1)
    return np.concatenate([begun[:, None], *parts], axis=1), moving


def six_positions() -> Path3:
    """Each axis of the unit up and down, twice: the outer axis of the table rests."""
    between: tuple[float, ...] = (0.0, 0.0, 0.0)
    own: Path3 = [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 2.0, 0.0)]
    return 2 * [between, *(at for position in own for at in (position, between))]


def proposed(procedure: str) -> Path3:
    """Positions of a proposal, one axis after the other."""
    found = Path3()
    for text in procedure.rpartition(": ")[2].removesuffix(" deg").split("; "):
        after = [float(a) / 90 for a in text.split()]
        now = list(found[-1] if found else after)
        for m in [m for m in range(3) if now[m] != after[m]] or [0]:
            now[m] = after[m]
            found.append(tuple(now))
    return found


def outputs(
    errors: dict[str, float],
    effects: dict[str, dict[str, tuple[float, ...]]],
    path: Path3 | None = None,
    table: Gimbals = TABLE,
) -> dict[str, Floats]:
    """Of the six channels without noise; ``effects`` by channel and key."""
    at, _ = angles(path or usual())
    n = (at.shape[1] - 1) // 2
    t = np.arange(n + 1) / RATE
    wrong = np.array([errors.get(name, 0.0) for name in TABLE.names])
    true = table.true_angles(at, wrong)
    rates = np.gradient(true[:, ::2], 1 / RATE, axis=1)
    course = Course(t, true, np.diff(true[:, ::2], axis=1) * RATE, rates)
    felt = motions(table, wrong, course, (SITE.latitude, 9.8), np.full(n + 1, 298.15), 298.15)
    found = {}
    for name in UNIT:
        own = effects.get(name, {})
        sensor = Sensor(name, tuple(by_key(key) for key in own))
        found[name] = sensor.measure(felt[name], sensor.theta(list(own.values())))[0]
    return found


def recording(out: dict[str, Floats], seed: int, path: Path3 | None = None, **changes: Any) -> Recording:
    rng, (at, moving) = np.random.default_rng(seed), angles(path or usual())
    n = len(moving)
    channels = {
        name: Channel(
            out[name] + WHITE[name in GYROS] * rng.standard_normal(n), "rad/s" if name in GYROS else "m/s^2", "interval"
        )
        for name in UNIT
    }
    readings = at[:, 2::2] + TABLE.noise * rng.standard_normal((3, n))
    channels |= {f"axis_{m + 1}": Channel(readings[m], "rad") for m in range(3)}
    channels["turning"] = Channel(moving, "1", "interval")
    t = (np.arange(n) + 1.0) / RATE
    return replace(Recording(t, channels, (), SITE, Mounting(gimbals=TABLE), "run"), **changes)


def found(tmp_path: Path, *runs: Recording, declared: tuple[str, ...] = DECLARED, **more: Any) -> Findings:
    path = tmp_path / "unit.toml"
    noise = {name: {"angle_random_walk": WHITE[name in GYROS] / np.sqrt(RATE)} for name in UNIT}
    save(path, runs, Model(UNIT, declared, procedure="multi-position"), noise=noise, **more)
    return close(path)


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


def test_a_unit_that_slips_is_told_with_the_time(tmp_path: Path) -> None:
    early, late = outputs({}, {}), outputs({"mounting.x": 2e-4, "mounting.z": -1e-4}, {})
    slipped = {
        name: np.where(np.arange(len(v)) < 12 * 17 * RATE + 13 * RATE, v, late[name]) for name, v in early.items()
    }
    findings = found(tmp_path, recording(slipped, seed=1))
    (one,) = findings.targets[0].added
    assert one.effect == "mounting_shift" and f"from {12 * 17 + DWELL} s on" in one.remark
    assert one.parameters[0].value == pytest.approx(2e-4, abs=5 * one.parameters[0].sd)


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
