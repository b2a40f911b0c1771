"""Lists of points of other kinds than rates: temperatures, angles, attitudes, and an accelerometer on a dividing head.

A row is a mean at one of them each. Generated with NumPy, no effect of insenv; seeds are fixed. Laws have so many
deviations of the noise beside what is declared.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sequential import Shares

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.series.positions import attitudes_were_set, rates_were_set, temperatures_were_set, were_set
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.reference import points_of
from insenv.data.save import save
from insenv.identify.findings import Findings, TargetFindings
from insenv.report import summary, to_html, to_json

STRENGTH = 20.0
GRAVITY = 9.80665
FACES = np.array([sign * axis for axis in np.eye(3) for sign in (1, -1)])
EDGES = np.array([[a, b, 0] for a in (1, -1) for b in (1, -1)]) / np.sqrt(2)
ATTITUDES = np.concatenate([FACES, *(np.roll(EDGES, k, axis=1) for k in range(3))])

TEMPERATURE = """data = "run.csv"
[channels]
time = { column = "row" }
temperature = { column = "T", unit = "degC" }
gyro = { column = "y", unit = "deg/s" }
[model]
target = "gyro"
declared = ["bias", "bias_temperature"]
"""
NORTH = """data = "run.csv"
[channels]
time = { column = "row" }
table_angle = { column = "a", unit = "deg" }
gyro = { column = "y", unit = "deg/h" }
[site]
latitude = "40 deg"
[mounting]
tilt = "0 deg"
[model]
target = "gyro"
declared = ["bias", "earth_rate"]
"""
HEAD = """data = "run.csv"
[channels]
time = { column = "row" }
table_angle = { column = "a", unit = "deg" }
accel = { column = "y", unit = "standard_gravity" }
[site]
gravity = "9.80665 m/s^2"
[model]
target = "accel"
declared = ["accel_bias", "accel_scale_factor"]
"""


def closed(folder: Path, manifest: str, **columns: Floats) -> Findings:
    """The loop on columns of a file."""
    rows = np.column_stack(list(columns.values()))
    np.savetxt(folder / "run.csv", rows, "%.9g", ",", header=",".join(columns), comments="")
    (folder / "run.toml").write_text(manifest)
    return close(folder / "run.toml")


def with_law(law: Floats, declared: list[Floats], noise: float, rng: np.random.Generator) -> Floats:
    """A law of `STRENGTH` deviations beside what is declared, and the noise."""
    plain = np.column_stack([np.ones(len(law)), *declared])
    alone = float(np.linalg.norm(law - plain @ np.linalg.lstsq(plain, law, rcond=None)[0]))
    return noise * ((STRENGTH / alone if alone > 1e-9 else 0.0) * law + rng.standard_normal(len(law)))


def keys(target: TargetFindings) -> set[str]:
    """What was added, and its rivals, without orders."""
    return {key.split(":")[0] for a in target.added for key in (a.effect, *a.confounded_with)}


def in_order(kind: str, levels: Floats, rng: np.random.Generator) -> Floats:
    """Once up, there and back, or drawn."""
    both = np.concatenate([levels, levels[::-1]])
    return {"up": levels, "there and back": both, "drawn": rng.permutation(both)}[kind]


# ----------------------------------------------------------------------------------------------- temperatures


def heated(folder: Path, kind: str, count: int, law: int, seed: int) -> TargetFindings:
    """A bias that follows the power ``law`` of the temperature; 0: as declared."""
    rng = np.random.default_rng([1, len(kind), count, law, seed])
    x = in_order(kind, np.linspace(-1, 1, count), rng)
    y = 0.05 + 0.02 * x + with_law(x**law, [x], 1e-3, rng)
    (target,) = closed(folder, TEMPERATURE, T=10 + 50 * x + 0.05 * rng.standard_normal(len(x)), y=y).targets
    return target


def test_a_bend_over_temperature_is_named_in_whatever_order_the_chamber_went(tmp_path: Path) -> None:
    """If 97 of 100 are, 10 and more of 12 are in all but 5 in a thousand such sets; half of them are in one of 50."""
    cases = [(k, n, law, 1) for k in ("up", "there and back", "drawn") for n in (12, 21) for law in (2, 3)]
    assert sum("bias_temperature" in keys(heated(tmp_path, *case)) for case in cases) >= 10


def test_rows_without_a_time_have_no_duration(tmp_path: Path) -> None:
    x = np.linspace(-1, 1, 21)
    found = closed(
        tmp_path, TEMPERATURE, T=10 + 50 * x, y=0.02 * x + 1e-3 * np.random.default_rng(5).standard_normal(21)
    )
    assert "run: 21 rows\n" in summary(found) and "21 rows</p>" in to_html(found)


def test_temperatures_without_a_fault_name_nothing(tmp_path: Path) -> None:
    """A law where there is none has a probability of 1 %: refused with 2e-3, one in five lists accepted with 0.1."""
    cases = [(kind, count, 0, s) for s in range(8) for kind in ("up", "there and back", "drawn") for count in (12, 21)]
    false = Shares(good=0.01, bad=0.2, alarm=2e-3, miss=0.1)
    assert false.accept(bool(heated(tmp_path, *case).added) for case in cases)


def test_nothing_is_told_of_how_a_temperature_came_about(tmp_path: Path) -> None:
    blind = {one.effect: one.reason for one in heated(tmp_path, "drawn", 21, 2, 1).not_testable}
    for key in ("bias_temperature_rate", "bias_thermal_lag"):
        assert "nothing was recorded of the way between" in blind[key]


@pytest.mark.parametrize(
    ("t", "kelvins", "were"),
    [
        (3600.0 * np.arange(12), np.linspace(250, 330, 12), True),
        (1.0 * np.arange(12), np.linspace(250, 330, 12), False),  # a second each: a chip that warms up
        (3600.0 * np.arange(12), 300 + np.linspace(0, 2, 12), False),  # the day in a room
        (600.0 * np.arange(400), np.linspace(250, 330, 400), False),  # a slow soak, read every ten minutes
    ],
)
def test_what_temperatures_are_points(t: Floats, kelvins: Floats, were: bool) -> None:
    assert temperatures_were_set(t, kelvins) is were


def test_a_thermometer_is_no_encoder(tmp_path: Path) -> None:
    wrong = TEMPERATURE.replace('unit = "degC"', 'unit = "degC", source = "encoder"')
    with pytest.raises(InputError, match="channels.temperature.source = 'encoder'; wanted 'set'"):
        closed(tmp_path, wrong, T=np.arange(20.0), y=np.arange(20.0))


# ----------------------------------------------------------------------------------------------------- angles


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("kind", ["up", "there and back", "drawn"])
def test_a_wave_of_a_north_finder_is_named_by_a_reading_at_each_angle(tmp_path: Path, kind: str, order: int) -> None:
    rng = np.random.default_rng([2, len(kind), order])
    a = in_order(kind, 2 * np.pi * np.arange(24) / 24, rng)
    earth = [np.cos(a), np.sin(a)]
    y = 3 + 11 * np.cos(a + 0.5) + with_law(np.cos(order * a + 1), earth, 0.05, rng)
    found = closed(tmp_path, NORTH, a=np.rad2deg(a), y=y)
    (one,) = found.targets[0].added
    assert (one.effect, one.order) == ("angle_locked_rate", order)
    assert any("each row a mean at one angle" in remark for remark in found.remarks)
    # Between angles that were set nothing turned: the Earth's rate stands at each, no mean over the turn to it.
    (c, s) = (e.value for e in found.targets[0].estimates_after if e.effect == "earth_rate")
    assert np.rad2deg(abs(np.angle((c - 1j * s) / np.exp(0.5j)))) < 1.0


# -------------------------------------------------------------------------------------------------- attitudes


def test_a_sensitivity_to_gravity_is_told_by_a_mean_in_each_attitude(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    force = GRAVITY * ATTITUDES
    rates = [with_law(force @ rng.standard_normal(3), [], 1e-3, rng) for _ in range(2)]
    rates.append(1e-3 * rng.standard_normal(len(force)))
    columns = dict(zip(("ax", "ay", "az"), force.T + 0.003 * rng.standard_normal((3, len(force))), strict=True))
    columns |= dict(zip(("gx", "gy", "gz"), rates, strict=True))
    lines = [
        f'accel_{k} = {{ column = "a{k}", unit = "m/s^2" }}\ngyro_{k} = {{ column = "g{k}", unit = "deg/s" }}'
        for k in "xyz"
    ]
    head = 'data = "run.csv"\n[channels]\ntime = { column = "row" }\n' + "\n".join(lines)
    found = closed(
        tmp_path, head + '\n[model]\ntarget = ["gyro_x", "gyro_y", "gyro_z"]\ndeclared = ["bias"]\n', **columns
    )
    assert [keys(target) for target in found.targets] == [{"g_sensitivity"}, {"g_sensitivity"}, set()]
    assert any("a mean in one attitude" in remark for remark in found.remarks)


@pytest.mark.parametrize(
    ("force", "were"),
    [
        (GRAVITY * FACES, True),
        (np.tile([0.0, 0.0, GRAVITY], (20, 1)), False),  # at rest
        (GRAVITY * FACES * np.linspace(0.5, 2, 6)[:, None], False),  # shaken
        (GRAVITY * np.tile(FACES, (100, 1)), False),  # a recording
    ],
)
def test_what_attitudes_are_points(force: Floats, were: bool) -> None:
    assert attitudes_were_set(np.linspace(0.0, 2.0 * (len(force) - 1), len(force)), force.T) is were


# ---------------------------------------------------------------------------------------------- dividing head

LAWS = {
    "accel_second_order": lambda f, p, t: f**2,
    "accel_third_order": lambda f, p, t: f**3,
    "accel_asymmetry": lambda f, p, t: np.abs(f),
    "accel_cross_coupling": lambda f, p, t: f * p,
    "bias_drift": lambda f, p, t: t,
    "": lambda f, p, t: 0 * f,
}


def tumbled(folder: Path, kind: str, count: int, law: str, seed: int, manifest: str = HEAD) -> Findings:
    """An accelerometer that gravity turns through, at a zero of its own; in g."""
    rng = np.random.default_rng([4, len(kind), count, len(law), seed])
    a = in_order(kind, 2 * np.pi * np.arange(count) / count, rng)
    zero = rng.uniform(-0.1, 0.1)
    f, p = np.sin(a - zero), np.cos(a - zero)
    y = 0.01 + 1.002 * f + with_law(LAWS[law](f, p, np.linspace(0, 1, len(a))), [f, p], 1e-4, rng)
    return closed(folder, manifest, a=np.rad2deg(a), y=y)


def test_the_model_equation_of_an_accelerometer_is_told_on_a_dividing_head(tmp_path: Path) -> None:
    """If 97 of 100 are, 27 and more of 30 are in all but 1 in a hundred such sets."""
    named = 0
    for law in filter(None, LAWS):
        for kind, count in (("up", 12), ("up", 36), ("there and back", 12), ("drawn", 12), ("drawn", 24), ("up", 72)):
            (target,) = tumbled(tmp_path, kind, count, law, 1).targets
            named += law in keys(target)
    assert named >= 27


def test_what_a_dividing_head_tells_is_honest(tmp_path: Path) -> None:
    """Bias, scale factor and zero of 30 tests: a sum of squares of 60 within what chance does in 999 of 1000."""
    squares, named = 0.0, 0
    for seed in range(30):
        (target,) = tumbled(tmp_path, ("up", "drawn")[seed % 2], 24, "", seed).targets
        told = {e.effect: e for e in target.estimates_after}
        squares += ((told["accel_bias"].value - 0.01 * GRAVITY) / told["accel_bias"].sd) ** 2
        squares += ((told["accel_scale_factor"].value - 0.002) / told["accel_scale_factor"].sd) ** 2
        named += bool(target.added)
    assert 31 < squares < 130  # deviations are told by 16 rows each, so that some are too small
    assert named <= 2


def test_a_gravity_that_nobody_told_is_said(tmp_path: Path) -> None:
    untold = HEAD.replace('[site]\ngravity = "9.80665 m/s^2"\n', "")
    (target,) = tumbled(tmp_path, "up", 24, "accel_second_order", 1, untold).targets
    assert any("Neither gravity nor latitude is given" in caution for caution in target.cautions)
    (one,) = target.added
    assert "eccentricity" in one.remark and "of the head's angle" in one.remark
    assert (
        any("the same points once more" in one.procedure for one in target.next_experiment) or not one.confounded_with
    )
    assert target.traces.covariates["force"].min() < -9 < 9 < target.traces.covariates["force"].max()


def test_an_axis_that_leans_is_not_turned_through_gravity(tmp_path: Path) -> None:
    """A tenth of gravity goes with the angle: a tilt of the base, and no scale factor of a tenth."""
    rng = np.random.default_rng(6)
    a = 2 * np.pi * np.arange(36) / 36
    y = 0.01 + 0.1 * np.sin(a) + 1e-4 * rng.standard_normal(36)
    (target,) = closed(tmp_path, HEAD, a=np.rad2deg(a), y=y).targets
    assert not any(e.effect == "accel_misalignment" for e in target.estimates_after)


# ------------------------------------------------------------------------------------------ as people write them


def test_cycles_of_the_temperature_tell_a_hysteresis(tmp_path: Path) -> None:
    """The order of the points is all that a play wants to know."""
    rng = np.random.default_rng(8)
    up = np.linspace(-30.0, 50.0, 9)
    kelvins = np.concatenate([up, up[-2::-1], up[1:], up[-2::-1]])
    side = np.concatenate([np.ones(9), -np.ones(8), np.ones(8), -np.ones(8)])
    y = 0.05 + 1e-3 * kelvins + 5e-3 * side + 1e-3 * rng.standard_normal(len(kelvins))
    (target,) = closed(tmp_path, TEMPERATURE, T=kelvins, y=y).targets
    assert "bias_thermal_hysteresis" in keys(target)


def test_one_wrong_sign_in_a_list_at_rest_is_no_motion(tmp_path: Path) -> None:
    """An accelerometer that points down reads -1 g, and +1 g in one line: its neighbours went with it, as shaken."""
    rng = np.random.default_rng(9)
    kelvins = np.tile(np.linspace(-20.0, 60.0, 17), 2)
    y = -9.8 + 2e-6 * (kelvins - 20) ** 2 + 1e-4 * rng.standard_normal(34)
    y[11] *= -1
    accel = TEMPERATURE.replace("gyro =", "accel =").replace('"gyro"', '"accel"').replace("deg/s", "m/s^2")
    found = closed(tmp_path, accel, T=kelvins, y=y)
    assert keys(found.targets[0]) == {"bias_temperature"}
    assert [(row.start, row.stop) for row in found.rows_rejected] == [(11, 12)]


@pytest.mark.parametrize(
    ("t", "degrees", "was_set"),
    [
        (60.0 * np.arange(9.0), [5, 13, 37, 39, 60, 166, 199, 201, 290], True),  # by hand, unevenly
        (60.0 * np.arange(9.0), [0, 2, 4, 6, 8, 10, 12, 14, 16], False),  # a table that turns slowly
        (0.01 * np.arange(9.0), [5, 13, 37, 39, 60, 166, 199, 201, 290], False),
    ],
)
def test_angles_that_go_on_unevenly_were_set(t: Floats, degrees: list[float], was_set: bool) -> None:
    assert were_set(t, np.deg2rad(degrees)) is was_set


def test_a_staircase_of_one_two_five_and_four_readings_at_each_are_points() -> None:
    ladder = np.array([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100])
    thrice = np.repeat(np.concatenate([-ladder[::-1], ladder]), 3)
    assert rates_were_set(np.linspace(0.0, 590.0, 60), thrice)
    assert temperatures_were_set(np.linspace(0.0, 19 * 3600.0, 20), np.repeat(np.linspace(250.0, 330.0, 5), 4))


def any_column(rng: np.random.Generator, rows: int) -> Floats:
    """What may stand in a column: nothing, one number, noise of any size, a ramp, one wild word, two levels."""
    wild = rng.standard_normal(rows)
    wild[rng.integers(rows)] *= 1e6
    two = rng.choice([-1.0, 1.0], rows)
    size = 10.0 ** rng.integers(-6, 6)
    columns = (
        np.zeros(rows),
        np.full(rows, 3.7),
        size * rng.standard_normal(rows),
        np.linspace(-1, 1, rows),
        wild,
        two,
    )
    return np.asarray(columns[rng.integers(len(columns))])


@pytest.mark.parametrize("seed", range(24))
def test_any_list_ends_in_an_answer_or_in_one_sentence(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng([10, seed])
    rows = int(rng.choice([6, 9, 12, 20, 60, 301]))
    manifest, name = ((TEMPERATURE, "T"), (NORTH, "a"), (HEAD, "a"))[seed % 3]
    setting = (25 + 10 * np.tanh(any_column(rng, rows))) if name == "T" else 30 * any_column(rng, rows)
    said = manifest.replace('unit = "deg" }', 'unit = "deg", source = "set" }').replace(
        'unit = "degC" }', 'unit = "degC", source = "set" }'
    )
    try:
        found = closed(tmp_path, said if seed % 2 else manifest, **{name: setting, "y": any_column(rng, rows)})
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert to_json(found) and summary(found)


@pytest.mark.parametrize(("manifest", "source"), [(TEMPERATURE, "T"), (HEAD, "a")])
def test_points_that_are_written_are_points(tmp_path: Path, manifest: str, source: str) -> None:
    """What was set is said, for times stand beside it then: a corrected list was a recording a second apart."""
    rng = np.random.default_rng(11)
    x = np.linspace(0.0, 345.0, 24) if source == "a" else np.linspace(-40.0, 60.0, 24)
    y = np.sin(np.deg2rad(x)) if source == "a" else 1e-3 * x
    found = closed(tmp_path, manifest, **{source: x, "y": y + 1e-4 * rng.standard_normal(24)})
    read = load_manifest(tmp_path / "run.toml")
    recordings = read_recordings(read)
    save(tmp_path / "again.toml", recordings, read.model)
    again = close(tmp_path / "again.toml")
    assert again.rows == 24
    assert points_of(read_recordings(load_manifest(tmp_path / "again.toml"))[0]) == points_of(recordings[0]) is not None
    (was,), (now,) = found.targets, again.targets
    assert [e.effect for e in now.estimates_after] == [e.effect for e in was.estimates_after]
    for one, other in zip(was.estimates_after, now.estimates_after, strict=True):
        assert abs(one.value - other.value) < 0.2 * one.sd
