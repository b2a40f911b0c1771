"""A gyro that is right beside an angle that is read in steps: lines of the steps are none of the instrument."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import closed, manifest, use

from insenv.core.recording import Channel, Floats, Recording, Site
from insenv.core.series.rounding import counter_step
from insenv.identify.findings import Findings
from insenv.identify.prepare.binned import binned
from insenv.identify.prepare.excess import beside_steps
from insenv.identify.prepare.spectral.lines import Line
from insenv.identify.prepare.spectral.wandering import left_of

RATE, SECONDS = 100.0, 160.0
#: An encoder of 12 bits.
STEP = 2 * np.pi / 2**12


def driven(kind: str) -> tuple[Floats, Floats]:
    """Rate [rad/s] and angle of a table that turns there and back, or in stairs."""
    t = np.arange(0.0, SECONDS, 1e-3)
    way = {"reversals": np.where((t / 20.0).astype(int) % 2, -0.87, 0.87), "stairs": 0.05 * np.floor(t / 20.0) - 0.21}
    ramps = np.full(1000, 1e-3)
    rate = np.convolve(np.append(np.full(999, way[kind][0]), way[kind]), ramps, "valid")
    return rate, np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]))) * 1e-3


def said(
    kind: str,
    seed: int,
    line: float = 0.0,
    frequency: float = 23.7,
    declared: float = 0.0,
    walk: float = 0.0,
    cubic: float = 0.0,
    white: float = 2e-3,
) -> Findings:
    """The loop on a gyro of ``white`` a row, with a line and a ``cubic`` of its own; of a walk ``declared`` is told."""
    rng = np.random.default_rng(seed)
    rate, angle = driven(kind)
    t = np.arange(1, int(RATE * SECONDS)) / RATE
    fine = 1e-3 * np.arange(len(angle))
    gyro = np.interp(t, fine, rate) + white * rng.standard_normal(len(t)) + line * np.sin(2 * np.pi * frequency * t)
    gyro = gyro + cubic * np.interp(t, fine, rate) ** 3 + walk * np.cumsum(rng.standard_normal(len(t)))
    read = np.floor(np.interp(t, fine, angle) / STEP) * STEP
    channels = {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(read, "rad")}
    noise = {"angle_random_walk": declared} if declared else None
    asked = manifest(("gyro",), ("bias", "scale_factor"), noise=noise)
    return closed(Recording(t, channels, site=Site(gravity=9.8), label="run"), asked)


@pytest.mark.parametrize("kind", ["reversals", "stairs"])
def test_the_steps_of_an_angle_make_no_line_of_the_gyro(kind: str) -> None:
    """Without this six and seven lines were named, beside curves of rate and angle."""
    for seed in range(2):
        found = said(kind, seed)
        (target,) = found.targets
        assert [a.effect for a in target.added] == []
        assert any("steps of the table's angle" in remark for remark in found.remarks)


def test_noise_of_the_steps_is_none_beyond_what_was_declared_of_the_gyro() -> None:
    """Its 0.2 mrad/sqrt(s) were declared, and its angle wanders by sixty times that beside them."""
    (target,) = said("stairs", 0, declared=2e-4).targets
    assert target.verdict == "nothing-significant"


def test_noise_of_the_gyro_beyond_what_was_declared_is_said() -> None:
    (target,) = said("stairs", 0, declared=2e-4, walk=3e-5).targets
    assert target.verdict != "nothing-significant"


def test_a_line_that_the_gyro_has_is_named() -> None:
    """Of 10 mrad/s, where the steps make lines of up to 33: its angle is a twentieth of a step."""
    (target,) = said("stairs", 1, line=1e-2).targets
    (tone,) = target.added
    frequency = next(p for p in tone.parameters if p.parameter == "f")
    assert frequency.value == pytest.approx(23.7, abs=0.01)


def test_round_rates_are_no_steps_of_an_encoder() -> None:
    """At 2.5 and 5 deg/s, ten rows a second, an angle goes by whole quarters of a degree; so do its ramps."""
    rate = np.repeat([0.0, 2.5, 5.0, -2.5], 200)
    ramps = np.convolve(np.append(np.zeros(3), rate), np.full(4, 0.25), "valid")
    assert counter_step(0.1 * np.cumsum(rate)) == 0.0
    assert counter_step(0.1 * np.cumsum(ramps)) == 0.0
    assert counter_step(np.cumsum(np.sin(0.01 * np.arange(800.0)))) == 0.0


@pytest.mark.parametrize("digits", [4, None])
def test_steps_of_an_encoder_are_found_behind_printed_digits(digits: int | None) -> None:
    _, angle = driven("stairs")
    read = np.rad2deg(np.floor(angle[::10] / STEP) * STEP)
    printed = np.asarray(read if digits is None else np.round(read, digits), float)
    assert counter_step(printed) == pytest.approx(np.rad2deg(STEP), rel=1e-3)


def test_a_cubic_is_told_beside_an_encoder_whose_lines_were_found() -> None:
    """Counts make up for each other over a dwell; under a window of the bins, which rejected their lines, they did not.

    Of 29 deviations, it was none: noise takes away half of them in no recording.
    """
    (target,) = said("stairs", 0, cubic=0.05, white=1e-4).targets
    assert [a.effect for a in target.added] == ["scale_factor_cubic"]


def test_a_surprise_is_worth_what_it_is_beside_those_that_steps_alone_make() -> None:
    """Of eight recordings of steps and noise alone one had 2e-5 in a test: 3e-7 is none there, and 1e-40 is one."""
    assert beside_steps(3e-7, 2e-5) > 0.03
    assert beside_steps(1e-40, 2e-5) < 1e-7
    assert beside_steps(3e-7, 0.3) == 3e-7
    assert beside_steps(1e-6, 1e-9) > 1 / 9


def test_what_is_left_of_a_damped_line_is_no_tone() -> None:
    """As nearly as 24 s of fitted bins tell a frequency: to 0.04 Hz."""
    t = np.arange(4000) / RATE
    run = Recording(t, {"gyro": Channel(np.sin(t), "rad/s"), "table_angle": Channel(-np.cos(t), "rad")})
    problem = binned(manifest(), (run,), (use(len(t)),), "gyro", 2)
    line = Line(0, 2.0, 1e-3, 1e-3, 1e-4, 0.0, True, 0.1, 1e-9, of_counts=True)
    wandering = replace(line, steady=False, of_counts=False)
    assert left_of(problem, (line,), 2.03) is line
    assert left_of(problem, (line,), 2.05) is None
    assert left_of(problem, (wandering,), 2.0) is wandering
    assert left_of(problem, (replace(line, of_counts=False),), 2.0) is None


@pytest.mark.parametrize(("part", "named"), [(3.0, True), (0.05, False)])
def test_a_wave_of_the_encoder_is_more_than_a_small_part_of_its_step(part: float, named: bool) -> None:
    """Twice a turn; of a twentieth of a step the other waves of the steps are as tall."""
    rng = np.random.default_rng(2)
    rate, angle = driven("reversals")
    t = np.arange(1, int(RATE * SECONDS)) / RATE
    fine = 1e-3 * np.arange(len(angle))
    gyro = np.interp(t, fine, rate) + 2e-5 * rng.standard_normal(len(t))
    turned = np.interp(t, fine, angle)
    read = np.floor((turned + part * STEP * np.cos(2 * turned + 0.3)) / STEP) * STEP
    channels = {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(read, "rad")}
    found = closed(
        Recording(t, channels, site=Site(gravity=9.8), label="run"), manifest(("gyro",), ("bias", "scale_factor"))
    )
    keys = {f"{one.effect}:{one.order}" for one in found.targets[0].added}
    assert ("encoder_harmonic:2" in keys) is named
    refused = {r.effect: r.reason for r in found.targets[0].rejected}
    assert named or "of a step of the encoder" in refused.get("encoder_harmonic:2", "of a step of the encoder")
