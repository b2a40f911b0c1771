"""A reference that was read less often than the rows: found, and taken on a smooth curve; all others left alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from insenv.core.recording import Channel, Floats, Origin, Recording
from insenv.data.renewals import renewals, with_renewals

ROW = 0.01
T: Floats = ROW * np.arange(4000, dtype=np.float64)


def hand(seed: int) -> Callable[[Floats], Floats]:
    """The angle of a table that is turned by hand, as a function of time."""
    rng = np.random.default_rng(seed)
    f, a, phase = rng.uniform(0.05, 0.8, 12), rng.uniform(0.05, 0.4, 12), rng.uniform(0, 6, 12)
    return lambda t: np.asarray(np.sum(a[:, None] * np.sin(2 * np.pi * f[:, None] * t + phase[:, None]), axis=0))


def rate_error(values: Floats, angle: Callable[[Floats], Floats]) -> float:
    inner = slice(20, -20)
    return float(np.std((np.diff(values) - np.diff(angle(T)))[inner]) / ROW)


@pytest.mark.parametrize("rate", [15.0, 25.0])
def test_straight_lines_between_readings_are_rounded_off(rate: float) -> None:
    angle, knots = hand(1), np.arange(-1.013, 42.0, 1 / rate)
    values = np.interp(T, knots, angle(knots))
    found = renewals(T, values)
    assert found is not None
    assert not found.held
    assert found.period == pytest.approx(1 / rate, abs=0.6 * ROW)
    assert rate_error(found.values, angle) < 0.1 * rate_error(values, angle)


def test_lines_over_the_number_of_the_row_are_found_where_stamps_jitter() -> None:
    angle, rng = hand(2), np.random.default_rng(2)
    t = T + 0.8 * ROW * rng.uniform(-0.5, 0.5, len(T))
    knots = np.unique(np.append(np.arange(0, len(T), 7), len(T) - 1))
    found = renewals(t, np.interp(np.arange(len(T)), knots, angle(T)[knots]))
    assert found is not None
    np.testing.assert_allclose(found.values[20:-20], angle(T)[20:-20], atol=3e-4)


@pytest.mark.parametrize("rate", [20.0, 50.0])
@pytest.mark.parametrize("of", ["angle", "rate"])
def test_readings_that_are_held_are_taken_where_they_begin(rate: float, of: str) -> None:
    motion = hand(3)
    signal = motion if of == "angle" else (lambda t: (motion(t + 5e-4) - motion(t - 5e-4)) / 1e-3)
    knots = np.arange(-1.005, 42.0, 1 / rate)
    values = signal(knots[np.searchsorted(knots, T, side="right") - 1])
    found = renewals(T, values)
    assert found is not None
    assert found.held
    late = signal(T - 0.005)  # half a row old where it is first seen
    off, raw = np.std((found.values - late)[20:-20]), np.std((values - late)[20:-20])
    assert off < 0.3 * raw


def every_row_read() -> dict[str, Floats]:
    rng = np.random.default_rng(5)
    angle = hand(4)(T)
    dwells = np.repeat(rng.uniform(-1, 1, 40), 100)
    eased = lfilter([0.05], [1, -0.95], dwells)
    counts, there_and_back = 2 * np.pi / 400, np.abs((np.arange(4000) % 2000) - 1000.0)

    def printed(turned: Floats) -> Floats:
        """An encoder of 13 bits in a file of 7 digits."""
        return np.array([float(f"{x:.7g}") for x in 2 * np.pi / 2**13 * np.floor(turned + 0.3)])

    return {
        "smooth": angle,
        "noisy": angle + 1e-4 * rng.standard_normal(len(T)),
        "coarse": counts * np.floor(angle / counts),
        "6.83 counts a row": printed(6.83 * there_and_back),
        "13.75 counts a row": printed(13.75 * there_and_back),
        "rounded": np.round(angle, 4),
        "finely rounded": np.round(angle, 6),
        "slow and rounded": np.round(0.01 * angle, 6),
        "hardly moving and rounded": np.round(1e-3 * angle, 6),
        "one rate": 0.3 * T,
        "a staircase of rates": np.cumsum(dwells) * ROW,
        "a table that follows one": np.cumsum(eased) * ROW,
        "told": dwells,
        "triangles": np.abs((T % 4.0) - 2.0),
        "at rest": np.zeros(len(T)),
        "noise": rng.standard_normal(len(T)),
        "coarse noise": np.round(0.4 * rng.standard_normal(len(T))),
    }


@pytest.mark.parametrize("name", every_row_read())
def test_what_was_read_at_every_row_is_left_alone(name: str) -> None:
    assert renewals(T, every_row_read()[name]) is None


@pytest.mark.parametrize("counts", [1.82, 5.2])
def test_the_counts_of_an_encoder_are_no_lines_where_rows_are_lost(counts: float) -> None:
    rng = np.random.default_rng(5)
    rows = np.arange(6000.0)
    rows = rows[rng.random(6000) >= 0.01]
    turned = np.floor(counts * np.abs((rows % 3000) - 1500) + 0.3)
    assert renewals(ROW * rows, np.array([float(f"{x:.7g}") for x in 2 * np.pi / 2**13 * turned])) is None


def test_a_command_holds_for_it_was_told_so() -> None:
    knots = np.arange(-1.0, 42.0, 0.05)
    values = hand(6)(knots[np.searchsorted(knots, T, side="right") - 1])
    sources: tuple[Origin, ...] = ("encoder", "command")
    for source in sources:
        channel = Channel(values, "rad/s", source=source)
        seen = with_renewals(Recording(T, {"table_rate": channel}))
        assert bool(seen.notes) == (source == "encoder")
        assert np.array_equal(seen.channels["table_rate"].values, values) == (source == "command")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_readings_that_a_link_lost_and_a_table_that_stands_do_not_hide_them(seed: int) -> None:
    """A tenth of the telegrams is missing, and while the table stands the lines bend by rounding alone."""
    rng = np.random.default_rng(seed)
    swings = hand(seed)

    def angle(t: Floats) -> Floats:
        return swings(np.interp(t, [-2, 8, 14, 44], [-2, 8, 8, 38]))

    knots = np.arange(-1.013, 42.0, 1 / 14)
    knots = knots[rng.random(len(knots)) > 0.1]
    values = np.round(np.interp(T, knots, angle(knots)), 5)
    found = renewals(T, values)
    assert found is not None and not found.held
    assert found.period == pytest.approx(1 / 14, abs=ROW)
    assert np.std(found.values - angle(T)) < np.std(values - angle(T))


def _swings(t: Floats) -> Floats:
    """Swings that grow and die away [rad]."""
    return np.asarray(np.sin(1.7 * t) * np.sin(0.05 * t) ** 2)


@pytest.mark.parametrize("digits", [15, 9, 7, 6, 5])
def test_readings_at_any_times_are_found_between_exact_lines(digits: int) -> None:
    """An odometry that comes as it likes, brought to the rows of a gyro: no row between lies off its line.

    But for the digits of the file: while the table is slow, lines bend by these.
    """
    rng = np.random.default_rng(6)
    t = np.cumsum(rng.choice([0.008, 0.012], 6000))
    at = np.cumsum(rng.uniform(0.06, 0.34, 400))
    at = at[at < t[-1] + 1]
    values = np.round(np.interp(t, at, _swings(at)), digits)
    found = renewals(t, values)
    assert found is not None and not found.held
    inside = (t > 2) & (t < t[-1] - 2)
    left = (found.values - _swings(t))[inside]
    lines = (values - _swings(t))[inside]
    assert np.std(left) < 0.5 * np.std(lines)


def test_a_programme_of_exact_rates_is_read_at_every_row() -> None:
    """Dwells of one to three seconds, with corners between: a table that turns so was told to."""
    rng = np.random.default_rng(7)
    t = 0.01 * np.arange(20_000.0)
    corners = np.cumsum(rng.uniform(1.0, 3.0, 150))
    corners = np.concatenate([[0.0], corners[corners < t[-1]], [t[-1]]])
    heights = np.cumsum(rng.uniform(-2.0, 2.0, len(corners)))
    assert renewals(t, np.interp(t, corners, heights)) is None


def _drive(rng: np.random.Generator, t: Floats) -> Floats:
    """The rate of a car that turns now and then, for some seconds each time [rad/s]."""
    rate, at = np.zeros(len(t)), 0.0
    while at < t[-1]:
        at, lasts = at + rng.uniform(3, 15), rng.uniform(2, 6)
        inside = (t > at) & (t < at + lasts)
        turn = rng.choice([-1, 1]) * rng.uniform(0.15, 0.5)
        rate[inside] += turn * np.sin(np.pi * (t[inside] - at) / lasts) ** 2
        at += lasts
    return rate


def _beside(t: Floats, gyro: Floats, angle: Floats, stamps: Floats | None = None) -> float:
    """The time between readings of an angle beside a gyro, 0 where every row was read."""
    run = Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(angle, "rad", source="encoder")})
    return with_renewals(run, stamps).channels["table_angle"].every


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("noise", [1e-4, 0.02])
def test_a_course_that_comes_once_a_second_is_found_where_the_gyro_does_not_jump_with_it(
    held: bool, noise: float
) -> None:
    rng = np.random.default_rng(8)
    t = 0.025 * np.arange(12_000.0)
    rate = _drive(rng, t)
    fixes = np.arange(-0.5, t[-1] + 1.0, 1.0) + 0.013
    course = np.interp(fixes, t, np.cumsum(rate) * 0.025) + noise * rng.standard_normal(len(fixes))
    angle = course[np.searchsorted(fixes, t, side="right") - 1] if held else np.interp(t, fixes, course)
    gyro = rate + 0.005 * rng.standard_normal(len(t))
    assert _beside(t, gyro, angle) == pytest.approx(1.0, abs=0.05)


def test_lines_were_drawn_over_the_stamps_of_the_file() -> None:
    rng = np.random.default_rng(9)
    t = 0.025 * np.arange(12_000.0)
    stamps = t + np.where(rng.random(len(t)) < 0.1, rng.uniform(5e-4, 3e-3, len(t)), 0.0)
    rate = _drive(rng, t)
    fixes = np.arange(-0.5, t[-1] + 1.0, 1.0)
    angle = np.interp(
        stamps, fixes, np.interp(fixes, t, np.cumsum(rate) * 0.025) + 0.01 * rng.standard_normal(len(fixes))
    )
    gyro = rate + 0.005 * rng.standard_normal(len(t))
    assert _beside(t, gyro, angle, stamps) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("late", [0.0, 0.3])
@pytest.mark.parametrize("held", [False, True])
def test_a_table_that_steps_once_a_second_is_read_at_every_row(held: bool, late: float) -> None:
    """Rates that jump, or angles: the gyro jumps with them, late or not."""
    rng = np.random.default_rng(10)
    t = 0.01 * np.arange(20_000.0)
    steps = np.repeat(rng.uniform(-0.5, 0.5, 200), 100)
    if held:
        angle = steps
        rate = np.gradient(lfilter([0.1], [1, -0.9], steps), 0.01)
    else:
        angle, rate = np.cumsum(steps) * 0.01, lfilter([0.2], [1, -0.8], steps)
    gyro = np.roll(rate, round(late / 0.01)) + 0.02 * rng.standard_normal(len(t))
    assert _beside(t, gyro, angle) == 0


@pytest.mark.parametrize("seed", [1, 5, 7])
def test_coarse_readings_that_are_held_are_no_straight_lines(seed: int) -> None:
    """A heading in counts of 1 mrad, read every 10 ms beside rows at uneven steps, of a unit that turns, then creeps.

    Most of its jumps are a single count. Taken for level lines it went 28 mrad off where the unit hardly moved.
    """
    t = np.cumsum(np.random.default_rng(seed).choice([0.0022, 0.0024, 0.0035, 0.0044], 6000))
    turned = np.clip((t - 0.5) / 2, 0.0, 1.0)
    angle = 3.4 * (turned - np.sin(2 * np.pi * turned) / (2 * np.pi)) - 0.02 * np.clip(t - 2.6, 0.0, None)
    anew = np.append(True, np.diff(np.floor(t / 0.0101)) > 0)
    row = np.maximum.accumulate(np.where(anew, np.arange(6000), 0))
    count = np.deg2rad(1 / 16)
    found = renewals(t, np.round(angle[row] / count) * count)
    assert found is not None and found.held
    assert np.abs(found.values - angle)[t > 3.5].max() < 4 * count


def held_rate(readings: Floats) -> Recording:
    values = np.repeat(readings, len(T) // len(readings))
    return with_renewals(Recording(T, {"table_rate": Channel(values, "rad/s")}))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("stands", [0.0, 0.7])
def test_a_rate_that_was_held_and_has_noise_was_measured(seed: int, stands: float) -> None:
    """So do wheels show their speed: the curve through their readings has no noise, and looks like a command."""
    at, rng = T[::10], np.random.default_rng(seed)
    motion = (hand(seed)(at + 5e-4) - hand(seed)(at - 5e-4)) / 1e-3
    noise = 0.02 * float(np.abs(motion).max()) * rng.standard_normal(len(at))
    moving = at >= stands * T[-1]
    read = held_rate(np.where(moving, motion + noise, 0.0))
    assert read.channels["table_rate"].source == "encoder"
    # What is computed, and held, is told nothing of: it may be a command.
    assert held_rate(np.where(moving, motion, 0.0)).channels["table_rate"].source is None
