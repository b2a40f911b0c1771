"""Recordings that nobody makes on purpose: a few rows, rows of seconds, readings that stand still, clip, jump or walk.

Each of these ended in an error of the program itself once, or in a warning of a library: a mean of no rows, a spectrum
of nothing, a share of no error.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Floats


def reading(rng: np.random.Generator, n: int, kind: int) -> Floats:
    """Noise that is rounded, stuck, nought but for some rows, rings, steps, clips, is held, walks, or has spikes."""
    x = rng.standard_normal(n) * 10 ** rng.uniform(-5, -1)
    scatter, t = float(x.std()), np.arange(n)
    some = rng.integers(0, n, 12)
    width = int(rng.integers(2, 9))
    shapes = (
        np.round(x / (5 * scatter)) * 5 * scatter,
        np.where(t < rng.integers(1, n), x, x[0]),
        scatter * np.isin(t, some),
        x + 8 * scatter * np.sin(2 * np.pi * rng.uniform(0.01, 0.45) * t),
        x + 50 * scatter * ((some[0] <= t) & (t < some[0] + n // 6)),
        np.clip(x, -0.8 * scatter, 0.8 * scatter),
        x[t // width * width],
        0.1 * np.cumsum(x),
        x * np.where(np.isin(t, some[:3]), 1e4, 1.0),
    )
    return np.asarray(shapes[kind])


def recorded(folder: Path, rng: np.random.Generator) -> Path:
    """A table of one gyro, or a unit at rest, of 100 to 3000 rows 5 ms to 2 s apart, each channel of another kind."""
    n, dt, table = int(10 ** rng.uniform(2, 3.5)), float(10 ** rng.uniform(-2.3, 0.3)), rng.uniform() < 0.5
    rate = np.repeat(rng.integers(-2, 3, 12), -(-n // 12))[:n] * 10 ** rng.uniform(-2, 0.5) * table
    names = ["gyro"] if table else ["gyro_x", "gyro_y", "accel_z"][: rng.integers(1, 4)]
    columns = {
        "t": dt * np.arange(n),
        **{name: rate + reading(rng, n, int(rng.integers(9))) for name in names},
    }
    return written(folder, {**columns, "table_rate": rate} if table else columns, names)


def written(folder: Path, columns: Mapping[str, NDArray[np.floating]], targets: list[str]) -> Path:
    """The manifest of a recording with these columns in SI units, a table's where it has one."""
    np.savez(folder / "odd.npz", **columns)  # type: ignore[arg-type]
    units = {name: "m/s^2" if name.startswith("accel") else "rad/s" for name in columns if name != "t"}
    declared, more = ('"bias", "scale_factor"', "") if "table_rate" in columns else ('"bias"', 'procedure = "static"\n')
    lines = ['data = "odd.npz"', "[channels]", 'time = { column = "t", unit = "s" }']
    lines += [f'{name} = {{ column = "{name}", unit = "{unit}" }}' for name, unit in units.items()]
    positions = "accel_x" in targets
    declared, more = ('"accel_bias"', 'procedure = "multi-position"') if positions else (declared, more)
    lines += ["[model]", f"target = {json.dumps(targets)}", f"declared = [{declared}]", more]
    path = folder / "odd.toml"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize("seed", range(40))
def test_no_recording_ends_in_an_error_of_the_program(tmp_path: Path, seed: int) -> None:
    """Warnings are errors in these tests; a sentence about the file is none."""
    try:
        findings = close(recorded(tmp_path, np.random.default_rng(seed)))
    except InputError as error:
        assert str(error)
    else:
        assert findings.verdict


def test_a_table_may_be_logged_every_two_seconds_or_so(tmp_path: Path) -> None:
    """A mean over 0.3 s is one row at least: of rows that are uneven this was an error of a filter."""
    rng, n = np.random.default_rng(1), 900
    t = 2.0 * np.arange(n) + rng.uniform(0.0, 0.6, n)
    rate = 0.3 * np.sin(2 * np.pi * t / 120)
    columns = {"t": t, "gyro": rate + 1e-3 * rng.standard_normal(n), "table_rate": rate + 1e-4 * rng.standard_normal(n)}
    assert close(written(tmp_path, columns, ["gyro"])).verdict


@pytest.mark.parametrize("step", [0.0, 0.05, 0.5, 20.0])
@pytest.mark.parametrize("rate", [1.0, 50.0])
def test_rests_in_attitudes_may_be_read_in_steps(tmp_path: Path, step: float, rate: float) -> None:
    """Twelve rests of 20 s with turns between them: at rest readings stand still, or always (0.5 m/s^2 a step or more).

    Where every fifth window had no scatter at all, that of the others was compared with nothing.
    """
    rng, parts = np.random.default_rng(3), list[Floats]()
    for _ in range(12):
        up = rng.standard_normal(3)
        parts += [
            np.tile(9.81 * up / np.linalg.norm(up), (int(20 * rate), 1)),
            5 * rng.standard_normal((int(4 * rate), 3)),
        ]
    force = np.concatenate(parts) + 2e-3 * rng.standard_normal((sum(map(len, parts)), 3))
    read = np.round(force / step) * step if step else force
    names = ["accel_x", "accel_y", "accel_z"]
    columns = {"t": np.arange(len(read)) / rate, **dict(zip(names, read.T, strict=True))}
    try:
        assert close(written(tmp_path, columns, names)).verdict
    except InputError as error:
        assert str(error)
