"""Sweeps: the same bits whatever the back end, the chunks, and how often they are killed."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import sweep_jobs
from hypothesis import given, settings
from hypothesis import strategies as st

from insenv.core.errors import InputError
from insenv.sweep import Backend, Folder, Identity, Memory, Processes, Serial, Table, backend, stacked, store, sweep


def whole() -> Table:
    """Every run of the tests' sweep, by hand."""
    return sweep_jobs.walk(range(sweep_jobs.FIRST, sweep_jobs.FIRST + sweep_jobs.TOTAL))


def same(found: Table, expected: Table) -> None:
    assert list(found) == list(expected)
    for name in expected:
        np.testing.assert_array_equal(found[name], expected[name])


@pytest.mark.parametrize("where", [Serial(), Processes(2)], ids=["serial", "processes"])
@pytest.mark.parametrize("chunk", [None, 7, 600, 10_000])
def test_back_ends_and_chunks_change_no_bit(where: Backend, chunk: int | None) -> None:
    found = sweep(sweep_jobs.walk, sweep_jobs.FIRST, sweep_jobs.TOTAL, backend=where, chunk=chunk)
    same(stacked(found.parts()), whole())


@given(st.lists(st.tuples(st.integers(0, 59), st.integers(1, 20)), max_size=6), st.integers(1, 70))
@settings(deadline=None, max_examples=50)
def test_what_is_there_is_neither_lost_nor_doubled(there: list[tuple[int, int]], chunk: int) -> None:
    """Whatever files were left, overlapping ones too, the sweep ends with each run once."""
    import tempfile

    with tempfile.TemporaryDirectory() as name:
        folder = Folder(Path(name), Identity("walk", 3, 60))
        for start, length in there:
            folder.add(start, sweep_jobs.walk(range(3 + start, 3 + min(start + length, 60))))
        sweep(sweep_jobs.walk, 3, 60, folder, chunk=chunk)
        same(stacked(folder.parts()), sweep_jobs.walk(range(3, 63)))


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    store = Folder(tmp_path, Identity("walk", 0, 50))
    # Marked results: were they made anew, the mark would be gone.
    marked = {"seed": np.arange(20), "end": np.full(20, 1e9)}
    store.add(10, marked)
    sweep(sweep_jobs.walk, 0, 50, store)
    found = stacked(store.parts())
    assert np.flatnonzero(found["end"] == 1e9).tolist() == list(range(10, 30))


def test_many_small_files_are_joined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "MANY", 10)
    folder = Folder(tmp_path, Identity("walk", 0, 60))
    sweep(sweep_jobs.walk, 0, 60, folder, chunk=1)
    assert len(list(tmp_path.glob("runs-*.npz"))) < 15
    same(stacked(folder.parts()), sweep_jobs.walk(range(60)))


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_killed_driver_loses_and_doubles_nothing(tmp_path: Path, jobs: int) -> None:
    path = tmp_path / "store"
    killed = _driver(path, jobs)
    _await_runs(path, 60)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    done = sum(stop - start for start, stop in Folder(path, sweep_jobs.IDENTITY, resume=True).done())
    assert 60 <= done < sweep_jobs.TOTAL
    resumed = _driver(path, jobs)
    assert resumed.wait(timeout=60) == 0
    same(stacked(Folder(path, sweep_jobs.IDENTITY, resume=True).parts()), whole())


def test_an_interrupted_sweep_keeps_what_is_done(tmp_path: Path) -> None:
    calls = 0

    def interrupted(seeds: Sequence[int]) -> Table:
        nonlocal calls
        calls += 1
        if calls == 4:
            raise KeyboardInterrupt
        return sweep_jobs.walk(seeds)

    store = Folder(tmp_path, Identity("walk", 0, 50))
    with pytest.raises(KeyboardInterrupt):
        sweep(interrupted, 0, 50, store, chunk=5)
    assert store.done() == [(0, 5), (5, 10), (10, 15)]
    sweep(sweep_jobs.walk, 0, 50, store)
    same(stacked(store.parts()), sweep_jobs.walk(range(50)))


@pytest.mark.parametrize("where", [Serial(), Processes(2)], ids=["serial", "processes"])
def test_a_job_that_refuses_keeps_what_is_done(where: Backend) -> None:
    store = Memory()
    with pytest.raises(InputError, match="seed 300 is refused"):
        sweep(sweep_jobs.failing, 0, 600, store, where, chunk=10)
    assert store.done()


def test_a_killed_process_is_told_of_in_one_sentence() -> None:
    with pytest.raises(InputError, match="a process of the sweep was killed"):
        sweep(_suicide, 0, 100, backend=Processes(2), chunk=5)


def _suicide(seeds: Sequence[int]) -> Table:
    if 50 in seeds:
        os.kill(os.getpid(), signal.SIGKILL)
    return sweep_jobs.walk(seeds)


def test_another_sweep_is_refused(tmp_path: Path) -> None:
    identity = Identity("walk", 0, 50, {"estimator": "north_gls"})
    sweep(sweep_jobs.walk, 0, 50, Folder(tmp_path, identity))
    for other, what in (
        (Identity("walk", 1, 50, identity.settings), "first seed is 0 and not 1"),
        (Identity("walk", 0, 51, identity.settings), "number of runs is 50 and not 51"),
        (Identity("walk", 0, 50, {"estimator": "revolution"}), "estimator is north_gls and not revolution"),
        (Identity("fall", 0, 50, identity.settings), "job is walk and not fall"),
        (Identity("walk", 0, 50, identity.settings, {}), "version of .* is .* and not None"),
    ):
        with pytest.raises(InputError, match=what):
            Folder(tmp_path, other, resume=True)
    with pytest.raises(InputError, match="holds 50 of the 50 runs of this sweep; wanted --resume"):
        Folder(tmp_path, identity)


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"layout": 1}', '{"layout": 2, "job": "walk", "first": 0, "total": 9}']
)
def test_a_manifest_that_is_none_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "sweep.json").write_text(text)
    with pytest.raises(InputError, match=r"sweep\.json"):
        Folder(tmp_path, Identity("walk", 0, 9), resume=True)


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds files and no sweep\.json"):
        Folder(tmp_path, Identity("walk", 0, 9))
    with pytest.raises(InputError, match="cannot be made a folder"):
        Folder(tmp_path / "thesis.txt", Identity("walk", 0, 9))


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    store = Folder(tmp_path, Identity("walk", 0, 9))
    sweep(sweep_jobs.walk, 0, 9, store, chunk=9)
    (file,) = tmp_path.glob("runs-*.npz")
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 255
    file.write_bytes(content)
    with pytest.raises(InputError, match="delete it, and resume"):
        stacked(store.parts())


def test_a_job_that_loses_a_row_is_refused() -> None:
    with pytest.raises(InputError, match="wanted a row for each"):
        sweep(sweep_jobs.short, 0, 5)


@pytest.mark.parametrize(("first", "total", "chunk"), [(-1, 5, None), (0, 0, None), (0, 5, 0)])
def test_numbers_out_of_range_are_refused(first: int, total: int, chunk: int | None) -> None:
    with pytest.raises(InputError, match="wanted seeds from 0"):
        sweep(sweep_jobs.walk, first, total, chunk=chunk)


def test_back_ends_out_of_range_are_refused() -> None:
    with pytest.raises(InputError, match="0 processes"):
        backend(0)
    with pytest.raises(InputError, match="one of the two"):
        backend(2, "tcp://127.0.0.1:1")


def test_the_manifest_says_what_the_store_holds(tmp_path: Path) -> None:
    Folder(tmp_path, Identity("walk", 3, 9, {"policy": "constant_rate"}))
    kept = json.loads((tmp_path / "sweep.json").read_text())
    assert (kept["job"], kept["first"], kept["total"]) == ("walk", 3, 9)
    assert kept["settings"] == {"policy": "constant_rate"}
    assert set(kept["versions"]) >= {"insenv", "numpy", "python"}


def _driver(path: Path, jobs: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, sweep_jobs.__file__, str(path), str(jobs)]
    return subprocess.Popen(command, start_new_session=True)


def _await_runs(path: Path, count: int) -> None:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        if len(list(path.glob("runs-*.npz"))) * 11 >= count:
            return
        time.sleep(0.02)
    raise AssertionError("the sweep did not get anywhere")
