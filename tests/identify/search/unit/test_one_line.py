"""A line that shakes a whole unit: sure on some channels, and looked for at that frequency alone on the others."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from insenv.close import close
from insenv.identify.findings import TargetFindings

AXES = ("gyro_x", "gyro_y", "gyro_z")
DT, N, FREQUENCY = 0.025, 2400, 10.0


def shaken(folder: Path, sizes: tuple[float, ...], seed: int, until: float = 1.0) -> dict[str, TargetFindings]:
    """A triad at rest for a minute: white noise, and a line whose phase wanders, of so many sigma on each axis."""
    rng, t = np.random.default_rng(seed), DT * np.arange(N)
    phase = 2 * np.pi * FREQUENCY * t + 0.12 * np.cumsum(rng.standard_normal(N))
    line = np.cos(phase) * (t < until * t[-1])
    return written(folder, 1e-3 * (rng.standard_normal((3, N)) + np.outer(sizes, line)))


def written(folder: Path, read: np.ndarray) -> dict[str, TargetFindings]:
    """The findings on the axes of a unit at rest, shape (3, n) [rad/s]."""
    np.savez(folder / "bench.npz", **dict(zip(AXES, read, strict=True)))
    channels = [f'{axis} = {{ column = "{axis}", unit = "rad/s" }}' for axis in AXES]
    head = ['data = "bench.npz"', "[channels]", f'time = {{ rate = "{1 / DT:g} Hz" }}']
    tail = ["[model]", f"target = {json.dumps(AXES)}", 'declared = ["bias"]']
    (folder / "bench.toml").write_text("\n".join([*head, *channels, *tail]) + "\n", encoding="utf-8")
    # Lines alone are looked for: what else may be there has no part in what an axis learns of another.
    return {target.target: target for target in close(folder / "bench.toml", effects=("tone",)).targets}


def has_line(found: TargetFindings) -> bool:
    return any(added.effect == "tone" for added in found.added)


def test_a_line_of_two_axes_is_found_where_it_is_weak(tmp_path: Path) -> None:
    """By itself the third axis shows it in half of these."""
    found = [shaken(tmp_path, (1.5, 1.2, 0.35), seed) for seed in range(6)]
    assert all(has_line(one["gyro_x"]) for one in found)
    assert sum(has_line(one["gyro_z"]) for one in found) >= 5


def test_an_axis_that_is_not_shaken_has_no_line(tmp_path: Path) -> None:
    found = [shaken(tmp_path, (1.5, 1.2, 0.0), seed) for seed in range(8)]
    assert not any(has_line(one["gyro_z"]) for one in found)


def test_an_axis_that_is_held_at_nought_does_not_stop_the_others(tmp_path: Path) -> None:
    """A unit whose chip holds a gyro at rest but for some rows of one step: no spectrum in the stretch beside them."""
    rng, t = np.random.default_rng(1), DT * np.arange(N)
    read = 1e-3 * (rng.standard_normal((3, N)) + np.outer((1.5, 1.5, 0.0), np.cos(2 * np.pi * FREQUENCY * t)))
    for rows in ([N - 300], [60, 61]):
        read[2] = 1e-3 * np.isin(np.arange(N), rows)
        found = written(tmp_path, read)
        assert has_line(found["gyro_x"]) and has_line(found["gyro_y"])
        assert ("gyro_z" in found) is (60 in rows)
        assert not any(has_line(one) for axis, one in found.items() if axis == "gyro_z")
