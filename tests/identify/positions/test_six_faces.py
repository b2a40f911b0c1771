"""Six faces with biases declared: six magnitudes tell six figures, and how a unit repeats itself tells which count."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.findings import Findings

FACES = [(axis, sign) for axis in range(3) for sign in (1, -1)]
#: Scatter of the rows, and what differs from rest to rest by itself [m/s^2].
ROW, REPEAT = 5e-3, 1e-3


def six_faces(
    folder: Path,
    scale: tuple[float, float, float],
    seed: int,
    faces: int = 6,
    stated: str = "",
    shaken: int = -1,
    lean: float = 1e-3,
    again: int | None = None,
) -> Findings:
    """Rests of 60 s, each placed to ``lean`` [rad], of a unit with biases of 30 mm/s^2 and these scale factors.

    The last one is face ``again`` once more, if that is given.

    The file ``shaken`` has no rest of 2 s.
    """
    rng, names = np.random.default_rng(seed), []
    bias = 30e-3 * rng.standard_normal(3)
    order = FACES[:faces] if again is None else [*FACES[: faces - 1], FACES[again]]
    for number, (axis, sign) in enumerate(order):
        force = lean * STANDARD_GRAVITY * rng.standard_normal(3)
        force[axis] = sign * STANDARD_GRAVITY
        force *= STANDARD_GRAVITY / np.linalg.norm(force)
        mean = force * (1 + np.array(scale)) + bias + REPEAT * rng.standard_normal(3)
        t = 0.05 * np.arange(1200)
        swing = (number == shaken) * np.where((t + 3) % 6 > 1.8, 3 * np.sin(2 * np.pi * t), 0.0)[:, None]
        rows = np.column_stack([t, mean + swing + ROW * rng.standard_normal((1200, 3))])
        np.savetxt(folder / f"{number}.csv", rows, delimiter=",", header="t,x,y,z", comments="", fmt="%.6f")
        names.append(f"{number}.csv")
    lines = [f"data = {json.dumps(names)}", "[channels]", 'time = { column = "t", unit = "s" }']
    lines += [f'accel_{axis} = {{ column = "{axis}", unit = "m/s^2" }}' for axis in "xyz"]
    lines += ["[site]", f'gravity = "{STANDARD_GRAVITY} m/s^2"', "[model]", 'procedure = "multi-position"']
    lines += ['target = ["accel_x", "accel_y", "accel_z"]', 'declared = ["accel_bias"]']
    lines += [stated]
    (folder / "m.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return close(folder / "m.toml")


@pytest.mark.parametrize("noise", [1e-3, 1e-4])
@pytest.mark.parametrize("seed", range(2))
def test_a_list_of_means_in_stated_attitudes_tells_scale_factors(tmp_path: Path, noise: float, seed: int) -> None:
    """Each row is a rest and shows no noise of its own: none was taken, and no rest foretold another."""
    rng = np.random.default_rng([7, seed])
    scale = 20 * noise / STANDARD_GRAVITY * np.array([1.0, -0.8, 0.6])
    up = np.array([sign * np.eye(3)[axis] for axis, sign in FACES * 4])
    set_to = up + 2e-3 * rng.standard_normal(up.shape)
    force = STANDARD_GRAVITY * set_to / np.linalg.norm(set_to, axis=1)[:, None]
    read = force * (1 + scale) + [0.02, -0.03, 0.05] + noise * rng.standard_normal(force.shape)
    np.savetxt(tmp_path / "means.csv", read, delimiter=",", header="x,y,z", comments="", fmt="%.7f")
    lines = ['data = "means.csv"', "[channels]", 'segment = { column = "row" }']
    lines += [f'accel_{axis} = {{ column = "{axis}", unit = "m/s^2" }}' for axis in "xyz"]
    lines += ["[site]", f'gravity = "{STANDARD_GRAVITY} m/s^2"', "[model]", 'procedure = "multi-position"']
    lines += ['target = ["accel_x", "accel_y", "accel_z"]', 'declared = ["accel_bias"]', "[positions]"]
    lines += [f"up = {json.dumps(['-+'[sign > 0] + 'xyz'[axis] for axis, sign in FACES * 4])}"]
    (tmp_path / "m.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for target, true in zip(close(tmp_path / "m.toml").targets, scale, strict=True):
        (one,) = (a for a in target.added if a.effect == "accel_scale_factor")
        assert abs(one.parameters[0].value - true) < 4 * one.parameters[0].sd


@pytest.mark.parametrize("seed", range(3))
def test_a_unit_that_repeats_itself_leaves_nothing(tmp_path: Path, seed: int) -> None:
    """Named only where 3 mm/s^2 from rest to rest would not do: of 60 seeds with 0.3, 1 and 3 mm/s^2 none is."""
    assert said(six_faces(tmp_path, (0.0, 0.0, 0.0), seed)) == ("nothing-significant", (), [])


@pytest.mark.parametrize("seed", range(3))
def test_six_magnitudes_tell_no_more_than_six_figures(tmp_path: Path, seed: int) -> None:
    """Faces that lean by 3 deg show a non-orthogonality, but not beside the scale factors, and none of 4 deg."""
    verdict, _, added = said(six_faces(tmp_path, (-3e-3, -5e-3, 1e-3), seed, lean=0.05))
    assert added == ["accel_scale_factor"]
    assert verdict in ("effects-found", "confounded")


@pytest.mark.parametrize("scale", [(-1.4e-3, -1.3e-3, 0.1e-3), (-0.17e-3, -0.26e-3, 0.91e-3)])
def test_scale_factors_far_beyond_it_are_named(tmp_path: Path, scale: tuple[float, float, float]) -> None:
    found = six_faces(tmp_path, scale, 3)
    assert said(found) == ("effects-found", (), ["accel_scale_factor"])
    values = [t.added[0].parameters[0] for t in found.targets]
    np.testing.assert_array_less(np.abs([(v.value - c) / v.sd for v, c in zip(values, scale, strict=True)]), 3.5)
    # Of 1 mm/s^2 in two faces; not of the samples' noise, a hundredth of it.
    np.testing.assert_allclose([v.sd for v in values], REPEAT / np.sqrt(2) / STANDARD_GRAVITY, rtol=0.5)


@pytest.mark.parametrize("seed", [3, 4, 6])
def test_scale_factors_that_the_worst_repeatability_would_do_as_well_are_said(tmp_path: Path, seed: int) -> None:
    """Seven times what biases usually repeat to, and twice the worst: nothing was said of it. Other seeds name it."""
    verdict, (reason,), added = said(six_faces(tmp_path, (0.7e-3, 0.0, 0.4e-3), seed))
    assert verdict == "unexplained-structure" and not added
    assert reason.startswith("accel_scale_factor would explain these rests, and biases that repeat to 3 mm/s^2")


def test_a_stated_repeatability_takes_the_place_of_the_usual_one(tmp_path: Path) -> None:
    scale = (-1.4e-3, -1.3e-3, 0.1e-3)
    found = six_faces(tmp_path, scale, 3, stated='[positions]\nrepeatability = "20 mm/s^2"')
    assert said(found) == ("nothing-significant", (), [])


UP = '[positions]\nup = ["+x", "-x", "+y", "-y", "+z"]\ntolerance = "3 deg"'


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("stated", "faces", "again"), [(UP, 5, None), ("", 5, None), ("", 6, 4)])
def test_the_scale_factors_of_the_axes_that_point_both_ways_are_told(
    tmp_path: Path, seed: int, stated: str, faces: int, again: int | None
) -> None:
    """Of the z axis, up in one face or in two, bias and scale factor are one figure, and that is said there alone."""
    scale = (9e-3, -11e-3, 5e-3)
    found = six_faces(tmp_path, scale, seed, faces=faces, stated=stated, lean=0.01, again=again)
    x, y, z = found.targets
    for target, truth in ((x, scale[0]), (y, scale[1])):
        (one,) = (a.parameters[0] for a in target.added if a.effect == "accel_scale_factor")
        assert abs(one.value - truth) < 3 * max(one.sd, REPEAT / STANDARD_GRAVITY)
        assert not target.cautions
    assert (x.verdict, y.verdict) == ("effects-found", "effects-found")
    assert z.verdict == "unexplained-structure" and not z.added
    (bias,) = (e for e in z.estimates_after if e.effect == "accel_bias")
    assert bias.sd == pytest.approx(STANDARD_GRAVITY * 10e-3, rel=0.1)  # a scale factor as large as the others'
    assert "accel_scale_factor" in {n.effect for n in z.not_testable} - {n.effect for n in x.not_testable}
    assert any("accel_scale_factor" in c for c in z.cautions)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("stated", [UP, ""])
def test_five_faces_without_scale_factors_show_none(tmp_path: Path, seed: int, stated: str) -> None:
    assert said(six_faces(tmp_path, (0.0, 0.0, 0.0), seed, faces=5, stated=stated, lean=0.02))[2] == []


def test_two_faces_of_an_axis_and_one_of_the_others_tell_its_scale_factor_alone(tmp_path: Path) -> None:
    found = six_faces(tmp_path, (9e-3, 9e-3, 9e-3), 0, faces=4, again=4)
    assert [[a.effect for a in target.added] for target in found.targets] == [["accel_scale_factor"], [], []]


def test_what_nothing_could_refuse_is_said_and_not_named(tmp_path: Path) -> None:
    """Faces that lean by more than a degree foretell no other one: a scale factor of 1 % is left, and no silence."""
    found = six_faces(tmp_path, (9e-3, -11e-3, 5e-3), 0, faces=5, stated=UP, lean=0.02)
    verdict, reasons, added = said(found)
    assert verdict == "unexplained-structure" and not added
    assert any("accel_scale_factor would explain these rests" in r for r in reasons)


def test_a_file_without_a_rest_is_one_face_less(tmp_path: Path) -> None:
    x, y, z = six_faces(tmp_path, (-9e-3, -11e-3, 9e-3), 0, shaken=0).targets
    assert not x.added and any("accel_scale_factor" in c for c in x.cautions)
    assert [[a.effect for a in target.added] for target in (y, z)] == [["accel_scale_factor"], ["accel_scale_factor"]]


def said(found: Findings) -> tuple[str, tuple[str, ...], list[str]]:
    first = found.targets[0]
    return found.verdict, first.reasons, [a.effect for a in first.added]
