"""Units at the border: known conversions, one clear sentence for anything else, and no third outcome."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from insenv.core import units
from insenv.core.errors import InputError
from insenv.core.units import DIMENSIONS, dimension_of, quantity, quantity_in, scale_to_si, show
from insenv.effects.base import OUTPUT, Effect
from insenv.effects.catalogue import ALL

G = 9.80665
KNOWN = [
    ("30 deg", "angle", math.pi / 6),
    ("28.2°", "angle", math.radians(28.2)),
    ("-90 deg", "angle", -math.pi / 2),
    ("1 turn", "angle", 2 * math.pi),
    ("0.46634601 arcsec", "angle", 0.46634601 * math.pi / 648000),
    ("1 deg/s", "rate", math.pi / 180),
    ("15 deg per h", "rate", math.pi / 12 / 3600),
    ("15 °/h", "rate", math.pi / 12 / 3600),
    ("33 rpm", "rate", 33 * 2 * math.pi / 60),
    ("70 mdps", "rate", math.radians(0.07)),
    ("3e-4 deg/sqrt(h)", "angle random walk", math.radians(3e-4) / 60),
    ("3e-4 deg/√h", "angle random walk", math.radians(3e-4) / 60),
    ("3e-4 deg/h^0.5", "angle random walk", math.radians(3e-4) / 60),
    ("3e-4 deg h^(-1/2)", "angle random walk", math.radians(3e-4) / 60),
    ("0.01 deg/s/sqrt(Hz)", "angle random walk", math.radians(0.01)),
    ("5e-3 deg/h", "bias instability", math.radians(5e-3) / 3600),
    ("1e-3 deg/h/sqrt(h)", "rate random walk", math.radians(1e-3) / 3600 / 60),
    ("0.1 arcsec", "quantization", 0.1 * math.pi / 648000),
    ("9.79 m/s^2", "acceleration", 9.79),
    ("9.79 m s⁻²", "acceleration", 9.79),
    ("9.79 m*s**-2", "acceleration", 9.79),
    ("1 g", "acceleration", G),
    ("2 mg", "acceleration", 2e-3 * G),
    ("10 ug", "acceleration", 10e-6 * G),
    ("10 µg", "acceleration", 10e-6 * G),
    ("30 mGal", "acceleration", 30e-5),
    ("50 ug/sqrt(Hz)", "velocity random walk", 50e-6 * G),
    ("0.03 m/s/sqrt(h)", "velocity random walk", 0.03 / 60),
    ("125 ug s", "velocity", 125e-6 * G),
    ("3 knot", "velocity", 3 * 1852 / 3600),
    ("10 ms", "time", 0.01),
    ("2 h", "time", 7200.0),
    ("100 Hz", "frequency", 100.0),
    ("25 degC", "temperature", 298.15),
    ("-40 degF", "temperature", 233.15),
    ("300 K", "temperature", 300.0),
    ("5 degC", "temperature difference", 5.0),
    ("9 degF", "temperature difference", 5.0),
    ("100 ppm", "fraction", 1e-4),
    ("3 %", "fraction", 0.03),
    (0.25, "fraction", 0.25),
    ("0.25", "fraction", 0.25),
    ("380 m", "length", 380.0),
    ("5 1/s", "frequency", 5.0),
    ("5 1 per s", "frequency", 5.0),
]

WRONG = [
    ("bananas", "rate"),
    ("3 bananas", "rate"),
    ("", "rate"),
    ("   ", "rate"),
    ("deg", "angle"),  # no number
    ("deg/s", "rate"),
    (28.2, "angle"),  # no unit
    ("28.2", "angle"),
    (True, "fraction"),
    (None, "angle"),
    (["3 deg"], "angle"),
    ("3 kg", "acceleration"),
    ("3 Hz", "rate"),  # cycles or radians? the text does not say
    ("3 deg", "rate"),
    ("3 dB", "fraction"),
    ("nan deg", "angle"),
    (math.nan, "fraction"),
    (math.inf, "fraction"),
    (10**400, "fraction"),
    ("25 * degC", "temperature"),  # 25 K or 298.15 K?
    ("25 (degC)", "temperature"),
    ("25", "temperature"),
    ("inf deg", "angle"),
    ("1e999 deg", "angle"),
    ("10 000 Hz", "frequency"),
    ("2 1/3 s", "time"),
    ("2 1 / .5 s", "time"),
    ("2 1/", "time"),
    ("3,5 deg", "angle"),
    ("5.0(3) s", "time"),
    ("5 ^2 s", "time"),
    ("1 deg/0", "angle"),
    ("1 0^-1 s", "time"),
    ("1 deg/s)", "rate"),
    ("1 (deg/s", "rate"),
    ("1 deg//s", "rate"),
    ("1 s^(1/0)", "time"),
    ("1 s^99", "time"),
    ("9**9**9**9 s", "time"),
    ("1 sqrt", "time"),
    ("1 per", "time"),
    ("(" * 5000, "time"),
    ("s" * 5000, "time"),
    ("__import__('os').getcwd()", "time"),
]


@pytest.mark.parametrize(("text", "dimension", "si"), KNOWN)
def test_known_quantities(text: object, dimension: str, si: float) -> None:
    assert quantity(text, dimension, "run.toml: key") == pytest.approx(si, rel=1e-14)


@pytest.mark.parametrize(("given_text", "dimension"), WRONG)
def test_wrong_quantities_end_in_one_sentence(given_text: object, dimension: str) -> None:
    with pytest.raises(InputError) as caught:
        quantity(given_text, dimension, "run.toml: [site] latitude")
    message = str(caught.value)
    assert message.startswith("run.toml: [site] latitude ")
    assert f'wanted a{"n" if dimension[0] in "aeiou" else ""} {dimension} such as "' in message
    assert "\n" not in message and len(message) < 250


def test_messages_say_what_was_given_and_what_was_wanted() -> None:
    with pytest.raises(InputError) as caught:
        scale_to_si("bananas", "rate", "run.toml: [channels.gyro] unit")
    assert str(caught.value) == (
        'run.toml: [channels.gyro] unit "bananas" is not a unit that is understood; wanted a rate such as "deg/s"'
    )
    with pytest.raises(InputError, match=r'"100 Hz" is in 1/s; wanted a rate such as "1 deg/s"$'):
        quantity("100 Hz", "rate", "run.toml: key")
    with pytest.raises(InputError, match=r'"51" is a plain number; wanted an angle such as "1 deg"$'):
        quantity(51, "angle", "run.toml: key")


def test_a_number_too_long_to_be_written_is_refused() -> None:
    with pytest.raises(InputError, match='^here "infinity" is not a quantity'):
        quantity(10**5000, "fraction", "here")  # Python refuses to write more than 4300 digits


@pytest.mark.parametrize("unit", ["ppm/(deg/s)^2", "ppm (s/deg)^2", "1e-6/(deg/s)^2", "1e-6 1/(deg/s)^2", "ppm/dps**2"])
def test_ways_to_write_a_cubic_coefficient(unit: str) -> None:
    number = unit if unit.startswith("1e-6") else f"1 {unit}"
    assert quantity_in(number, "1/(rad/s)^2", "key") == pytest.approx(1e-6 / math.radians(1) ** 2, rel=1e-14)


@pytest.mark.parametrize("effect", ALL, ids=lambda effect: effect.key)
def test_the_unit_that_a_message_asks_for_is_read(effect: Effect) -> None:
    for param in effect.params:
        for output in ("rad/s", "m/s^2"):
            si = param.unit.replace(OUTPUT, output)
            assert quantity_in(f"3 {si}" if si != "1" else "3", si, "key") == pytest.approx(3.0)


def test_dimension_of_a_unit() -> None:
    per_kelvin = dimension_of("rad/s/K")
    assert quantity("1 deg/h/degC", per_kelvin, "here") == pytest.approx(units.DEG_PER_HOUR, rel=1e-14)
    with pytest.raises(InputError, match='^here "1 deg/h" is in rad/s; wanted a quantity such as "1 rad/s/K"$'):
        quantity("1 deg/h", per_kelvin, "here")
    with pytest.raises(InputError, match='"bananas" is not a unit'):
        dimension_of("bananas")


@pytest.mark.parametrize(
    ("unit", "dimension", "factor", "offset"),
    [
        ("deg/s", "rate", math.pi / 180, 0.0),
        ("0.46634601 arcsec", "angle", 0.46634601 * math.pi / 648000, 0.0),
        ("-0.1 arcsec", "angle", -0.1 * math.pi / 648000, 0.0),
        ("125 ug s", "velocity", 125e-6 * G, 0.0),
        ("degC", "temperature", 1.0, 273.15),
        ("°C", "temperature", 1.0, 273.15),
        ("0.01 degC", "temperature", 0.01, 273.15),
        ("degF", "temperature", 5 / 9, 459.67 * 5 / 9),
        ("degC", "temperature difference", 1.0, 0.0),
        ("1", "fraction", 1.0, 0.0),
    ],
)
def test_scales(unit: str, dimension: str, factor: float, offset: float) -> None:
    assert scale_to_si(unit, dimension, "here") == pytest.approx((factor, offset), rel=1e-14)


@pytest.mark.parametrize("unit", ["", " ", "0 deg", "1e-999 deg", "1e999 deg", "nan deg", "m", "1e300*1e300 deg", "0"])
def test_a_scale_is_finite_and_not_zero(unit: str) -> None:
    with pytest.raises(InputError, match=r"^here .*wanted an angle"):
        scale_to_si(unit, "angle", "here")


def test_compound_with_a_temperature_takes_it_as_a_step() -> None:
    assert show(math.radians(1) / 3600, "deg/h/degC") == pytest.approx(1.0, rel=1e-14)
    assert show(math.radians(1) / 3600, "deg/h/degF") == pytest.approx(5 / 9, rel=1e-14)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_every_dimension_accepts_its_own_example(dimension: str) -> None:
    factor, _ = scale_to_si(DIMENSIONS[dimension].example, dimension, "here")
    assert factor > 0


@pytest.mark.parametrize(
    ("constant", "unit"),
    [
        (units.DEG, "deg"),
        (units.ARCMIN, "arcmin"),
        (units.ARCSEC, "arcsec"),
        (units.MINUTE, "min"),
        (units.HOUR, "h"),
        (units.PPM, "ppm"),
        (units.DEG_PER_HOUR, "deg/h"),
        (units.DEG_PER_SQRT_HOUR, "deg/sqrt(h)"),
        (units.DEG_PER_HOUR_PER_SQRT_HOUR, "deg/h/sqrt(h)"),
        (units.STANDARD_GRAVITY, "g_0"),
        (units.MILLI_G, "mg"),
        (units.UG, "ug"),
        (units.MGAL, "mGal"),
        (units.ZERO_CELSIUS, "273.15 K"),
    ],
)
def test_constants_agree_with_pint(constant: float, unit: str) -> None:
    assert type(constant) is float
    assert show(constant, unit) == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("name", units.COMMON)
def test_common_names_are_as_pint_has_them(name: str) -> None:
    assert units.by_pint(name) == units.COMMON[name]


def test_no_registry_is_made_for_common_units_nor_for_any_packaged_scenario() -> None:
    made = "from insenv.core import units; [units.scale_to_si(u, d, 'u') for u, d in PAIRS]; import sys"
    pairs = [
        ("deg/s", "rate"),
        ("m/s^2", "acceleration"),
        ("0.01 rad/s", "rate"),
        ("ms", "time"),
        ("degC", "temperature"),
    ]
    loaded = "from insenv.scenario import load, names; [load(name) for name in names()]"
    code = f"PAIRS = {pairs}; {made}; {loaded}; assert 'pint' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_show_converts_arrays_and_temperatures() -> None:
    np.testing.assert_allclose(show(np.array([[1.0, 2.0]]) * units.DEG_PER_HOUR, "deg/h"), [[1.0, 2.0]])
    assert show(298.15, "degC") == pytest.approx(25.0)
    for wrong in ("bananas", "", "0 deg", "1e999 deg"):
        with pytest.raises(InputError, match=f'^"{wrong}" is '):
            show(1.0, wrong)


def test_every_unit_of_the_registry_is_read_or_refused() -> None:
    for name in sorted(units.registry()._units):
        _number_or_input_error(f"2 {name}")


names = st.sampled_from(["deg", "h", "s", "m", "g", "ug", "degC", "dB", "e", "ppm", "°", "rad", "kg", "sqrt", "per"])
pieces = st.sampled_from([*"*/^()√·+-. \n²⁻0123456789", "**", "e-", "1e308", "nan", "inf"])


# every text, random or made of the grammar's own pieces, ends in a finite number or in InputError
@settings(max_examples=400, deadline=None)
@given(st.one_of(st.text(), st.lists(st.one_of(names, pieces), max_size=12).map("".join)))
@example("3 PdegC")
@example("1 sqrt(-1 s)")
@example("0^-1")
@example("0^0.5 deg")
@example("1\n2 deg")
def test_any_text_ends_in_a_number_or_input_error(text: str) -> None:
    _number_or_input_error(text)


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_numbers_survive_the_round_trip(x: float) -> None:
    assert show(quantity(f"{x!r} deg/h", "rate", "here"), "deg/h") == pytest.approx(x, rel=1e-14)


def _number_or_input_error(text: str) -> None:
    for dimension in DIMENSIONS:
        try:
            value = quantity(text, dimension, "here")
            assert type(value) is float and math.isfinite(value)
        except InputError as error:
            assert "\n" not in str(error)
        try:
            factor, offset = scale_to_si(text, dimension, "here")
            assert math.isfinite(factor) and factor != 0 and math.isfinite(offset)
        except InputError as error:
            assert "\n" not in str(error)
