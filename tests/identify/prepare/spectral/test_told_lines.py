"""Lines of a rest are named though held-out means are worse, or no better, without them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.identify import loop

RATE, N = 100.0, 2500


def at_rest(folder: Path, seed: int, size: float, n: int = N) -> list[tuple[str, float]]:
    """What is named of white noise of 1 mrad/s and a line about 21.8 Hz that wanders, in means of 0.25 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / RATE
    phase = 2 * np.pi * np.cumsum(21.8 + 0.1 * np.sin(2 * np.pi * t / 37)) / RATE
    values = 1e-3 * (rng.standard_normal(n) + size * np.cos(phase))
    np.savetxt(folder / "run.csv", np.column_stack([t, values]), delimiter=",", header="time,gyro", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "time", unit = "s" }\n'
        'gyro = { column = "gyro", unit = "rad/s" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n[held_out]\naveraging = "0.25 s"\n'
    )
    (target,) = close(folder / "run.toml").targets
    return [(one.effect, one.parameters[0].value) for one in target.added]


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
