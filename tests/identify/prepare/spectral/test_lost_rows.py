"""Lines of a log that loses rows: after each hundred of them, as a card that writes does, or here and there.

Seeds are fixed; each search may be wrong with the probability 1e-2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.findings import Added
from insenv.identify.prepare.spectral.lines import Line
from insenv.identify.prepare.spectral.lost_rows import lines_of_rows, longest, rows_of

DT, N = 0.01, 6000
Kept = NDArray[np.bool_]


def card(seed: int) -> Kept:
    """After each hundred rows 12 are lost."""
    return np.arange(N) % 112 < 100


def link(seed: int) -> Kept:
    """One row in seven is lost."""
    return np.random.default_rng([seed, 1]).random(N) > 1 / 7


LOSSES = (card, link)


def steady(t: Floats, frequency: float) -> Floats:
    return 0.5 * np.cos(2 * np.pi * frequency * t + 0.4)


def wandering(t: Floats, frequency: float) -> Floats:
    """Its phase moves by half a turn to and fro."""
    return 0.7 * np.cos(2 * np.pi * frequency * t + 1.5 * np.sin(2 * np.pi * t / 37))


def logged(kept: Kept, seed: int, line: Floats | float = 0.0) -> Recording:
    """A gyro at rest, white noise of 1 deg/s a row, with rows lost."""
    t: Floats = DT * np.arange(float(N))
    y = np.deg2rad(np.random.default_rng(seed).standard_normal(N) + line + 3.0)
    return Recording(t[kept], {"gyro": Channel(y[kept], "rad/s")})


def tones(recording: Recording) -> list[Added]:
    return [a for a in closed(recording, manifest()).targets[0].added if a.effect == "tone"]


@pytest.mark.parametrize("kept", LOSSES)
def test_rows_are_bridged_and_stand_at_their_times(kept: Callable[[int], Kept]) -> None:
    recording = logged(kept(0), 0)
    rows = rows_of(recording, np.ones(len(recording), bool))
    assert len(rows.index) == len(recording)
    assert np.allclose(recording.t[rows.index] - recording.t[0], rows.place * DT)


def test_long_gaps_part_rows_and_few_rows_are_not_bridged() -> None:
    parted = np.ones(N, bool)
    parted[2000:3500] = False
    sparse = np.random.default_rng(0).random(N) < 0.4
    for kept in (parted, sparse):
        recording = logged(kept, 1)
        wanted = np.ones(len(recording), bool)
        span, rows = longest(recording, wanted), rows_of(recording, wanted)
        assert rows.follow and len(rows.index) == span.stop - span.start


@pytest.mark.parametrize("kept", LOSSES)
@pytest.mark.parametrize("frequency", [2.51, 17.3, 34.3])
def test_a_steady_line_has_its_amplitude_and_no_images(kept: Callable[[int], Kept], frequency: float) -> None:
    """Within five deviations, 1e-6 a case; a line of 50 noise has images at the gaps' frequencies, none is listed."""
    recording = logged(kept(1), 2)
    rows = rows_of(recording, np.ones(len(recording), bool))
    values = np.rad2deg(recording.channels["gyro"].values) + 100 * steady(recording.t, frequency)
    found = lines_of_rows(rows, recording.t, recording.dt, values, 0.0, 0, 0.5)
    assert [round(line.frequency, 2) for line in found] == [round(frequency, 2)]
    assert abs(found[0].amplitude - 50) < 5 * found[0].amplitude_sd
    assert np.std(values - found[0].at(recording.t)) < 1.1


@pytest.mark.parametrize("kept", LOSSES)
@pytest.mark.parametrize("line", [steady, wandering])
@pytest.mark.parametrize("frequency", [2.51, 34.3])
def test_a_line_is_one_tone_where_it_is(
    kept: Callable[[int], Kept], line: Callable[[Floats, float], Floats], frequency: float
) -> None:
    """No stretch without a gap has 256 rows, and bins without their gaps have the line elsewhere."""
    recording = logged(kept(2), 3, line(DT * np.arange(float(N)), frequency))
    found = tones(recording)
    assert len(found) == 1
    (told,) = (p.value for p in found[0].parameters if p.parameter == "f")
    assert told == pytest.approx(frequency, abs=0.1)


@pytest.mark.parametrize("kept", LOSSES)
def test_noise_has_none(kept: Callable[[int], Kept]) -> None:
    """Ten recordings, 1e-2 each: more than one has a line with the probability 4e-3."""
    assert sum(bool(tones(logged(kept(seed), seed))) for seed in range(10, 20)) <= 1


def slipping(seed: int, line: float) -> Recording:
    """A gyro whose logger writes after each hundred rows and goes on at another phase; a line on for a third of time.

    The rows stand up to half a row off an even clock, by what the clock has slipped until then.
    """
    rng, n = np.random.default_rng([seed, 2]), 1800
    pauses = (np.arange(n) % 100 == 0) * (3 + 0.12 * rng.standard_normal(n))
    t = DT * (np.arange(n) + np.cumsum(pauses))
    t = t - DT * 0.2 * np.sin(2 * np.pi * t / t[-1])
    on = (t / 4.0) % 1 < 0.35
    y = np.deg2rad(rng.standard_normal(n) + line * on * np.cos(2 * np.pi * 12.29 * t) + 3.0)
    return Recording(t, {"gyro": Channel(y, "rad/s")})


@pytest.mark.parametrize("seed", range(4))
def test_a_logger_that_slips_has_lines(seed: int) -> None:
    """Of a fault that comes and goes "nothing significant" was said: the longest stretch without a gap has 100 rows."""
    recording = slipping(seed, 2.0)
    rows = rows_of(recording, np.ones(len(recording), bool))
    assert len(rows.index) == len(recording)
    found = lines(recording)
    assert found and found[0].frequency == pytest.approx(12.29, abs=0.15)
    assert lines(slipping(seed, 0.0)) == ()  # each may be wrong with 1e-4


def lines(recording: Recording) -> tuple[Line, ...]:
    rows = rows_of(recording, np.ones(len(recording), bool))
    return lines_of_rows(rows, recording.t, recording.dt, recording.channels["gyro"].values, 0.0, 0, 0.5)


def test_rows_at_any_time_are_not_bridged() -> None:
    t = np.sort(np.random.default_rng(5).uniform(0.0, 30.0, 3000))
    recording = Recording(t, {"gyro": Channel(np.zeros(3000), "rad/s")})
    wanted = np.ones(3000, bool)
    assert len(rows_of(recording, wanted).index) == longest(recording, wanted).stop - longest(recording, wanted).start
