"""Effects that are the very same curve on a recording are rivals; what has another as its limit is none."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import DEG_PER_HOUR, closed

from insenv.core.recording import Channel, Floats, Recording

N, DT = 18_000, 0.2
T = DT * np.arange(1.0, N + 1)
NOISE = 0.5 * DEG_PER_HOUR / np.sqrt(DT)


def set_of(recording: Recording) -> set[str]:
    """The first effect that was added, with its rivals."""
    first = closed(recording).targets[0].added[0]
    return {first.effect if first.order is None else f"{first.effect}:{first.order}", *first.confounded_with}


def at_rates(*rates: float) -> Recording:
    """A fault of 5 deg/h around 20 deg/s, at steady rates of both signs [deg/s]."""
    both = np.deg2rad([sign * rate for rate in rates for sign in (1, -1)])
    rate = np.resize(np.repeat(both, N // 40), N)
    fault = np.sign(rate) * np.exp(-((np.abs(rate) - np.deg2rad(20)) ** 2) / (2 * np.deg2rad(2) ** 2))
    y = rate + 5 * DEG_PER_HOUR * fault + NOISE * np.random.default_rng(1).standard_normal(N)
    channels = {
        "gyro": Channel(y, "rad/s", "interval"),
        "table_rate": Channel(rate, "rad/s", "interval"),
        "table_angle": Channel(np.cumsum(rate) * DT, "rad"),
    }
    return Recording(T, channels)


def warming(rise: Floats, seed: int = 2) -> Recording:
    """A bias of 0.5 deg/h/K in a room whose temperature goes up by ``rise`` [K]."""
    y = 0.5 * DEG_PER_HOUR * rise + NOISE * np.random.default_rng(seed).standard_normal(N)
    return Recording(T, {"gyro": Channel(y, "rad/s", "interval"), "temperature": Channel(298.15 + rise, "K")})


def test_at_two_rates_a_cubic_is_an_anomaly() -> None:
    assert {"scale_factor_cubic", "scale_factor_anomaly"} <= set_of(at_rates(20, 60))


def test_at_many_rates_an_anomaly_stands_alone() -> None:
    assert set_of(at_rates(5, 10, 15, 20, 25, 30, 40, 50, 60)) == {"scale_factor_anomaly"}


def test_an_exponential_room_is_a_warm_up() -> None:
    assert {"bias_temperature:1", "bias_warm_up"} <= set_of(warming(8 * (1 - np.exp(-T / 600))))


def test_a_room_that_comes_back_is_none() -> None:
    found = set_of(warming(4 * np.sin(2 * np.pi * T / 1700)))
    assert "bias_temperature:1" in found and "bias_warm_up" not in found


@pytest.mark.parametrize("seed", [0, 3, 5])
def test_of_equal_curves_the_temperature_itself_is_named_first(seed: int) -> None:
    """Noise decides which is likelier: with the last of these seeds it is the rate of the temperature."""
    first = closed(warming(4 * (1 - np.exp(-T / 900)), seed)).targets[0].added[0]
    assert first.effect == "bias_temperature" and "bias_temperature_rate" in first.confounded_with


@pytest.mark.parametrize("seed", range(8))
def test_two_orders_of_one_polynomial_are_no_rivals(seed: int) -> None:
    """Where a square is not significant the line is named; it had been said of both that nothing tells them apart."""
    first = closed(warming(4 * np.sin(2 * np.pi * T / 1700), seed)).targets[0].added[0]
    assert (first.effect, first.order) == ("bias_temperature", 1)
    assert not any(key.startswith("bias_temperature:") for key in first.confounded_with)
