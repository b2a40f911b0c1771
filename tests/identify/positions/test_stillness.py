"""What stands still: as quiet as the unit is anywhere, steady in its means however noisy, and one rest for a knock.

False alarms: white noise wanders with a probability below 1e-12 (A of 20 windows of 50 rows is s^2 / 50).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from positions_cases import ACCELS, manifest

from insenv.core.errors import InputError
from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.positions.rests import Rests, find_rests

DT, ROWS = 0.01, 2000
T: Floats = DT * np.arange(ROWS, dtype=np.float64)
UP = (0.0, 0.0, 9.8)


def lying(seed: int, up: tuple[float, float, float] = UP, noise: float = 0.02) -> Floats:
    """Readings of a triad at rest, shape (3, n)."""
    return np.array(up)[:, None] + noise * np.random.default_rng(seed).standard_normal((3, ROWS))


def swinging(seed: int, period: float, size: float) -> Floats:
    """Readings of a triad that never rests."""
    phase = np.cumsum(2 * np.pi * DT / period * (1 + 0.3 * np.sin(2 * np.pi * T / 7)))
    return lying(seed) + size * np.stack([np.sin(phase), np.cos(1.3 * phase), 0.3 * np.sin(0.7 * phase)])


def vibrating(seed: int) -> Floats:
    return lying(seed, noise=0.6)


def rests(*files: Floats) -> Rests:
    runs = tuple(
        Recording(T, {name: Channel(x, "m/s^2") for name, x in zip(ACCELS, file, strict=True)}, label=f"file {i}")
        for i, file in enumerate(files, start=1)
    )
    model = manifest(ACCELS, ("accel_bias",))
    return find_rests(replace(model, runs=(None,) * len(runs)), runs, ACCELS)  # type: ignore[arg-type]


@pytest.mark.parametrize(("period", "size"), [(1.5, 0.5), (3.0, 1.0), (8.0, 4.0)])
def test_a_file_that_only_swings_has_no_rest(period: float, size: float) -> None:
    swing = swinging(1, period, size)
    with pytest.raises(InputError, match=r"no rest found in file 1 \(.*means wander.*moves\)"):
        rests(swing)
    found = rests(lying(2), swing, lying(3, (9.8, 0.0, 0.0)), lying(4, (0.0, 9.8, 0.0)))
    assert [rest.run for rest in found.rests] == [0, 2, 3]
    assert any("file 2: the means wander" in text for text in found.remarks)


@pytest.mark.parametrize("loud", [vibrating, lambda seed: lying(seed, noise=0.3).round(0)])
def test_a_file_that_is_noisy_and_steady_is_a_rest(loud: Callable[[int], Floats]) -> None:
    assert [r.run for r in rests(lying(1), loud(2), lying(3, (9.8, 0.0, 0.0))).rests] == [0, 1, 2]


def test_coarse_counts_that_stand_still_have_the_noise_of_their_rounding() -> None:
    files = [np.round(lying(k, up, 0.01) / 0.04) * 0.04 for k, up in enumerate((UP, (9.8, 0.0, 0.0), (0.0, 9.81, 0.0)))]
    whole = np.concatenate([*files, swinging(5, 0.8, 3.0)], axis=1)
    t = DT * np.arange(whole.shape[1], dtype=np.float64)
    run = Recording(t, {name: Channel(x, "m/s^2") for name, x in zip(ACCELS, whole, strict=True)})
    found = find_rests(manifest(ACCELS, ("accel_bias",)), (run,), ACCELS).rests
    assert [(r.start + 500) // ROWS for r in found] == [0, 1, 2]
    assert all(r.stop - r.start > 0.9 * ROWS for r in found)


def test_what_knocks_part_is_one_rest_and_what_was_turned_between_is_two() -> None:
    knocked = lying(1)
    knocked[:, 600:605] += 6.0
    knocked[:, 640:645] -= 6.0
    found = rests(knocked, lying(2, (9.8, 0.0, 0.0)))
    assert [(r.run, r.start > 640) for r in found.rests] == [(0, True), (1, False)]
    assert any("1 stretch left out beside longer ones of the same rest" in text for text in found.remarks)
    turned = lying(1)
    turned[0, 600:650] += np.linspace(0, 0.2, 50)
    turned[1, 600:650] += 4.0
    turned[0, 650:] += 0.2
    assert [r.run for r in rests(turned, lying(2, (9.8, 0.0, 0.0))).rests] == [0, 0, 1]
