"""The number of the power-up: read, written, and what rate test and closed loop make of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Channel, Recording, Segment
from insenv.core.units import DEG, DEG_PER_HOUR
from insenv.data import stream
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.power import by_power_up
from insenv.data.split import split
from insenv.data.stream import stream_run
from insenv.envs.recorder import Recorder
from insenv.rate_test import rate_test
from insenv.systems.rate_table.env import RateTableEnv

TEXT = """\
data = [{data}]

[channels]
time = {{ rate = "10 Hz" }}
gyro = {{ unit = "rad/s", covers = "interval" }}
power = {{}}

[model]
target = "gyro"
declared = ["bias"]
{more}
"""


def write(folder: Path, files: dict[str, list[tuple[float, float]]], more: str = "", rows: int = 2000) -> Path:
    """A gyro at rest: each file with its power-ups, (number, bias [deg/h]), so many rows each."""
    rng = np.random.default_rng(3)
    for name, ups in files.items():
        power = np.repeat([number for number, _ in ups], rows)
        gyro = np.repeat([bias * DEG_PER_HOUR for _, bias in ups], rows) + 1e-6 * rng.standard_normal(len(power))
        np.savetxt(folder / name, np.stack([gyro, power], axis=1), delimiter=",", header="gyro,power", comments="")
    path = folder / "test.toml"
    path.write_text(TEXT.format(data=", ".join(f'"{name}"' for name in files), more=more))
    return path


def test_an_environment_s_power_cycles_reach_the_rate_test(tmp_path: Path) -> None:
    env = Recorder(RateTableEnv("rate_table/b215", sampling=100.0))
    env.reset(seed=4)
    for rate, signal, steps in [
        r for up in range(3) for r in ((0, -float(up > 0), 1), (0, 0, 9), (30, 0, 13), (-30, 0, 14))
    ]:
        for _ in range(steps):
            env.step(np.array([rate * DEG, signal]))
    path = env.save(tmp_path / "run")
    (whole,) = read_recordings(load_manifest(path))
    np.testing.assert_array_equal(whole.values("power", "1"), env.recording().values("power", "1"))
    found = rate_test(path)
    assert found.line is not None and found.conditions["power-ups"] == "3"
    assert [fit.power_up for fit in found.line.of_each("all points")] == [1, 2, 3]
    assert found.line.repeatability["all points"].value > 0
    assert len(found.bias_of_power_ups) == 3 and found.bias_repeatability.value > 0
    assert [np.unique(part.values("power", "1")).tolist() for part in by_power_up([whole])] == [[1], [2], [3]]


@pytest.mark.parametrize(
    ("first", "second"), [([(1, 5), (2, 6)], [(1, 7)]), ([(1, 5), (2, 6)], [(3, 7)]), ([(4, 5), (9, 6)], [(9, 7)])]
)
def test_each_file_begins_with_a_power_up_of_its_own(
    first: list[tuple[float, float]], second: list[tuple[float, float]], tmp_path: Path
) -> None:
    found = rate_test(write(tmp_path, {"a.csv": first, "b.csv": second}))
    assert found.conditions["power-ups"] == "3"
    # Means of 200 s: sd 5e-3 deg/h; false alarm 1e-6 or less.
    assert [b / DEG_PER_HOUR for b in found.bias_of_power_ups] == pytest.approx([5, 6, 7], abs=0.03)
    assert found.bias_repeatability.value / DEG_PER_HOUR == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize("numbers", [(0, 1), (1.5, 2), (2, 1), (-1, 1)])
@pytest.mark.parametrize("rows", [1000, 100_000])
def test_what_is_no_number_of_a_power_up_is_refused(
    numbers: tuple[float, float], rows: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "BYTES", 20_000)
    path = write(tmp_path, {"a.csv": [(n, 0) for n in numbers]}, rows=rows // 10)
    manifest = load_manifest(path)
    for read in (lambda: read_recordings(manifest), lambda: list(stream_run(manifest, manifest.runs[0]))):
        with pytest.raises(
            InputError, match=r"a\.csv: line \d+: channels\.power is .*; wanted the number of the power-up"
        ):
            read()


def test_power_has_neither_unit_nor_delay(tmp_path: Path) -> None:
    path = write(tmp_path, {"a.csv": [(1, 0)]})
    for wrong in ('unit = "1"', 'delay = "1 s"'):
        path.write_text(path.read_text().replace("power = {}", f"power = {{ {wrong} }}"))
        with pytest.raises(InputError, match=r"channels\.power\.\w+ has no meaning on this channel"):
            load_manifest(path)
        path.write_text(path.read_text().replace(f"power = {{ {wrong} }}", "power = {}"))


def test_the_closed_loop_has_a_bias_for_each_power_up(tmp_path: Path) -> None:
    """A jump of 5 deg/h between power-ups is no bias step: nothing is significant (false alarm 1 %)."""
    path = write(tmp_path, {"a.csv": [(1, 5), (2, 10), (3, 7)]})
    (found,) = close(path, ["bias_step", "bias_drift"]).targets
    assert found.verdict == "nothing-significant"
    levels = [e.value / DEG_PER_HOUR for e in found.estimates_after if e.effect == "bias"]
    assert levels == pytest.approx([5, 10, 7], abs=0.05)


def test_held_out_runs_count_power_ups(tmp_path: Path) -> None:
    def used(number: int) -> list[bool]:
        manifest = load_manifest(write(tmp_path, {"a.csv": [(1, 5), (2, 10)]}, f"[held_out]\nruns = [{number}]"))
        return [bool(use.held_out.all()) for use in split(manifest, by_power_up(read_recordings(manifest)))]

    assert used(2) == [False, True]
    with pytest.raises(InputError, match=r"held_out\.runs has 3; there are 2 runs, each power-up one"):
        used(3)


def test_labelled_stretches_are_cut_with_their_power_up() -> None:
    power = np.repeat([1.0, 2.0], 5)
    segments = (Segment("zero", 0, 3), Segment("rate +1 deg/s", 3, 8), Segment("zero", 8, 10))
    whole = Recording(np.arange(10.0), {"power": Channel(power, "1")}, segments)
    first, second = by_power_up([whole])
    assert first.segments == (Segment("zero", 0, 3), Segment("rate +1 deg/s", 3, 5))
    assert second.segments == (Segment("rate +1 deg/s", 0, 3), Segment("zero", 3, 5))
    assert first.label == "recording, power-up 1" and len(first) + len(second) == 10
    with pytest.raises(InputError, match="power-up 2: has 1 row"):
        by_power_up([Recording(np.arange(3.0), {"power": Channel(np.array([1.0, 1.0, 2.0]), "1")})])
