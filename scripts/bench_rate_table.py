"""The bench's line for a test at rest of 27 hours at 2000 Hz: model, smoothing, bias stability and Allan deviation."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator

from bench_line import Line

from estimators.static_bias import Record, StaticBias
from insenv.core.estimate import Datasheet
from insenv.core.recording import Channel, Recording
from insenv.plants.turntable import Turntable
from insenv.rig import Fitted, Rig
from insenv.sensors.instruments import fog_b215

HOURS, WARM = 27, 200_000


def static_test() -> Iterator[Line]:
    """A fibre-optic gyro at rest, simulated and evaluated chunk by chunk; beside it the simulation alone."""
    instrument = fog_b215()
    rig = Rig(Turntable(), (Fitted(instrument.sensor, instrument.theta),), instrument.rate)
    samples = int(HOURS * 3600 * instrument.rate)
    streamed(rig, WARM)  # compiles
    start = time.process_time()
    streamed(rig, samples)
    spent = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start = time.process_time()
    for _ in rig.stream(1, samples // 20):
        pass
    alone = 20 * (time.process_time() - start)
    yield Line(
        f"test at rest, {HOURS} h x {instrument.rate:.0f} Hz ({samples / 1e6:.0f} M samples)",
        f"{spent:.1f} s",
        "<= 35 s",
        "the simulation alone (a twentieth, time x 20)",
        f"{alone:.1f} s",
        alone / spent,
    )
    yield Line("    the same, peak memory of the process", f"{peak:.0f} MiB", "<= 300 MB", "", "", None)


def streamed(rig: Rig, samples: int) -> tuple[StaticBias, Record]:
    """The plug-in and its state after so many samples of a run at rest."""
    plugin = StaticBias(Datasheet(rig.rate, samples / rig.rate))
    state = plugin.reset()
    for readings in rig.stream(1, samples):
        state = plugin.update(
            state, Recording(readings.t, {"gyro": Channel(readings.outputs["gyro"], "rad/s", "interval")})
        )
    return plugin, state


ALL = (static_test,)
