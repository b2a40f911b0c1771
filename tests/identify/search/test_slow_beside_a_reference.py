"""A slow change of the bias beside a reference that the held-out rows alone do not bear out: a set with noise in it."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.findings import TargetFindings

ROWS, DT, WHITE, SWING, PERIOD = 600, 0.1, 0.002, 1.5, 7.0
SLOW = tuple(by_key(key) for key in ("bias_drift", "bias_warm_up", "bias_step"))
#: A drift, and a step in the middle, of one standard deviation beside a level [rad/s].
DRIFT, STEP = WHITE * np.sqrt(12 / ROWS), WHITE * np.sqrt(4 / ROWS)


def said(rng: np.random.Generator, law: np.ndarray | float = 0.0, walk: float = 0.0) -> TargetFindings:
    """The loop on a gyro that swings for a minute, has a ``law`` in its bias and walks so far in a row [rad/s]."""
    rows = np.size(law) if np.ndim(law) else ROWS
    angle = SWING * np.sin(2 * np.pi * DT / PERIOD * np.arange(rows + 1))
    noise = WHITE * rng.standard_normal(rows) + walk * np.cumsum(rng.standard_normal(rows))
    gyro = Channel(np.diff(angle) / DT + noise + law, "rad/s", "interval")
    run = Recording(DT * np.arange(1.0, rows + 1), {"gyro": gyro, "table_angle": Channel(angle[1:], "rad")}, label="a")
    (target,) = closed(run, manifest(), catalogue=SLOW).targets
    return target


def speaks(target: TargetFindings) -> bool:
    """Whether it is named, or said that it may be."""
    own = [reason for reason in target.reasons if reason.startswith("bias_")]
    assert not own or target.verdict not in ("effects-found", "nothing-significant")
    return bool(own or target.added)


def keys_of(target: TargetFindings) -> set[str]:
    """The same with the orders of what has them."""
    orders = {f"{a.effect}:{a.order}" for a in target.added if a.order is not None}
    return orders | set_of(target)


def set_of(target: TargetFindings) -> set[str]:
    """What is named, and what may stand in its place."""
    return {key for added in target.added for key in (added.effect, *added.confounded_with)}


def test_a_drift_of_eight_deviations_in_a_minute_is_in_a_set_with_noise() -> None:
    """So is a step. The search, which fits 60 % of that minute, passed nearly all of these in silence.

    Of 20 such drifts 15 are named, of 20 steps 18: fewer than four of these six have a chance of 1 %.
    """
    rng, t = np.random.default_rng(1), np.arange(ROWS) / ROWS
    laws = (("bias_drift", 8 * DRIFT * t), ("bias_step", 8 * STEP * (t > 0.45)))
    found = [(key, said(rng, law)) for _ in range(3) for key, law in laws]
    named = [(key, target) for key, target in found if target.added]
    assert len(named) >= 4 and all(key in set_of(target) for key, target in named)
    assert all("rate_random_walk" in set_of(target) for _, target in named if target.verdict == "confounded")


def test_a_step_among_the_held_out_rows_is_not_passed_in_silence() -> None:
    """No fitted row tells it: of 20 such steps 15 are said; fewer than two of these four have a chance of 5 %."""
    rng, t = np.random.default_rng(3), np.arange(ROWS) / ROWS
    assert sum(speaks(said(rng, 8 * STEP * (t > 0.7))) for _ in range(4)) >= 2


def test_noise_alone_is_not_said_to_drift() -> None:
    """White, or with a walk: where 1 % of each would be said to drift, two of six come in one of 700 such tests."""
    rng = np.random.default_rng(2)
    assert sum(speaks(said(rng, walk=walk)) for walk in (0.0, 1e-5) for _ in range(3)) <= 1


def of_motion(rng: np.random.Generator, rows: int, size: float) -> np.ndarray:
    """What the motion leaves of other axes and of a reference's filter between 0.1 and 1 Hz, shape (rows,)."""
    spectrum, f = np.fft.rfft(rng.standard_normal(rows)), np.fft.rfftfreq(rows, DT)
    left = np.fft.irfft(spectrum * ((f >= 0.1) & (f <= 1.0)), rows)
    return np.asarray(size * left / left.std())


def test_a_drift_below_the_frequencies_of_the_motion_is_said() -> None:
    """What the motion leaves is three times the noise of a row, and hid drifts that it has no part in.

    Of twelve such drifts, of nineteen deviations of the white noise, all are said; all were passed in silence. Their
    sizes by the fitted rows are less than a third of a deviation, and have no name. Of 100 runs without a drift three
    speak of one.
    """
    rng, rows = np.random.default_rng(5), 2000
    left = of_motion(rng, rows, 3 * WHITE)
    drifts = said(rng, left + 1.5 * WHITE * np.arange(rows) / rows)
    assert speaks(drifts) and not drifts.added
    assert not speaks(said(rng, left))


def warmed(rng: np.random.Generator, size: float) -> TargetFindings:
    """The loop on a swinging gyro that goes with a temperature that rises and falls, by ``size`` [rad/s/K]."""
    t = DT * np.arange(1.0, ROWS + 1)
    heat = 293 + 3 * np.sin(2 * np.pi * t / (0.7 * ROWS * DT))
    angle = SWING * np.sin(2 * np.pi * DT / PERIOD * np.arange(ROWS + 1))
    rate = np.diff(angle) / DT + size * (heat - 293) + WHITE * rng.standard_normal(ROWS)
    channels = {
        "gyro": Channel(rate, "rad/s", "interval"),
        "table_angle": Channel(angle[1:], "rad"),
        "temperature": Channel(heat, "K"),
    }
    causes = (*SLOW, by_key("bias_temperature"), by_key("bias_temperature_rate"))
    (target,) = closed(Recording(t, channels, label="a"), manifest(), catalogue=causes).targets
    return target


def test_what_the_temperature_does_is_among_the_laws_of_all_rows() -> None:
    """Of eight deviations in a minute: six of ten have it named by the fitted rows, these by all rows, in a set."""
    size = 8 * WHITE / np.sqrt(ROWS) / (3 / np.sqrt(2))
    for seed in (5, 6, 7):
        assert {"bias_temperature:1", "rate_random_walk"} <= keys_of(warmed(np.random.default_rng(seed), size))


def test_a_temperature_that_does_nothing_is_not_among_them() -> None:
    """Of ten such runs none speaks of it: one of three comes in fewer than one of ten such tests."""
    assert not any(speaks(warmed(np.random.default_rng(seed), 0.0)) for seed in (1, 2, 3))


def with_rests(rng: np.random.Generator, law: np.ndarray | float = 0.0, walk: float = 0.0) -> TargetFindings:
    """The loop on a gyro on a record player that stands three times, and shakes ten times as much where it turns."""
    rate = np.repeat([0.0, 3.5, 0.0, 4.7, 0.0], ROWS)
    loud = np.where(rate > 0, 10 * WHITE, WHITE)
    noise = loud * rng.standard_normal(rate.size) + walk * np.cumsum(rng.standard_normal(rate.size))
    time = np.arange(1.0, rate.size + 1)
    channels = {"gyro": Channel(rate + noise + law, "rad/s"), "table_rate": Channel(rate, "rad/s", source="command")}
    (target,) = closed(Recording(time, channels, label="a"), manifest(), catalogue=SLOW).targets
    return target


def test_what_the_rests_of_a_table_tell_is_said_though_it_is_loud_where_it_turns() -> None:
    """A drift by three times the noise of a row, fifty deviations between the rests."""
    t = np.arange(5 * ROWS) / (5 * ROWS)
    assert speaks(with_rests(np.random.default_rng(3), 3 * WHITE * t))


def test_rests_between_which_noise_wanders_alone_are_not_said_to_drift() -> None:
    """White, or with walks that are seen in a rest, or hardly: less than 1 % of each would be said to drift."""
    rng = np.random.default_rng(4)
    assert not any(speaks(with_rests(rng, walk=walk)) for walk in (0.0, 1e-5, 1e-4))


#: Rows that an attitude sways, how far its rate does [rad/s], its period [s], and what is left of it after a row.
SWAYED, SWAY, SWAY_PERIOD, DAMPING = 1200, 0.01, 2.5, 0.9


def is_said(seed: int, drift: float) -> bool:
    """Whether a change of the bias is said of two minutes beside an attitude that sways, drifting so far [rad/s]."""
    rng = np.random.default_rng(seed)
    angle = 1.5 * np.sin(2 * np.pi * DT / 7.0 * np.arange(SWAYED + 1))
    poles = [1.0, -2 * DAMPING * np.cos(2 * np.pi * DT / SWAY_PERIOD), DAMPING**2]
    sway = lfilter([1.0], poles, rng.standard_normal(SWAYED + 200))[200:]
    rate = np.diff(angle) / DT + SWAY * sway / np.std(sway) + drift * np.arange(SWAYED) / SWAYED
    gyro = Channel(rate + 0.1 * SWAY * rng.standard_normal(SWAYED), "rad/s", "interval")
    run = Recording(
        DT * np.arange(1.0, SWAYED + 1), {"gyro": gyro, "table_angle": Channel(angle[1:], "rad")}, label="a"
    )
    (target,) = closed(run, manifest(), catalogue=SLOW).targets
    return any(reason.startswith("bias_") for reason in target.reasons)


def test_a_drift_of_twice_the_sway_is_said_beside_the_doubt() -> None:
    """A walk hides each by itself. Of six five are said; fewer than two of three such have a chance of 8 %."""
    assert sum(is_said(seed, 2 * SWAY) for seed in (1, 2, 3)) >= 2


def test_sway_alone_is_not_said_to_drift() -> None:
    """Of 30 such runs none was: one of three comes in fewer than one of ten such tests."""
    assert not any(is_said(seed, 0.0) for seed in (1, 2, 3))
