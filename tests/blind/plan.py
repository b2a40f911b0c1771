"""What a laboratory decides before it switches on: instrument, table, climate, sampling, what is declared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from blind import climate, noise, table
from blind.files import LAYOUTS, Column, Layout, rounded_up
from blind.noise import Noise
from blind.world import World

ROOT = np.sqrt


@dataclass(frozen=True)
class Plan:
    """All decisions but what is wrong."""

    world: World
    grade: str
    noise: Noise
    output: str  # "pulses", "increment" or "rate"
    pulse: float  # weight of a count [rad]
    encoder_step: float  # resolution of the encoder [rad]
    reference: str  # "angle", "rate", "both", or "none"
    thermometer: bool
    clock: bool  # whether there is a time column
    wrapped: bool
    site: bool
    declares_noise: bool
    layout: Layout
    scale_error: float
    bias: float
    words: int  # seed of headings, units and resolutions: two runs of one test have the same
    extra: tuple[Column, ...] = ()
    hold: int = 1  # samples for which the output repeats its value
    target: str = "gyro"
    level_earth: bool = True  # whether the Earth's level rate belongs to what is declared
    biases: tuple[float, ...] = (0.0,)  # of each run beside the bias [rad/s]
    gaps: tuple[tuple[float, float], ...] = ()  # shares of a run's time, from and to, that were not logged
    scattered: float = 0.0  # share of single rows that the logger dropped
    one_file: bool = False  # whether all runs stand in one file, with the number of the power-up

    @property
    def declared(self) -> tuple[str, ...]:
        w = self.world
        if not w.turning:
            return ("bias",)
        return ("bias", "scale_factor", *(("earth_rate",) if self.site else ()))


RATES = (1.0, 2.0, 5.0, 10.0, 10.0, 20.0, 25.0, 50.0, 100.0, 100.0, 200.0, 400.0)
#: Largest rate of the table [deg/s].
TOPS = {"laser": (15.0, 100.0), "fibre": (10.0, 120.0), "mems": (30.0, 300.0)}


def sampling(rng: np.random.Generator, large: bool, runs: int = 1) -> tuple[int, float]:
    """Number of samples of a run and their period."""
    most = (360_000 if large else 45_000) / runs
    while True:
        rate = float(rng.choice(RATES))
        n = int(rate * np.exp(rng.uniform(np.log(300), np.log(7200))))
        if 2400 / runs <= n <= most:
            return n, 1 / rate


def world(
    rng: np.random.Generator,
    profiles: Sequence[str],
    kinds: Sequence[str],
    grade: str,
    large: bool = False,
    runs: int = 1,
) -> World:
    n, dt = sampling(rng, large, runs)
    duration = n * dt
    profile = str(rng.choice(profiles))
    low, high = TOPS[grade]
    top = np.deg2rad(np.exp(rng.uniform(np.log(low), np.log(high))))
    # Ten samples a turn at least, and a bearable number of turns.
    top = min(top, 2 * np.pi / 10 / dt, np.deg2rad(600_000 / duration))
    tilted = profile not in ("rest", "positions") and rng.uniform() < 0.3
    kind = str(rng.choice(kinds))
    return World(
        n=n * runs,
        dt=dt,
        profile=profile,
        trajectory=table.draw(profile, duration, float(top), rng),
        climate=climate.Climate(kind, np.array([climate.draw(kind, duration, rng).values for _ in range(runs)])),
        tilt=float(np.deg2rad(rng.choice([20.0, 30.0, 45.0, 60.0]))) if tilted else np.pi / 2,
        latitude=float(np.deg2rad(rng.uniform(-60, 65))),
        # A rate at an instant and an encoder's angles agree only where the rate does not change from row to row.
        instant=grade == "mems" and profile in ("rest", "constant") and rng.uniform() < 0.6,
        reference=25.0 if rng.uniform() < 0.7 else 20.0,
        runs=runs,
    )


def plan(
    rng: np.random.Generator,
    profiles: Sequence[str] = table.PROFILES,
    kinds: Sequence[str] = climate.KINDS,
    encoder: bool = False,
    thermometer: bool = False,
    large: bool = False,
    grades: Sequence[str] = ("laser", "fibre", "mems"),
    several: bool = False,
) -> Plan:
    """One plan.

    ``encoder`` and ``thermometer`` say that the test cannot do without; ``several`` that it may have runs and gaps.
    """
    grade = str(rng.choice(grades))
    runs = int(rng.choice([1, 1, 1, 2, 3])) if several else 1
    w = world(rng, profiles, kinds, grade, large, runs)
    white = noise.draw(grade, rng)
    output = {"laser": "pulses", "fibre": rng.choice(["increment", "rate", "rate"]), "mems": "rate"}[grade]
    reference = "none" if not w.turning else "angle" if encoder else str(rng.choice(["angle", "angle", "both", "rate"]))
    if encoder and rng.uniform() < 0.4:
        reference = "both"
    tilted = w.tilt < 1.5
    site = w.turning and (tilted or rng.uniform() < 0.4)
    # Turning the axis through north needs the angle for the Earth's level part.
    reference = "both" if tilted and reference == "rate" else reference
    pulse = rounded_up(np.rad2deg(white.n) * 3600 * ROOT(w.dt) * rng.uniform(0.5, 8)) / 3600 * np.pi / 180
    step = rounded_up(np.rad2deg(white.n * rng.uniform(0.02, 0.3))) * np.pi / 180
    clock = bool(rng.uniform() < 0.8)
    gaps, scattered = losses(rng) if several and clock else ((), 0.0)
    bias = float(white.b * 20 * rng.standard_normal())
    return Plan(
        world=w,
        grade=grade,
        noise=white,
        output=str(output),
        pulse=float(pulse * rng.uniform(0.6, 1.4)),
        encoder_step=float(step),
        reference=reference,
        thermometer=thermometer or rng.uniform() < 0.8,
        clock=clock,
        wrapped=rng.uniform() < 0.4,
        site=site,
        declares_noise=rng.uniform() < 0.5,
        layout=LAYOUTS[int(rng.integers(len(LAYOUTS)))],
        scale_error=3e-4 * float(rng.standard_normal()),
        bias=bias,
        words=int(rng.integers(2**31)),
        # Of a second power-up: near the first one's.
        biases=(0.0, *(0.2 * bias * rng.standard_normal(runs - 1))),
        gaps=gaps,
        scattered=scattered,
        one_file=clock and runs > 1 and rng.uniform() < 0.3,
    )


def losses(rng: np.random.Generator) -> tuple[tuple[tuple[float, float], ...], float]:
    """Gaps of a run, as shares of its time, and the share of rows that were dropped one by one."""
    if rng.uniform() < 0.65:
        return (), 0.0
    starts = rng.uniform(0.05, 0.9, int(rng.integers(0, 4)))
    gaps = tuple((float(a), float(a + np.exp(rng.uniform(np.log(0.003), np.log(0.06))))) for a in starts)
    return gaps, float(rng.choice([0.0, 0.0, 0.002, 0.02]))
