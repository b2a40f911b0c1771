"""Numbers, probabilities and units as reports show them."""

import re
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from made_findings import (
    EVERY,
)

from insenv.core.quantities import number, p_value, unit_for, with_sd
from insenv.core.units import dimension_of, scale_to_si
from insenv.effects.base import OUTPUT, CurveEffect, Param
from insenv.effects.catalogue import CATALOGUE
from insenv.identify.findings import Estimate, Findings
from insenv.report import (
    estimates,
)

Make = Callable[[], Findings]
every = pytest.mark.parametrize("make", EVERY.values(), ids=EVERY.keys())


def _parameters() -> Iterator[tuple[str, Param]]:
    for one in CATALOGUE:
        for param in (*one.linear, *(one.shapes if isinstance(one, CurveEffect) else ())):
            yield one.key, param


@pytest.mark.parametrize("output", ["rad/s", "m/s^2"])
@pytest.mark.parametrize("size", [1e-12, 1e-6, 1e-3, 1.0, 1e3])
def test_every_unit_of_the_catalogue_is_shown_in_one_of_the_same_dimension(output: str, size: float) -> None:
    ascii_text = str.maketrans({"²": "^2", "³": "^3", "µ": "u"})
    for key, param in _parameters():
        si = param.unit.replace(OUTPUT, output)
        unit = unit_for(si, size)
        label = re.sub(r"√(\w+)", r"sqrt(\1)", unit.label.translate(ascii_text)) or "1"
        if si not in ("", "1"):
            assert "rad" not in unit.label and " " not in unit.label, key
            factor, _ = scale_to_si(label, dimension_of(si), f"{key} {param.name} {si}")
            assert unit.factor == pytest.approx(factor, rel=1e-9), (key, si, label)


@pytest.mark.parametrize(
    ("kind", "si", "value", "text"),
    [
        ("angle_random_walk", "rad/s sqrt(s)", np.deg2rad(4e-5) / 60, "(4.0 ± 0.4)×10⁻⁵ deg/√h"),
        ("angle_random_walk", "m/s^2 sqrt(s)", 6e-5, "0.0036 ± 0.0004 m/s/√h"),
        ("bias_instability", "rad/s", np.deg2rad(0.1), "360 ± 40 deg/h"),
        ("bias_instability", "m/s^2", 9.80665e-4, "100 ± 10 µg"),
        ("rate_random_walk", "rad/s/sqrt(s)", np.deg2rad(0.5) / 3600 / 60, "0.50 ± 0.05 deg/h/√h"),
        ("quantization", "rad/s s", np.deg2rad(9.0) / 3600, "9.0 ± 0.9 arcsec"),
        ("quantization", "m/s^2 s", 0.0016, "0.00160 ± 0.00016 m/s"),
        ("base_tilt", "m/s^3", 0.012 / 3600, "12.0 ± 1.2 mm/s²/h"),
        ("base_tilt", "m/s^3", 9.80665e-5 / 3600, "10.0 ± 1.0 µg/h"),
        ("bias_temperature", "rad/s/K^2", np.deg2rad(200.0) / 3600, "200 ± 20 deg/h/K²"),
    ],
)
def test_figures_of_a_sensor_have_the_units_of_the_field(kind: str, si: str, value: float, text: str) -> None:
    shown = estimates.value(Estimate(kind, "x", value, 0.1 * value, si))
    assert shown == text


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (9.79123, 0.0412, "9.79 ± 0.04"),
        (9.79123, 0.0203, "9.791 ± 0.020"),
        (412.3, 31.2, "412 ± 31"),
        (1.2e-7, 3e-9, "(1.200 ± 0.030)×10⁻⁷"),
        (1.234e9, 5e6, "(1.234 ± 0.005)×10⁹"),
        (0.0, 6e-4, "(0 ± 6)×10⁻⁴"),
        (-0.5, 0.0, "-0.5000"),
        (3.0, float("nan"), "3.000"),
        (float("nan"), 1.0, "—"),
        (1.0, 0.0996, "1.00 ± 0.10"),
        (5123.0, 812.0, "(5.1 ± 0.8)×10³"),
        (5123.0, 12.0, "5123 ± 12"),
        (-48.3, 41.0, "-50 ± 40"),
        (148.0, 37.0, "150 ± 40"),
        (-0.01, 0.8, "0.0 ± 0.8"),
    ],
)
def test_a_value_is_rounded_to_what_its_sd_supports(value: float, sd: float, text: str) -> None:
    assert with_sd(value, sd) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.000123, "1.23×10⁻⁴"),
        (0.123, "0.123"),
        (99999.6, "1.00×10⁵"),
        (12345.0, "12345"),
        (0.0, "0"),
        (-2.5, "-2.50"),
    ],
)
def test_numbers_keep_three_digits(value: float, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("p", "text"),
    [(0.4, "= 0.4"), (3e-20, "< 10⁻¹⁵"), (0.0, "< 10⁻¹⁵"), (2e-5, "= 2×10⁻⁵"), (9.7e-6, "= 1×10⁻⁵")],
)
def test_p_values_are_shown_with_their_relation(p: float, text: str) -> None:
    assert p_value(p) == text


@pytest.mark.parametrize(
    ("si", "size", "label", "shown"),
    [
        ("rad/s", np.deg2rad(1.0) / 3600, "deg/h", 1.0),
        ("rad/s", np.deg2rad(2.0), "deg/s", 2.0),
        ("m/s^2", 9.8, "m/s²", 9.8),
        ("m/s^2", 0.0154, "mm/s²", 15.4),
        ("m/s^2", 9.80665e-5, "µg", 10.0),
        ("rad", np.deg2rad(5 / 3600), "arcsec", 5.0),
        ("", 2e-5, "ppm", 20.0),
        ("rad/sqrt(s)", np.deg2rad(0.003) / 60, "deg/√h", 0.003),
        ("rad/s/sqrt(s)", np.deg2rad(1.0) / 3600 / 60, "deg/h/√h", 1.0),
        ("rad/s/K", np.deg2rad(1.0) / 3600, "deg/h/K", 1.0),
        ("m/s^2/K", 0.003, "mm/s²/K", 3.0),
        ("rad/s/(m/s^2)", np.deg2rad(1.0) / 3600 / 9.80665, "deg/h/g", 1.0),
        ("furlong/s", 3.0, "furlong/s", 3.0),
    ],
)
def test_units_suit_an_engineer(si: str, size: float, label: str, shown: float) -> None:
    unit = unit_for(si, size)
    assert unit.label == label
    assert unit.of(size) == pytest.approx(shown, rel=1e-12)
