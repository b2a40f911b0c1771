"""Rate tests to evaluate: ladders of a table with a gyro, as recordings and as files with a manifest."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from insenv.core.recording import Channel, Floats, Recording, Segment
from insenv.core.units import DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR

#: The published rates without their zeros [deg/s].
POSITIVE = (0.5, 0.8, 1, 2, 5, 8, 10, 15, 18, 19, 20, 21, 22, 25, 28, 30, 35)
PUBLISHED = (*POSITIVE, *(-rate for rate in POSITIVE[::-1]))
SHORT = tuple(sign * rate for rate in (5, 10, 20, 25, 30, 35) for sign in (1, -1))
N = 0.12 * DEG_PER_SQRT_HOUR
ANOMALY = 0.033718 * DEG

MANIFEST = """\
title = "{title}"
data = [{data}]
{form}
[channels]
time = {{ column = {t}, unit = "s" }}
gyro = {{ column = {gyro}, unit = "deg/s", covers = "interval" }}
{table}
[site]
latitude = "32.03 deg"

[mounting]
tilt = "90 deg"

[model]
target = "gyro"
declared = ["bias", "scale_factor"]
"""


def anomaly(rate: Floats) -> Floats:
    """The local fault of the published gyro [rad/s]."""
    away = (np.abs(rate) - 20 * DEG) / (0.22 * DEG)
    return ANOMALY * np.sign(rate) * np.exp(-0.5 * away**2)


def commanded(rates: Sequence[float], sampling: float, extra: float = 1.0, rest: float = 30.0) -> Floats:
    """Table rate of each interval [rad/s], shape (n,): a rest, each rate for one turn and some, a rest."""
    spans = [(0.0, rest), *((r, 360 / abs(r) + extra) if r else (0.0, rest) for r in rates), (0.0, rest)]
    return np.concatenate([np.full(round(span * sampling), r * DEG) for r, span in spans])


def read_out(rate: Floats, sampling: float, seed: int, *, k: float = 1.0, bias: float = 0.0, n: float = N) -> Floats:
    """Output for a table rate, shape of the rate."""
    white = np.random.default_rng(seed).standard_normal(rate.shape) * n * np.sqrt(sampling)
    return k * rate + bias + white


def recording(rate: Floats, gyro: Floats, sampling: float, **more: Channel) -> Recording:
    """A table's run; arrays of shape (..., n)."""
    t = np.arange(1, rate.shape[-1] + 1) / sampling
    angle = np.cumsum(rate / sampling, axis=-1)
    return Recording(t, {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad"), **more})


def cut(whole: Recording, sizes: Sequence[int]) -> list[Recording]:
    """The same in chunks whose sizes are taken in turn."""
    chunks, start, turn = [], 0, 0
    while start < len(whole):
        stop = min(len(whole), start + sizes[turn % len(sizes)])
        channels = {n: Channel(c.values[..., start:stop], c.unit, c.covers) for n, c in whole.channels.items()}
        segments = tuple(
            Segment(s.label, max(s.start, start) - start, min(s.stop, stop) - start)
            for s in whole.segments
            if s.start < stop and s.stop > start
        )
        if whole.segments and not segments:
            segments = (Segment("", 0, 0),)
        chunks.append(Recording(whole.t[start:stop], channels, segments))
        start, turn = stop, turn + 1
    return chunks


def write(
    folder: Path,
    name: str = "test",
    form: str = "npz",
    power_ups: int = 2,
    rates: Sequence[float] = SHORT,
    fault: bool = True,
) -> Path:
    """The manifest of a test of so many ladders and a longer rest, beside its files."""
    folder.mkdir(parents=True, exist_ok=True)
    sampling, files = 20.0, []
    for q in range(power_ups + 1):
        rate = commanded(rates, sampling) if q < power_ups else np.zeros(round(400 * sampling))
        gyro = read_out(rate, sampling, 10 + q, k=1 + 1e-5 * q, bias=(5 + q) * DEG_PER_HOUR)
        gyro = gyro + anomaly(rate) if fault else gyro
        t = np.arange(1, len(rate) + 1) / sampling
        files.append(_file(folder / f"{name}_{q + 1}", form, (t, gyro / DEG, np.cumsum(rate / sampling) / DEG)))
    raw = form == "float64-le"
    columns = (0, 1, 2) if raw else ('"t"', '"gyro"', '"angle"')
    path = folder / f"{name}.toml"
    path.write_text(
        MANIFEST.format(
            title=name,
            data=", ".join(f'"{file}"' for file in files),
            form='format = "float64-le"\ncolumns = 3' if raw else "",
            t=columns[0],
            gyro=columns[1],
            table=f'table_angle = {{ column = {columns[2]}, unit = "deg" }}',
        )
    )
    return path


def _file(stem: Path, form: str, columns: tuple[Floats, ...]) -> str:
    names = ("t", "gyro", "angle")
    path = stem.with_suffix({"npz": ".npz", "csv": ".csv", "float64-le": ".bin"}[form])
    if form == "npz":
        t, gyro, angle = columns
        np.savez(path, t=t, gyro=gyro, angle=angle)
    elif form == "csv":
        lines = (",".join(f"{v!r}" for v in row) for row in zip(*(c.tolist() for c in columns), strict=True))
        path.write_text("\n".join([",".join(names), *lines]) + "\n")
    else:
        np.stack(columns, axis=1).astype("<f8").tofile(path)
    return path.name
