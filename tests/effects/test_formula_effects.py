"""Effects made from a formula: each factor, units, lags, and effects that stand in a file."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.effects.base import Effect
from insenv.effects.catalogue import by_key, plug_in_of
from insenv.effects.check import check_effect
from insenv.effects.formula import FACTORS, STANDS, made, name_of, product
from insenv.effects.own import ALL
from insenv.trust.trial import Injection

Floats = NDArray[np.float64]
N, DT = 400, 0.5


def motion() -> Motion:
    """A table that swings through rest while it warms up."""
    t: Floats = np.arange(N + 1) * np.float64(DT)
    angle = 3.0 * np.sin(0.05 * t) + 0.02 * t
    return Motion(
        t=t,
        rate=np.diff(angle) / DT,
        angle=angle,
        rate_edges=0.15 * np.cos(0.05 * t) + 0.02,
        temperature=298.15 + 5 * np.sin(0.03 * t),
        force={axis: 1.0 + np.sin(0.1 * t[1:] + k) for k, axis in enumerate("xyz")},
        vibration={axis: 1.0 + 0.5 * np.cos(0.2 * t[1:] + k) for k, axis in enumerate("xyz")},
    )


def effect(formula: str, name: str = "formula_test") -> Effect:
    return made(formula, "gyro", (1e-4,) * len(product(formula).coefficients("gyro")), name)


def curve(formula: str, *theta: float) -> Floats:
    one, given = effect(formula), motion()
    values = np.array(theta)
    return np.asarray(one.apply(given.rate, given, values, one.begin(given, values))[0])


PRODUCTS = (
    "u^2 * (T - T_ref)",
    "|u| * (T - T_0)",
    "(T - T_0)^2 * cos(2 a + p)",
    "u^3 * (t - t_0)",
    "u * dT/dt",
    "1/u * f_x",
    "t^2 * cos(3 a + p)",
    "du/dt * v_z",
    "u|u| * |T - T_ref|",
)
LAGS = ("lag(|dT/dt|)", "lag(u^2 * (T - T_ref))", "lag(|u| * f_y)")


@pytest.mark.parametrize("formula", (*FACTORS, *PRODUCTS, *LAGS))
def test_every_formula_is_a_sound_effect(formula: str) -> None:
    assert check_effect(effect(formula)) == []
    assert effect(formula) == effect(formula)
    assert name_of(formula).isidentifier()


def test_a_formula_is_the_product_of_what_was_recorded() -> None:
    given = motion()
    assert given.temperature is not None
    assert given.angle is not None
    warm = 0.5 * (given.temperature[1:] + given.temperature[:-1]) - 298.15
    slope = np.diff(given.temperature) / DT
    middle = 0.5 * (given.angle[1:] + given.angle[:-1])
    assert curve("u^2 * (T - T_ref)", 2.0) == pytest.approx(2 * given.rate**2 * warm)
    assert curve("|u| * (dT/dt)^2", 2.0) == pytest.approx(2 * np.abs(given.rate) * slope**2)
    assert curve("u|u| * t", 1.0) == pytest.approx(given.rate * np.abs(given.rate) * given.middle)
    assert curve("f_x^2 * |T - T_ref|", 1.0) == pytest.approx(given.force["x"] ** 2 * np.abs(warm))
    assert curve("|u| * (T - T_0)", 2.0, -6.0) == pytest.approx(2 * np.abs(given.rate) * (warm - 3.0))
    assert curve("u * (T - T_0)^2", 2.0, -12.0, 18.0) == pytest.approx(2 * given.rate * (warm - 3.0) ** 2)
    both = curve("(T - T_ref) * cos(2 a + p)", 1.0, 0.5)
    assert both == pytest.approx(warm * (np.cos(2 * middle) + 0.5 * np.sin(2 * middle)), abs=1e-3 * np.ptp(both))


def test_one_over_the_rate_is_nothing_where_the_table_stands() -> None:
    given = motion()
    stands = np.abs(given.rate) <= STANDS
    found = curve("1/u", 1.0)
    assert stands.any()
    assert not found[stands].any()
    assert found[~stands] == pytest.approx(1 / given.rate[~stands])


def test_a_lag_follows_its_differential_equation_from_where_the_product_is_at_the_start() -> None:
    tau, given = 20.0, motion()
    drive = given.rate**2
    now, means = float(drive[0]), []
    fine = 200
    for value in drive:  # the product holds over an interval
        part = []
        for _ in range(fine):
            part.append(now)
            now += (value - now) * DT / fine / tau
        means.append(np.mean(part))
    assert curve("lag(u^2)", 1.0, tau) == pytest.approx(np.array(means), abs=1e-3 * np.ptp(drive))


@pytest.mark.parametrize(
    ("formula", "gyro", "accelerometer"),
    [
        ("u", "1", "m/(rad s)"),
        ("u^2 * (T - T_ref)", "s/(rad K)", "m/(rad^2 K)"),
        ("lag((dT/dt)^2)", "rad s/K^2", "m/K^2"),
        ("t * cos(a + p)", "rad/s^2", "m/s^3"),
        ("1/u * f_x", "rad^2/m", "rad/s"),
    ],
)
def test_a_coefficient_has_the_unit_that_the_product_leaves(formula: str, gyro: str, accelerometer: str) -> None:
    assert (product(formula).unit("gyro"), product(formula).unit("accelerometer")) == (gyro, accelerometer)


def test_what_a_formula_needs_and_follows_is_read_from_its_text() -> None:
    one = effect("u * (T - T_ref)")
    assert (set(one.needs), one.of_rate, one.of_time) == ({"temperature"}, True, False)
    two = effect("t * cos(a + p)")
    assert (set(two.needs), two.of_rate, two.of_time) == ({"angle"}, False, True)
    assert effect("f_x * v_y").missing(replace(motion(), force={})) == ("force.x",)


def test_each_column_of_a_law_with_an_origin_of_its_own_has_a_coefficient_with_a_unit() -> None:
    assert product("u * (T - T_0)^2").coefficients("gyro") == {"c": "1/K^2", "c_1": "1/K", "c_0": "1"}
    names = product("(t - t_0) * cos(a + p)").coefficients("gyro")
    assert names == {"c": "rad/s^2", "s": "rad/s^2", "c_0": "rad/s", "s_0": "rad/s"}


@pytest.mark.parametrize(
    "text",
    ["u^7", "(T - T_0) * (t - t_0)", "lag((T - T_0) * u)", "u*t", "lag(cos(a + p))", "cos(a + p) * cos(2 a + p)", ""],
)
def test_what_is_no_formula_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="formula"):
        product(text)


WRITTEN = """
from insenv.effects.formula import Formula, coefficient


class Found(Formula):
    id = "{id}"
    formula = "u^2 * (T - T_ref)"
    linear = (coefficient(formula, "gyro", sd=1e-4, bound=1e-3),)
    instruments = ("gyro",)
    source = "found in a test"
"""


def test_an_effect_goes_by_the_file_in_which_it_stands(tmp_path: Path) -> None:
    file = tmp_path / "my_effect.py"
    file.write_text(WRITTEN.format(id="found_in_a_file"))
    found = by_key(str(file))
    assert found.id == "found_in_a_file"
    assert by_key(f"{file}:Found") == found
    # From then on it goes by its id, and what is kept of it says where it stands.
    assert by_key("found_in_a_file") == found
    assert plug_in_of(found) == f"{file}:Found"
    assert by_key(plug_in_of(found)) == found


def test_another_process_injects_an_effect_of_a_file_that_it_has_not_loaded(tmp_path: Path) -> None:
    file = tmp_path / "my_effect.py"
    file.write_text(WRITTEN.format(id="injected_from_a_file"))
    injected = Injection("gyro", "injected_from_a_file", "c", 1e-6, "s/(rad K)", (), plug_in_of(by_key(str(file))))
    code = (
        "import pickle, sys, numpy as np\n"
        "one = pickle.loads(bytes.fromhex(sys.argv[1]))\n"
        "print(one.theta(2.0, np.random.default_rng(0))[0].id)"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, pickle.dumps(injected).hex()], capture_output=True, text=True, check=False
    )
    assert run.stdout.strip() == "injected_from_a_file", run.stderr


@pytest.mark.parametrize(
    ("text", "name", "said"),
    [
        (None, "", "no such file"),
        ("1/0", "", "cannot be run .ZeroDivisionError"),
        (WRITTEN.format(id="a") + WRITTEN.format(id="b").replace("Found", "Other"), "", "has 2 effects"),
        (WRITTEN.format(id="c"), ":Missing", "has no class 'Missing'; wanted one of Found"),
        (WRITTEN.format(id="bias"), "", "is that of an effect of insenv"),
    ],
)
def test_a_file_without_one_sound_effect_ends_in_a_sentence(
    tmp_path: Path, text: str | None, name: str, said: str
) -> None:
    file = tmp_path / "my_effect.py"
    if text is not None:
        file.write_text(text)
    with pytest.raises(InputError, match=said):
        by_key(f"{file}{name}")


def test_no_formula_has_the_name_of_an_effect() -> None:
    assert not {name_of(text) for text in FACTORS} & {one.id for one in ALL}
