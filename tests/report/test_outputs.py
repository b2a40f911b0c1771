"""Where a report goes: files, links, pipes, devices, the standard output."""

from __future__ import annotations

import json
import os
import stat
import threading
from pathlib import Path

import pytest

from insenv.core.console.progress import check_reports, tell
from insenv.core.errors import InputError
from insenv.core.files import write_whole


def test_a_link_is_followed_and_stays_one(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    real, link = tmp_path / "there/real.json", tmp_path / "link.json"
    real.write_text("old")
    link.symlink_to(real)
    write_whole(link, "new")
    assert link.is_symlink() and real.read_text() == "new"
    assert [p.name for p in real.parent.iterdir()] == ["real.json"]


def test_a_pipe_is_written_through(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    got: list[str] = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_text()))
    reader.start()
    write_whole(pipe, "x" * 200_000)
    reader.join(10)
    assert got == ["x" * 200_000] and stat.S_ISFIFO(pipe.stat().st_mode)


def test_a_device_stays_a_device() -> None:
    write_whole("/dev/null", "gone")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


@pytest.mark.parametrize("name", ["-", "/dev/stdout"])
def test_the_standard_output_has_the_file_and_standard_error_the_summary(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    check_reports(Path(name), None)
    write_whole(name, json.dumps({"a": 1}))
    tell("summary", None, Path(name))
    out, err = capsys.readouterr()
    assert json.loads(out) == {"a": 1} and err == "summary\n"
    assert not list(tmp_path.iterdir()) and not stat.S_ISREG(os.lstat("/dev/stdout").st_mode)


def test_one_standard_output_is_not_for_two(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="wanted one of them there"):
        check_reports(Path("-"), Path("/dev/stdout"))
