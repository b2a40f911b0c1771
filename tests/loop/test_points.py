"""A table of rates and readings, the common test of a scale factor: a row is a mean at one rate of the table.

Of such points nothing is known of the way from one rate to the next, and a staircase is fastest at one of its ends: one
row in three is held out. Generated with NumPy, no effect of insenv; seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from sequential import Shares

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.series.positions import rates_were_set
from insenv.identify.findings import Findings
from insenv.report.evidence import effects

Law = Callable[[Floats], Floats]

TOP, NOISE, STRENGTH, APART = 200.0, 0.05, 20.0, 12.0
LAWS: dict[str, Law] = {
    "scale_factor_cubic": lambda x: x**3,
    "scale_factor_asymmetry": np.abs,
    "centripetal_acceleration": lambda x: x**2,
    "scale_factor_knee": lambda x: np.sign(x) * np.maximum(np.abs(x) - 0.6, 0),
}


def in_order(kind: str, count: int, rng: np.random.Generator) -> Floats:
    """Rates [deg/s] from least to greatest, there and back, by their size and both ways, thrice, or drawn."""
    levels = np.linspace(-TOP, TOP, count)
    positive = levels[levels > 0]
    return {
        "up": levels,
        "there and back": np.concatenate([levels, levels[::-1]]),
        "by size": np.concatenate([[0.0], np.column_stack([positive, -positive]).ravel(), [0.0]]),
        "thrice": np.tile(levels, 3),
        "drawn": rng.permutation(np.tile(levels, 2)),
    }[kind]


def closed(folder: Path, rates: Floats, law: Law | None, rng: np.random.Generator, t: Floats | None = None) -> Findings:
    """The loop on points with a law of so many deviations of their noise beside bias and scale factor."""
    x = rates / TOP
    curve = np.zeros(len(x)) if law is None else law(x)
    line = np.column_stack([np.ones(len(x)), x])
    alone = float(np.linalg.norm(curve - line @ np.linalg.lstsq(line, curve, rcond=None)[0]))
    read = 1.004 * rates + 0.3 + NOISE * rng.standard_normal(len(rates))
    read += STRENGTH * NOISE * curve / alone if alone else 0.0
    times = APART * np.arange(len(rates)) if t is None else t
    np.savetxt(folder / "run.csv", np.column_stack([times, rates, read]), "%.9g", ",", header="t,w,g", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "deg/s" }\ntable_rate = { column = "w", unit = "deg/s" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    )
    return close(folder / "run.toml")


def test_a_law_of_the_rate_is_named_in_whatever_order_the_rates_were_set(tmp_path: Path) -> None:
    """If 97 of 100 are, 13 and more of 16 are in all but one of a thousand such sets; half of them are in one of 90."""
    named = 0
    for kind in ("there and back", "by size", "thrice", "drawn"):
        for name, law in LAWS.items():
            rng = np.random.default_rng([sum(map(ord, kind)), 1])
            (target,) = closed(tmp_path, in_order(kind, 21, rng), law, rng).targets
            named += name in {key.split(":")[0] for a in target.added for key in (a.effect, *a.confounded_with)}
    assert named >= 13


@pytest.mark.parametrize("name", ["scale_factor_cubic", "scale_factor_knee"])
def test_eleven_rates_from_least_to_greatest_are_enough(tmp_path: Path, name: str) -> None:
    """The last 40 % of them are the fastest ones of one sign."""
    rng = np.random.default_rng(2)
    found = closed(tmp_path, in_order("up", 11, rng), LAWS[name], rng)
    (one,) = found.targets[0].added
    assert {"scale_factor_cubic", "scale_factor_knee"} & {one.effect, *one.confounded_with}
    assert any("one in 3 is held out" in remark for remark in found.remarks)
    assert any("no row of the changes between" in remark for remark in found.remarks)


def test_points_without_a_fault_name_nothing(tmp_path: Path) -> None:
    """A law where there is none has a probability of 1 %: refused with 3e-3, one in five lists accepted with 0.04."""

    def named(seed: int) -> bool:
        rng = np.random.default_rng([3, seed])
        rates = in_order(("up", "by size", "drawn")[seed % 3], 21, rng)
        return bool(closed(tmp_path, rates, None, rng).targets[0].added)

    assert Shares(good=0.01, bad=0.2, alarm=3e-3, miss=0.04).accept(map(named, range(60)))


def test_readings_of_an_encoder_are_no_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    closed(tmp_path, in_order("drawn", 41, rng), None, rng)
    text = (tmp_path / "run.toml").read_text()
    (tmp_path / "run.toml").write_text(
        text.replace('unit = "deg/s" }\n[model]', 'unit = "deg/s", source = "encoder" }\n[model]')
    )
    found = close(tmp_path / "run.toml")
    assert not any("one in 3 is held out" in remark for remark in found.remarks)


def test_nothing_is_told_of_the_way_between(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    (target,) = closed(tmp_path, in_order("drawn", 21, rng), None, rng).targets
    blind = {one.effect: one.reason for one in target.not_testable}
    for key in ("timing_skew", "sample_hold", "encoder_harmonic:1", "angle_locked_rate:2", "earth_rate"):
        assert "nothing was recorded of the way between" in blind[key]


def test_points_that_were_set_by_hand_are_no_uneven_clock(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    rates = in_order("drawn", 21, rng)
    t = np.cumsum(rng.uniform(8, 45, len(rates)))
    found = closed(tmp_path, rates, LAWS["scale_factor_asymmetry"], rng, t)
    (one,) = found.targets[0].added
    assert "scale_factor_asymmetry" in (one.effect, *one.confounded_with)
    assert found.rows == len(rates) and any("rows are points at one rate each" in remark for remark in found.remarks)


def test_too_few_points_are_refused_with_what_is_wanted(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    with pytest.raises(InputError, match="5 fitted points .* wanted at least 7: more points"):
        closed(tmp_path, in_order("up", 7, rng), None, rng)


@pytest.mark.parametrize(
    ("t", "rate", "were"),
    [
        (12.0 * np.arange(11), np.linspace(-1, 1, 11), True),
        (0.01 * np.arange(11), np.linspace(-1, 1, 11), False),  # a ramp
        (1.0 * np.arange(400), np.repeat(np.linspace(-1, 1, 10), 40), False),  # dwells of 40 rows
        (10.0 * np.arange(30), np.repeat(np.linspace(-1, 1, 10), 3), True),  # three readings at each
        (1.0 * np.arange(110), np.linspace(0, 1, 110), False),  # a motor that is told to go faster and faster
        (12.0 * np.arange(11), np.zeros(11), False),
        (1.0 * np.arange(1000), np.sin(0.31 * np.arange(1000)), False),  # a swing, read once a second
        (12.0 * np.arange(5), np.linspace(-1, 1, 5), False),
    ],
)
def test_what_points_are(t: Floats, rate: Floats, were: bool) -> None:
    assert rates_were_set(t, rate) is were


def test_a_law_of_few_points_is_drawn_against_the_rate(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    (target,) = closed(tmp_path, in_order("thrice", 11, rng), LAWS["scale_factor_cubic"], rng).targets
    model = target.switchable()
    assert model is not None
    ((_, figure),) = effects(target, model)
    assert figure.axes[0].get_xlabel() == "rate [deg/s]"


@pytest.mark.parametrize("seed", range(3))
def test_points_at_three_temperatures_tell_what_goes_with_it_and_not_with_its_change(tmp_path: Path, seed: int) -> None:
    """Between them somebody waited for the chamber."""
    rng = np.random.default_rng([9, seed])
    rates, kelvins = np.tile(np.linspace(-150, 150, 11), 3), np.repeat([-45.0, 0.0, 35.0], 11)
    read = 1.003 * rates + 0.2 + 2e-6 * rates * kelvins + 0.002 * rng.standard_normal(33)
    rows = np.column_stack([rates, 25 + kelvins + 0.3 * rng.standard_normal(33), read])
    np.savetxt(tmp_path / "run.csv", rows, "%.6f", ",", header="w,T,g", comments="")
    (tmp_path / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "row" }\n'
        'gyro = { column = "g", unit = "deg/s" }\ntable_rate = { column = "w", unit = "deg/s" }\n'
        'temperature = { column = "T", unit = "degC" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    )
    (target,) = close(tmp_path / "run.toml").targets
    (one,) = target.added
    assert "scale_factor_temperature" in (one.effect, *one.confounded_with)
    blind = {other.effect for other in target.not_testable}
    assert {"bias_temperature_rate", "bias_thermal_lag", "bias_thermal_hysteresis"} <= blind


def test_rates_of_one_sign_want_the_other(tmp_path: Path) -> None:
    """What goes with the square and what goes with the cube are one curve on one side of nothing."""
    rng = np.random.default_rng(13)
    rates = np.concatenate([np.linspace(0, TOP, 21), np.linspace(TOP, 0, 21)])
    (target,) = closed(tmp_path, rates, LAWS["centripetal_acceleration"], rng).targets
    assert target.verdict == "confounded"
    (best, *_) = target.next_experiment
    assert best.procedure == "the same rates the other way about"
    assert best.expected_separation_sigma is not None and best.expected_separation_sigma > 5
