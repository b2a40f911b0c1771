"""A law at rest and the walk of the noise that stands for it: where the law is likelier, both are named as a set."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.close import close
from insenv.core.recording import Channel, Recording, Site
from insenv.effects.catalogue import by_key
from insenv.identify.findings import TargetFindings
from insenv.identify.search import undecided

ROWS, WHITE = 900, 0.002
SLOW = tuple(by_key(key) for key in ("bias_drift", "bias_warm_up", "bias_step"))


def said(seed: int, drift: float, walk: float = 0.0) -> TargetFindings:
    """The loop on a gyro at rest for a quarter of an hour that drifts by so much [rad/s] and walks so far in a row."""
    rng = np.random.default_rng(seed)
    t = np.arange(1.0, ROWS + 1)
    return of(WHITE * rng.standard_normal(ROWS) + walk * np.cumsum(rng.standard_normal(ROWS)) + drift * t / ROWS)


def of(values: np.ndarray) -> TargetFindings:
    """The loop on rows of a gyro at rest, a second apart."""
    t = np.arange(1.0, len(values) + 1)
    run = Recording(t, {"gyro_x": Channel(values, "rad/s")}, site=Site(gravity=9.8), label="rest")
    (target,) = closed(run, manifest(("gyro_x",), ("bias",)), catalogue=SLOW).targets
    return target


def test_a_drift_that_a_walk_takes_in_is_a_set_with_it() -> None:
    """Of 6.5 deviations of white noise: fitted rows alone tell it from a walk in none of these."""
    found = [said(seed, 0.0015) for seed in range(12)]
    named = [target for target in found if target.added]
    assert len(named) >= 6
    for target in named:
        (added,) = target.added
        assert added.effect in ("bias_drift", "bias_warm_up")
        assert "rate_random_walk" in added.confounded_with
        assert target.verdict == "confounded"


def test_a_walk_is_hardly_ever_called_a_law() -> None:
    """And where it is, it is so in a set with the walk in it."""
    found = [said(seed, 0.0, walk) for seed in range(12) for walk in (1e-5, 2e-5)]
    named = [target for target in found if target.added]
    assert len(named) <= 2
    assert all(target.verdict == "confounded" for target in named)


def coloured(seed: int, drift: float, memory: float = 4.0, rows: int = 250) -> np.ndarray:
    """Rows that correlate over ``memory`` of them, with a drift of so many deviations of a mean of all of them."""
    rng = np.random.default_rng(seed)
    left = np.exp(-1 / memory)
    fresh = WHITE * np.sqrt(1 - left**2) * rng.standard_normal(rows)
    values = np.array(list(accumulate(fresh, lambda before, new: left * before + new)))
    slow = WHITE * np.sqrt((1 + left) / (1 - left) * 12 / rows)
    return np.asarray(values + 0.2 * WHITE * rng.standard_normal(rows) + drift * slow * np.arange(rows) / rows)


def test_a_drift_of_rows_that_correlate_is_a_set_too() -> None:
    """White noise explains nothing of rows behind a filter: all of it fell to a walk, and the drift with it."""
    found = [of(coloured(seed, 7.0)) for seed in range(10)]
    named = [target for target in found if target.added]
    assert len(named) >= 7
    assert all(target.verdict == "confounded" for target in named)
    assert not any(of(coloured(seed, 0.0)).added for seed in range(10))


def test_a_drift_of_five_deviations_need_not_look_like_a_certain_walk() -> None:
    """The walk that stood for it was to be as certain as itself, and most such drifts were passed in silence."""
    rng = np.random.default_rng(5)
    drift = 5.5 * WHITE * np.sqrt(12 / ROWS) * np.arange(ROWS) / ROWS
    found = [of(WHITE * rng.standard_normal(ROWS) + drift) for _ in range(12)]
    assert sum(bool(target.added) for target in found) >= 7
    assert not any(target.verdict == "effects-found" for target in found)


def test_white_noise_alone_has_no_set() -> None:
    rng = np.random.default_rng(6)
    assert not any(of(WHITE * rng.standard_normal(ROWS)).added for _ in range(16))


@pytest.mark.parametrize(("share", "p", "named"), [(0.995, 0.05, False), (0.97, 0.05, True), (0.97, 0.3, False)])
def test_held_out_rows_that_gain_by_chance_alone_name_no_set(
    monkeypatch: pytest.MonkeyPatch, share: float, p: float, named: bool
) -> None:
    """Where all rows hardly ask for a law, held-out error less by 0.5 % is chance, and by 3 % is not; or not at all."""
    confirmed = undecided._confirmed

    def nearly(*asked: Any) -> Iterator[tuple[Any, ...]]:
        for hit, larger, after in confirmed(*asked):
            yield hit, larger, replace(after, rms=share * asked[2].rms)

    monkeypatch.setattr(undecided, "_confirmed", nearly)
    monkeypatch.setattr(undecided, "log_p_by_itself", lambda track, hit: math.log(p))
    assert bool(said(1, 0.0015).added) is named


def rest_with_a_step(seed: int, size: float, walk: float = 0.0) -> Recording:
    """A counter at rest whose errors cancel from row to row, and a step of ``size`` deviations of its other noise."""
    rng, rows, at = np.random.default_rng(seed), 3000, 0.37
    noise = np.diff(rng.standard_normal(rows + 1)) + 0.3 * rng.standard_normal(rows)
    noise = noise + walk * np.cumsum(rng.standard_normal(rows))
    jump = size * 0.3 / np.sqrt(rows * at * (1 - at)) * (np.arange(rows) > at * rows)
    return Recording(np.arange(float(rows)), {"gyro": Channel(1e-5 * (noise + jump), "rad/s", "interval")})


@pytest.mark.parametrize("seed", range(3))
def test_a_step_that_all_rows_tell_is_likelier_than_the_walk_that_stands_for_it(seed: int) -> None:
    # Fitted rows alone tell 12 deviations from no walk, and the odds against events are a thousand.
    (target,) = closed(rest_with_a_step(seed, 12.0), manifest(declared=("bias",))).targets
    (added,) = target.added
    assert added.effect == "bias_step" and "rate_random_walk" in added.confounded_with
    t0 = next(p for p in added.parameters if p.parameter == "t0")
    assert abs(t0.value - 1110.0) < 5 * t0.sd


@pytest.mark.slow
@pytest.mark.parametrize("walk", [3e-3, 1e-2])
def test_a_walk_is_no_step(walk: float) -> None:
    # Of 40 simulated nulls with walks, flicker and memories none had one; three of 16 by chance once in 10^4.
    found = [closed(rest_with_a_step(seed, 0.0, walk), manifest(declared=("bias",))) for seed in range(8)]
    assert sum(any(a.effect == "bias_step" for a in one.targets[0].added) for one in found) <= 1


@pytest.mark.parametrize("stated", [True, False])
def test_a_flicker_that_the_maker_states_is_no_rival_of_a_step(tmp_path: Path, stated: bool) -> None:
    """Of 14 such runs this one has a step that is likelier than a walk: without a word of the maker it is named."""
    rng, n = np.random.default_rng([5, 13]), 3000
    flicker = np.fft.irfft(np.fft.rfft(rng.standard_normal(2 * n)) / np.sqrt(np.maximum(np.arange(n + 1.0), 1) / n))[:n]
    y = 20 * rng.standard_normal(n) + 2.2 * flicker
    rows = np.column_stack([0.2 * np.arange(n), y])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="t,y", comments="", fmt="%.4f")
    lines = ['data = "run.csv"', "[channels]", 'time = { column = "t", unit = "s" }']
    lines += ['gyro = { column = "y", unit = "deg/h" }', "[model]", 'target = "gyro"', 'declared = ["bias"]']
    lines += ["[noise]", 'angle_random_walk = "0.15 deg/sqrt(h)"', 'bias_instability = "4 deg/h"'] * stated
    (tmp_path / "run.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (target,) = close(tmp_path / "run.toml").targets
    assert (target.verdict == "nothing-significant") == stated
