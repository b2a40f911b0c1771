"""The measured library: patterns, laying out from a clone, and what may stand beside the facts."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts" / "studies" / "measured"))

import library

FOLDER = Path(library.__file__).parent
PARTS = sorted(p.name for p in (FOLDER / "library").glob("*") if p.is_dir())


def test_patterns_have_braces_and_semicolons() -> None:
    told = "a b/{x,y}_{1,2}.csv; *.mat"
    assert list(library.patterns(told)) == ["a b/x_1.csv", "a b/x_2.csv", "a b/y_1.csv", "a b/y_2.csv", "*.mat"]


@pytest.fixture
def owner(tmp_path: Path) -> tuple[Path, str]:
    """Folder of clones with one repository in it, and its commit."""
    clone = tmp_path / "clones" / "owner+name"
    (clone / "lab one").mkdir(parents=True)
    (clone / "lab one" / "gyro[1].csv").write_text("t,w\n0,1\n")
    (clone / "notes.txt").write_text("not wanted")
    git = ["git", "-C", str(clone), "-c", "user.name=owner", "-c", "user.email=owner@example.org"]
    subprocess.run([*git, "init", "-q"], check=True)
    subprocess.run([*git, "add", "-A"], check=True)
    subprocess.run([*git, "commit", "-q", "-m", "data"], check=True)
    told = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout
    return clone.parent, told.strip()


def _manifests(folder: Path) -> None:
    here = folder / "library" / "third" / "source"
    here.mkdir(parents=True)
    (here / "rest.toml").write_text('name = "rest"\n')
    (here / "convert.py").write_text(
        "from pathlib import Path\nPath('twice.csv').write_text(Path('raw/lab one/gyro[1].csv').read_text() * 2)\n"
    )


def test_lays_out_files_manifests_and_what_is_converted(
    owner: tuple[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clones, commit = owner
    monkeypatch.setattr(library, "HERE", tmp_path)
    _manifests(tmp_path)
    source = {"repository": "owner/name", "commit": commit, "path": "lab */gyro*.csv"}
    library.lay_out("third", "source", source, tmp_path / "out", clones)
    here = tmp_path / "out" / "third" / "source"
    found = {p.relative_to(here).as_posix() for p in here.rglob("*") if p.is_file()}
    assert found == {"raw/lab one/gyro[1].csv", "rest.toml", "convert.py", "twice.csv"}
    assert (here / "twice.csv").read_text() == "t,w\n0,1\n" * 2


def test_a_pattern_without_a_file_is_said(
    owner: tuple[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clones, commit = owner
    monkeypatch.setattr(library, "HERE", tmp_path)
    _manifests(tmp_path)
    source = {"repository": "owner/name", "commit": commit, "path": "lab */gyro*.csv; other.csv"}
    with pytest.raises(LookupError, match=r"no file 'other.csv' in owner\+name"):
        library.lay_out("third", "source", source, tmp_path / "out", clones)
    assert not (tmp_path / "out" / "third" / "source" / "raw").exists()


@pytest.mark.parametrize("part", PARTS)
def test_manifests_belong_to_facts_and_no_recording_stands_here(part: str) -> None:
    told = tomllib.loads((FOLDER / f"facts_{part}.toml").read_text(encoding="utf-8"))
    known = {str(fact["manifest"]) for fact in told["recording"]}
    files = [p for p in (FOLDER / "library" / part).rglob("*") if p.is_file()]
    manifests = {p.relative_to(FOLDER / "library" / part).as_posix() for p in files if p.suffix == ".toml"}
    assert manifests <= known
    assert {p.name for p in files if p.suffix != ".toml"} <= {"convert.py"}
    assert {p.split("/")[0] for p in manifests} <= set(told["sources"])
    for file in manifests:
        tomllib.loads((FOLDER / "library" / part / file).read_text(encoding="utf-8"))
