"""The bench's lines for the rate table: 27 hours at rest at 2000 Hz, and the published list seven times.

Both run in a process of their own, so that the memory is that of the work and of what it imports, not of the bench.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bench_line import Line
from tqdm import tqdm

from estimators.at_rest.static_bias import Record, StaticBias
from estimators.rate_table.rate_line import RateLine
from insenv.core.estimate import Datasheet
from insenv.core.recording import Channel, Recording
from insenv.plants.turntable import Turntable
from insenv.rig import Fitted, Rig
from insenv.scenario import datasheet, load
from insenv.scenario.campaign import campaign
from insenv.sensors.instruments import fog_b215

HOURS, WARM = 27, 200_000
REPEATS, PREHEAT = 7, 1800.0
#: A bar on everything that takes longer [s].
PATIENCE = 2.0


def static_test() -> Iterator[Line]:
    """A fibre-optic gyro at rest, simulated and evaluated chunk by chunk; beside it the simulation alone."""
    found = _alone("static")
    yield Line(
        f"test at rest, {HOURS} h x 2000 Hz ({found['samples'] / 1e6:.0f} M samples)",
        f"{found['spent']:.1f} s",
        "<= 35 s",
        "the simulation alone (a twentieth, time x 20)",
        f"{found['simulation']:.1f} s",
        found["simulation"] / found["spent"],
    )
    yield Line(
        "    the same, peak memory in a process of its own",
        f"{found['peak']:.0f} MiB",
        "<= 300 MB",
        "before the first sample, imports alone",
        f"{found['imports']:.0f} MiB",
        found["imports"] / found["peak"],
    )


def ladder_test() -> Iterator[Line]:
    """The published list with seven power-ups, simulated and evaluated; beside it the simulation alone.

    By the clock, for the unit normals are drawn in a second thread.
    """
    found = _alone("ladder")
    yield Line(
        f"36 x {REPEATS} campaign at 2000 Hz ({found['samples'] / 1e6:.0f} M samples), by the clock",
        f"{found['spent']:.1f} s",
        "<= 3 s",
        "the simulation alone",
        f"{found['simulation']:.1f} s",
        found["simulation"] / found["spent"],
    )


def _alone(work: str) -> dict[str, float]:
    """What a process of its own found."""
    done = subprocess.run([sys.executable, str(Path(__file__)), work], stdout=subprocess.PIPE, check=True, text=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def static() -> dict[str, float]:
    """The test at rest."""
    imports = _peak()
    instrument = fog_b215()
    rig = Rig(Turntable(), (Fitted(instrument.sensor, instrument.theta),), instrument.rate)
    samples = int(HOURS * 3600 * instrument.rate)
    streamed(rig, WARM)  # compiles
    start = time.process_time()
    streamed(rig, samples)
    spent, peak = time.process_time() - start, _peak()
    start = time.process_time()
    for _ in rig.stream(1, samples // 20):
        pass
    alone = 20 * (time.process_time() - start)
    return {"samples": samples, "spent": spent, "peak": peak, "imports": imports, "simulation": alone}


def streamed(rig: Rig, samples: int) -> tuple[StaticBias, Record]:
    """The plug-in and its state after so many samples of a run at rest."""
    plugin = StaticBias(Datasheet(rig.rate, samples / rig.rate))
    state = plugin.reset()
    with tqdm(total=samples, desc="at rest", unit="sample", unit_scale=True, delay=PATIENCE, leave=False) as bar:
        for readings in rig.stream(1, samples):
            gyro = Channel(readings.outputs["gyro"], "rad/s", "interval")
            state = plugin.update(state, Recording(readings.t, {"gyro": gyro}))
            bar.update(len(readings.t))
    return plugin, state


def ladder() -> dict[str, float]:
    """The published list."""
    _ladder(1)  # compiles
    samples, spent = _ladder(REPEATS)
    return {"samples": samples, "spent": spent, "peak": _peak(), "simulation": _ladder(REPEATS, evaluated=False)[1]}


def _ladder(repeats: int, evaluated: bool = True) -> tuple[int, float]:
    """Samples, and time by the clock [s]."""
    scenario = load("rate_table/b215")
    plugin = RateLine(datasheet(scenario), zeros="ends")
    state, samples, start = plugin.reset(), 0, time.monotonic()
    for power_up, readings in campaign(scenario, 1, repeats, PREHEAT):
        n = len(readings.t)
        samples += n
        if evaluated:
            channels = {
                "gyro": Channel(readings.outputs["gyro"], "rad/s", "interval"),
                "table_angle": Channel(readings.references["table_angle"].values, "rad"),
                "power": Channel(np.full(n, float(power_up)), "1"),
            }
            state = plugin.update(state, Recording(readings.t, channels))
    if evaluated:
        plugin.result(state)
    return samples, time.monotonic() - start


def _peak() -> float:
    """Largest resident memory so far [MiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


ALL = (static_test, ladder_test)

if __name__ == "__main__":
    print(json.dumps({"static": static, "ladder": ladder}[sys.argv[1]]()))
