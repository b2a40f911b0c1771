"""Lines of a rest are named though held-out means are worse, or no better, without them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify import loop

RATE, N = 100.0, 2500


def at_rest(folder: Path, seed: int, size: float, n: int = N) -> list[tuple[str, float]]:
    """What is named of white noise of 1 mrad/s and a line about 21.8 Hz that wanders, in means of 0.25 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / RATE
    phase = 2 * np.pi * np.cumsum(21.8 + 0.1 * np.sin(2 * np.pi * t / 37)) / RATE
    return judged(folder, t, 1e-3 * (rng.standard_normal(n) + size * np.cos(phase)), 0.25)


def judged(folder: Path, t: Floats, values: Floats, width: float) -> list[tuple[str, float]]:
    """What is named of readings [rad/s] at rest in means over a ``width`` [s], each with its first parameter."""
    np.savetxt(folder / "run.csv", np.column_stack([t, values]), delimiter=",", header="time,gyro", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "time", unit = "s" }\n'
        'gyro = { column = "gyro", unit = "rad/s" }\n'
        f'[model]\ntarget = "gyro"\ndeclared = ["bias"]\n[held_out]\naveraging = "{width:g} s"\n'
    )
    (target,) = close(folder / "run.toml").targets
    return [(one.effect, next(p.value for p in one.parameters if p.parameter in "fc")) for one in target.added]


@pytest.mark.parametrize(("seed", "size"), [(0, 1.5), (1, 0.7)])
def test_a_line_stays_where_held_out_means_are_worse_without_it(
    seed: int, size: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As means are that reject another line: the window is noisier, and plain means hold little of a fast line."""
    monkeypatch.setattr(loop, "_worse", lambda track: bool(track.prepared.lines))
    ((name, frequency),) = at_rest(tmp_path, seed, size)
    assert name == "tone"
    assert frequency == pytest.approx(21.8, abs=0.3)


def test_nothing_is_told_of_noise(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A line of fitted samples alone comes by chance in 1e-4, and in held-out ones as well in 1e-7."""
    monkeypatch.setattr(loop, "_worse", lambda track: True)
    assert at_rest(tmp_path, 4, 0.0) == []


@pytest.mark.parametrize(("size", "there"), [(0.15, True), (0.0, False)])
def test_a_line_too_slight_to_matter_to_means_is_told_where_it_is_certain(
    size: float, there: bool, tmp_path: Path
) -> None:
    """A hundredth of the samples' variance, and many times the noise beside it; in means of 0.25 s nothing of it."""
    found = at_rest(tmp_path, 5, size, 80_000)
    assert [name for name, _ in found] == ["tone"] * there
    assert all(frequency == pytest.approx(21.8, abs=0.3) for _, frequency in found)


@pytest.mark.parametrize(
    ("frequency", "size", "wanders"), [(11.0, 0.13, 0.0), (12.0, 0.2, 0.02), (13.0, 0.17, 0.02), (17.0, 0.16, 0.0)]
)
def test_a_slight_line_above_the_bin_rate_has_its_own_frequency_alone(
    frequency: float, size: float, wanders: float, tmp_path: Path
) -> None:
    """Means of five rows fold it to 20 Hz less its frequency, where all of them together see it."""
    rng, n = np.random.default_rng(6), 20_000
    t = np.arange(n) / RATE
    phase = 2 * np.pi * frequency * t + wanders * np.cumsum(rng.standard_normal(n))
    values = rng.standard_normal(n) + size * np.cos(phase)
    found = judged(tmp_path, t, 1e-3 * values, 0.05)
    assert found and all(abs(at - frequency) < 0.3 for _, at in found)
