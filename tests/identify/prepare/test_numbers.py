"""The numbers that a unit at rest reads: a dead band or a rail is a doubt, repeated rows a remark, rounding nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify.findings import Findings
from insenv.identify.prepare.numbers import pile

N, STEP = 6000, 0.061
Rng = np.random.Generator


def noise(rng: Rng, steps: float = 8.0) -> Floats:
    """White noise of so many steps of rounding."""
    return steps * STEP * rng.standard_normal(N)


def rounded(values: Floats) -> Floats:
    return np.asarray(np.round(values / STEP) * STEP)


def dead(values: Floats) -> Floats:
    """Readings of less than half a deviation are nothing."""
    return np.where(np.abs(values) < 0.5 * values.std(), 0.0, values)


def clipped(values: Floats) -> Floats:
    return np.maximum(values, -0.8 * values.std())


#: Readings that pile up on no number.
ORDINARY: dict[str, Callable[[Rng], Floats]] = {
    "rounded": lambda rng: rounded(noise(rng)),
    "rounded coarsely": lambda rng: rounded(noise(rng, 1.5)),
    "hardly blurred, of two lengths": lambda rng: (
        np.round(rng.standard_normal(N) * 0.5 + 8 * (rng.random(N) < 0.01) * rng.standard_normal(N))
        * np.where(rng.random(N) < 0.9, 0.0156, 0.01560002)
    ),
    "rounded twice": lambda rng: np.round(rounded(noise(rng)), 1),
    "rounded means": lambda rng: np.round(rounded(noise(rng)) + rng.choice([0, 0, 1e-4, -1e-4], N), 4),
    "not rounded": noise,
    "of a walk": lambda rng: rounded(noise(rng) + 0.01 * np.cumsum(rng.standard_normal(N))),
    "held": lambda rng: np.repeat(rounded(noise(rng)), 4)[:N],
    "of two levels": lambda rng: rounded(noise(rng, 3.0) + 2.0 * (np.arange(N) // 500 % 2)),
}


@pytest.mark.parametrize("kind", ORDINARY)
def test_noise_piles_up_on_no_number(kind: str) -> None:
    """At 1e-9 each."""
    rng = np.random.default_rng(1)
    assert all(pile(ORDINARY[kind](rng)) is None for _ in range(20))


@pytest.mark.parametrize("sort", [rounded, lambda values: values])
def test_a_dead_band_and_a_rail_are_piles(sort: Callable[[Floats], Floats]) -> None:
    rng = np.random.default_rng(2)
    of_dead, of_clipped = pile(dead(sort(noise(rng)))), pile(clipped(sort(noise(rng))))
    assert of_dead is not None and of_dead.value == 0 and not of_dead.end
    assert of_dead.share == pytest.approx(0.38, abs=0.05)  # of a normal variable within half a deviation
    assert of_clipped is not None and of_clipped.end == "smallest"


def test_a_number_that_stands_still_once_is_no_pile() -> None:
    values = rounded(noise(np.random.default_rng(3)))
    values[1000:1400] = values[1000]
    assert pile(values) is None


def at_rest(folder: Path, x: Floats, y: Floats) -> Findings:
    """The loop on two gyros [deg/s] at rest, at 100 Hz."""
    np.savez(folder / "run.npz", t=np.arange(N) / 100, x=x + 0.5, y=y - 0.3)
    channels = "".join(f'gyro_{a} = {{ column = "{a}", unit = "deg/s" }}\n' for a in "xy")
    (folder / "run.toml").write_text(
        f'data = "run.npz"\n[channels]\ntime = {{ column = "t", unit = "s" }}\n{channels}'
        '[model]\ntarget = ["gyro_x", "gyro_y"]\ndeclared = ["bias"]\nprocedure = "static"\n'
    )
    return close(folder / "run.toml", effects=("bias_drift",))


def test_a_dead_band_is_a_doubt_of_its_axis_alone(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    found = at_rest(tmp_path, rounded(noise(rng)), dead(rounded(noise(rng))))
    sound, doubted = found.targets
    assert sound.verdict == "nothing-significant"
    assert doubted.verdict == "unexplained-structure" and "a dead band" in doubted.reasons[-1]


def test_rows_that_are_repeated_are_told_once_for_all_axes(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    x, y = (np.repeat(rounded(noise(rng)), 3)[:N] for _ in range(2))
    (told,) = (text for text in at_rest(tmp_path, x, y).remarks if "measures anew" in text)
    assert told.startswith("gyro_x, gyro_y: ") and told.endswith("every 3 rows alone")
    x, y = rounded(noise(rng)), rounded(noise(rng))
    x[1::2] = np.where(rng.random(N // 2) < 0.6, x[::2], x[1::2])
    (told,) = (text for text in at_rest(tmp_path, x, y).remarks if "repeats the row before" in text)
    assert told.startswith("gyro_x in 3")
