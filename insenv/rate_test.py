"""The rate test of a manifest: scale factor, bias, stability, with the plug-ins `rate_line` and `static_bias`.

The files are read in chunks, so that a recording may be longer than memory. Each data file begins with a power-up of
its own; within a file the channel "power" tells the others, and of one file alone the labels ("rate +20 deg/s #3").
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.rate_test import RateLineResult, RateTest, StaticResult, Valued
from insenv.core.recording import Channel, Recording
from insenv.core.units import DEG, ZERO_CELSIUS
from insenv.data.manifest import Manifest, RunSpec, load_manifest
from insenv.data.manifest.spec import GYROS
from insenv.data.reference import is_in_points, with_positions
from insenv.data.stream import stream_run

Progress = Callable[[str], None]
#: A run that rests for this share of its time is a test at rest.
_AT_REST = 0.9


@dataclass(frozen=True)
class _Run:
    """What one run gave.

    Rows, time [s], the state of the line after it, its test at rest, range of temperature [K], number of its last
    power-up and how many there were in it; 0: nothing tells.
    """

    rows: int
    duration: float
    line: Any
    static: StaticResult | None
    temperature: tuple[float, float]
    power_up: float
    power_ups: int


def rate_test(
    manifest: str | Path,
    *,
    zeros: str = "auto",
    warm_up: float = 0.0,
    averaging: tuple[float, ...] | None = None,
    progress: Progress = lambda text: None,
) -> RateTest:
    """Evaluate the rate test that a manifest names.

    Parameters
    ----------
    manifest : str or Path
        Its target is the gyro under test.
    zeros : str
        How the static output is taken off the dwells: "auto", "ends", "interleaved", "none".
    warm_up : float
        Time after each power-up that the bias leaves out [s].
    averaging : tuple of float, optional
        Averaging times of the bias stability [s].
    progress : callable
        Told what is being done.

    Raises
    ------
    InputError
        If a file cannot be used, or there is neither a line nor a rest in it.
    """
    read = load_manifest(Path(manifest))
    target = _target(read)
    line, state, sheets = None, None, []
    found: list[_Run] = []
    parts: dict[str, Any] = {} if averaging is None else {"averaging": averaging}
    for run in read.runs:
        chunks = _chunks(read, run, target, found[-1].power_up if found else 0.0, progress)
        first = next(chunks)
        if is_in_points(with_positions(first)):
            wanted = "wanted the samples of dwells (insenv close-loop takes points)"
            raise InputError(f"{read.path}: each row is a point at one rate of the table; {wanted}")
        sheets.append(_datasheet(read, first, target))
        _check_alike(read, first, sheets)
        if line is None and _turns(read):
            line = find(ESTIMATORS, "rate_line")(sheets[0], zeros=zeros)
            state = line.reset()
        static = find(ESTIMATORS, "static_bias")(sheets[-1], warm_up=warm_up, **parts)
        found.append(_followed((line, state), static, first, chunks))
        state = found[-1].line
    return _assembled(read, target, found, None if line is None else line.result(state))


def _target(manifest: Manifest) -> str:
    gyros = [name for name in manifest.model.targets if name in GYROS]
    if len(gyros) != 1:
        given = ", ".join(manifest.model.targets)
        raise InputError(f"{manifest.path}: model.target = {given}; wanted one gyro, the instrument under test")
    return gyros[0]


def _turns(manifest: Manifest) -> bool:
    """Whether anything could tell the table's rate."""
    return not {"table_angle", "table_rate", "segment"}.isdisjoint(manifest.channels)


def _datasheet(manifest: Manifest, first: Recording, target: str) -> Datasheet:
    noise = {"gyro": dict(manifest.noise.get(target, {}))}
    return Datasheet(1 / first.dt, np.inf, site=first.site, mounting=first.mounting, noise=noise)


def _check_alike(manifest: Manifest, run: Recording, sheets: list[Datasheet]) -> None:
    """Runs of one test are of one instrument on one table."""
    first, last = sheets[0], sheets[-1]
    label = manifest.runs[0].label
    if (first.mounting, first.site) != (last.mounting, last.site):
        raise InputError(f"{manifest.path}: {run.label} is mounted or stands otherwise than {label}; wanted all alike")
    if abs(last.sampling / first.sampling - 1) > 1e-3:
        found = f"{run.label} has {last.sampling:.6g} Hz, {label} {first.sampling:.6g} Hz"
        raise InputError(f"{manifest.path}: {found}; wanted one sampling rate")


def _chunks(manifest: Manifest, run: RunSpec, target: str, before: float, progress: Progress) -> Iterator[Recording]:
    """Chunks of a run with the instrument under test as "gyro", its power-ups counted on from those ``before``."""
    later: float | None = None
    for chunk in stream_run(manifest, run, lambda share: progress(f"{run.label}: {share:4.0%}")):
        channels = {**chunk.channels, "gyro": chunk.channel(target)}
        if "power" in channels:
            numbers = chunk.values("power", "1")
            later = max(0.0, before + 1 - numbers[0]) if later is None else later
            channels["power"] = Channel(numbers + later, "1")
        elif len(manifest.runs) > 1:
            channels["power"] = Channel(np.full(len(chunk), before + 1.0), "1")
        yield replace(chunk, channels=channels)


def _followed(line: tuple[Any, Any], static: Any, first: Recording, others: Iterator[Recording]) -> _Run:
    """One run through both plug-ins, chunk by chunk."""
    plugin, state = line
    rest, rows, low, high, stop = static.reset(), 0, np.inf, -np.inf, 0.0
    power_up, power_ups = 0.0, 0
    chunk: Recording | None = first
    while chunk is not None:
        if plugin is not None:
            state = plugin.update(state, chunk)
        rest = static.update(rest, chunk)
        rows, stop = rows + len(chunk), float(chunk.t[-1])
        if "temperature" in chunk.channels:
            read = chunk.values("temperature", "K")
            low, high = min(low, float(read.min())), max(high, float(read.max()))
        if "power" in chunk.channels:
            numbers = chunk.values("power", "1")
            power_ups += int(np.count_nonzero(np.diff(numbers, prepend=power_up)))
            power_up = float(numbers[-1])
        chunk = next(others, None)
    duration = stop - float(first.t[0])
    return _Run(rows, duration, state, static.result(rest, first.label), (low, high), power_up, power_ups)


def _assembled(manifest: Manifest, target: str, runs: list[_Run], line: RateLineResult | None) -> RateTest:
    rests = [
        (run.static.duration < _AT_REST * run.duration, -run.static.duration, run.static) for run in runs if run.static
    ]
    static = min(rests, key=lambda r: r[:2])[2] if rests else None
    if line is None and static is None:
        raise InputError(f"{manifest.path}: neither two rates of the table nor a second at rest; wanted a rate test")
    biases = tuple(b for run in runs if run.static for b in run.static.bias_of_each)
    spread = Valued()
    if len(biases) > 1:
        sd = float(np.std(biases, ddof=1))
        spread = Valued(sd, sd / float(np.sqrt(2 * (len(biases) - 1))))
    return RateTest(
        manifest=str(manifest.path),
        title=manifest.title,
        conditions=_conditions(manifest, target, runs),
        rows=sum(run.rows for run in runs),
        duration=sum(run.duration for run in runs),
        line=line,
        static=static,
        bias_of_power_ups=biases,
        bias_repeatability=spread,
        remarks=tuple(_remarks(line, _turns(manifest))),
        filing=manifest.filing(),
    )


def _conditions(manifest: Manifest, target: str, runs: list[_Run]) -> dict[str, str]:
    """What the manifest tells of instrument and place."""
    first = manifest.runs[0]
    found = {
        "instrument": f"{manifest.title} ({target})",
        "data": ", ".join(run.file.name for run in manifest.runs),
        "power-ups": str(sum(r.power_ups for r in runs) or "one file; by the labels"),
        "sampling": f"{sum(r.rows - 1 for r in runs) / max(sum(r.duration for r in runs), 1e-9):.6g} Hz",
        "input axis": f"{first.mounting.tilt / DEG:.4g} deg above the table plane",
    }
    if first.site.latitude is not None:
        found["latitude"] = f"{first.site.latitude / DEG:.6g} deg"
    low, high = min(r.temperature[0] for r in runs), max(r.temperature[1] for r in runs)
    if np.isfinite(low):
        found["temperature"] = f"{low - ZERO_CELSIUS:.1f} to {high - ZERO_CELSIUS:.1f} degC"
    source = manifest.source
    if source is not None and (source.repository or source.licence):
        found["source"] = ", ".join(filter(None, (source.repository, source.licence)))
    return found


def _remarks(line: RateLineResult | None, told: bool) -> Iterator[str]:
    """``told``: whether anything tells the table's rate."""
    if line is None:
        yield (
            "The table never turned at two rates: there is no scale-factor line."
            if told
            else "No channel tells the table's rate: there is no scale-factor line, and all rows count as at rest."
        )
        return
    if parts := [d for d in line.dwells if d.rate and not d.turns]:
        yield (
            f"{len(parts)} of {len(line.dwells)} dwells have no whole turn and were averaged as they are: "
            "what goes with the table's angle does not average out of them."
        )
    if line.zero_method == "none":
        yield "No static output was taken off the dwells: their offset holds the bias."
    if np.isnan(line.earth_rate):
        yield "The Earth rate is in every bias: no latitude in the manifest."
