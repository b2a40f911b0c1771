"""Runs of a policy on a rate table with a gyro that has a fault at some rate, for the study of policies.

They are simulated at a low sampling rate, which is exact for what matters here: random walk, quantisation and the
encoder are sums over a dwell, and what the table does between two rates is left out of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.rate_table import rate_ladder_tally as tallies
from estimators.rate_table.rate_ladder import QueuePlace
from estimators.rate_table.rate_ladder_tally import Tally
from insenv.core.estimate import Datasheet, Limits
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.rows import rows
from insenv.core.units import ARCSEC, DEG, PPM
from insenv.effects.rate.scale import ScaleFactor
from insenv.plants.turntable import Encoder, Ripple, Turntable
from insenv.rig import Fitted, Normals, Readings, Rig
from insenv.sensors.instruments import Instrument, fog_b215

Maker = Callable[[Datasheet], Any]
#: The fault of the study: height and width; between which rates its centre lies [rad/s].
HEIGHT, WIDTH, BETWEEN = 0.033718 * DEG, 0.22 * DEG, (1 * DEG, 34.5 * DEG)
#: Run-to-run scale factor, so that there is something to find.
SCALE_SD = 60 * PPM
_PER_RUN = ("centre", "width", "height", "scale")
#: Length of a step, and of the longest run [s].
STEP, LONGEST = 1.0, 6000.0


@dataclass(frozen=True)
class Table:
    """The table of a study: limits [rad/s, rad/s^2], ripple, encoder, and the latency of the gyro [s]."""

    limits: Limits = field(default_factory=lambda: Limits(50 * DEG, 50 * DEG))
    ripple: Ripple = field(default_factory=Ripple)
    encoder: Encoder = field(default_factory=lambda: Encoder(noise=1 * ARCSEC))
    latency: float = 0.0


@dataclass(frozen=True)
class Runs:
    """R runs of one instrument: parameters of its fault [rad/s], none where the height is zero; relative error of K."""

    seeds: tuple[int, ...]
    centre: Floats
    width: Floats
    height: Floats
    scale: Floats

    def rig(self, instrument: Instrument, table: Table, sampling: float) -> Rig:
        """Instrument and table; the gyro sees the Earth at 32 degrees north."""
        sensor = instrument.sensor + ScaleFactor()
        theta = np.repeat(np.append(instrument.theta, 0.0)[None], len(self.seeds), axis=0)
        fault = {"c": self.height, "u0": self.centre, "s": self.width}
        for name, values in {f"scale_factor_anomaly.{k}": v for k, v in fault.items()}.items():
            theta[:, sensor.names.index(name)] = values
        theta[:, -1] = self.scale
        plant = Turntable(
            latitude=32.03 * DEG,
            max_rate=table.limits.rate,
            max_acceleration=table.limits.acceleration,
            ripple=table.ripple,
            encoder=table.encoder,
        )
        return Rig(plant, (Fitted(sensor, theta),), sampling)


@dataclass(frozen=True)
class Played:
    """What R runs came to: time of each [s], the policy's last state, the commanded rates and what was recorded."""

    time: Floats
    state: Any
    rate: Floats
    tally: Tally
    datasheet: Datasheet

    def rows(self, index: NDArray[np.int64]) -> Played:
        """The runs ``index`` alone."""
        state, tally = rows(self.state, index), rows(self.tally, index)
        return Played(self.time[index], state, self.rate[index], tally, self.datasheet)


def random_faults(n: int, seed: int = 1, width: float = WIDTH, height: float = HEIGHT) -> Runs:
    """Runs with a fault whose centre is uniform; a height of zero: without."""
    generator = np.random.default_rng(seed)
    centre = generator.uniform(*BETWEEN, n)
    scale = SCALE_SD * generator.standard_normal(n)
    return Runs(tuple(range(1000 * seed, 1000 * seed + n)), centre, np.full(n, width), np.full(n, height), scale)


def together(some: Runs, others: Runs) -> Runs:
    """Both one after the other: to step many runs takes little longer than to step few."""
    arrays = {name: np.concatenate([getattr(some, name), getattr(others, name)]) for name in _PER_RUN}
    return Runs((*some.seeds, *others.seeds), **arrays)


def datasheet(instrument: Instrument, table: Table, sampling: float) -> Datasheet:
    """What a policy is told."""
    names = dict(zip(instrument.sensor.names, instrument.theta, strict=True))
    noise = {
        kind: float(value)
        for name, value in names.items()
        if (kind := name.partition(".")[0]) in ("angle_random_walk", "quantization")
    }
    return Datasheet(sampling, LONGEST, limits=table.limits, noise={"gyro": noise}, encoder_noise=table.encoder.noise)


def play(
    maker: Maker,
    runs: Runs,
    instrument: Instrument | None = None,
    table: Table | None = None,
    sampling: float = 20.0,
    step: float = STEP,
) -> Played:
    """Run a policy until it stops in every run; it is asked every ``step`` seconds."""
    instrument, table = instrument or fog_b215(), table or Table()
    sheet = datasheet(instrument, table, sampling)
    policy, rig, n = maker(sheet), runs.rig(instrument, table, sampling), len(runs.seeds)
    normals, samples = Normals(rig, runs.seeds), round(step * sampling)
    state, chunk, now = policy.reset(n), None, rig.begin(normals.start())
    time, tally = np.full(n, np.nan), None
    late = np.zeros(n)
    while np.isnan(time).any() and now.samples < LONGEST * sampling:
        action, state = policy.act(state, chunk, None)
        time = np.where(np.isnan(time) & (action[:, 1] >= 0.5), now.samples / sampling, time)
        readings, now = rig.advance(now, action[:, 0], samples, normals.draw(samples))
        chunk, late = _chunk(readings, table.latency * sampling, late)
        place = state if isinstance(state, QueuePlace) else state.place
        if tally is None:
            tally = tallies.empty(np.shape(_queue(policy, state).rate)[-1], n)
        tally = tallies.added(tally, chunk, place, sheet)
    assert tally is not None
    rate = np.broadcast_to(_queue(policy, state).rate, tally.time.shape)
    return Played(time, state, rate, tally, sheet)


def _queue(policy: Any, state: Any) -> Any:
    return policy.queue if isinstance(state, QueuePlace) else state.queue


def _chunk(readings: Readings, late: float, before: Floats) -> tuple[Recording, Floats]:
    """A chunk with a gyro that is late by a share ``late`` of a sample, whose last output was ``before`` (R,)."""
    gyro = readings.outputs["gyro"]
    if late:
        earlier = np.concatenate([before[:, None], gyro[:, :-1]], axis=-1)
        shown = gyro + late * (earlier - gyro)
    else:
        shown = gyro
    angle = readings.references["table_angle"].values
    channels = {"gyro": Channel(shown, "rad/s", "interval"), "table_angle": Channel(angle, "rad")}
    return Recording(readings.t, channels), gyro[:, -1]
