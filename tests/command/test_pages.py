"""Results pages know of which engine they are, and the page of the method which modules there are."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import pages  # noqa: E402


def project(folder: Path) -> Path:
    """A small project: a script that imports a module, which imports another, and names a plug-in and a scenario."""
    (folder / "scripts").mkdir()
    for name in ("insenv/systems/a/scenarios", "estimators"):
        (folder / name).mkdir(parents=True)
    (folder / "pyproject.toml").write_text('[project.entry-points."x"]\nmine = "estimators.mine:Mine"\n')
    (folder / "insenv/deep.py").write_text("VALUE = 1\n")
    (folder / "insenv/near.py").write_text(
        '"""Words."""\n\ndef f():\n    from insenv.deep import VALUE\n    return VALUE\n'
    )
    (folder / "insenv/other.py").write_text("OTHER = 1\n")
    (folder / "insenv/systems/a/scenarios/b.toml").write_text("x = 1\n")
    (folder / "estimators/mine.py").write_text("class Mine: ...\n")
    script = folder / "scripts/page.py"
    script.write_text('from insenv.near import f\n\nf("mine", "a/b")\n')
    return script


@pytest.mark.parametrize(
    ("file", "text", "changes"),
    [
        ("insenv/deep.py", "VALUE = 2\n", True),
        ("insenv/deep.py", '"""A module."""\n\n# A value.\nVALUE = (\n    1\n)\n', False),
        ("insenv/other.py", "OTHER = 2\n", False),
        ("insenv/systems/a/scenarios/b.toml", "x = 2\n", True),
        ("estimators/mine.py", "class Mine: x = 1\n", True),
        ("scripts/page.py", 'from insenv.near import f\n\nf("mine", "a/b", 1)\n', True),
    ],
)
def test_the_engine_is_what_a_script_reaches(tmp_path: Path, file: str, text: str, changes: bool) -> None:
    script = project(tmp_path)
    page = tmp_path / "page.md"
    page.write_text("# Page\n")
    assert pages.state(page, script, tmp_path) == "unknown"
    page.write_text(pages.stamped(page.read_text(), script, tmp_path))
    assert pages.state(page, script, tmp_path) == "current"
    (tmp_path / file).write_text(text)
    assert pages.state(page, script, tmp_path) == ("stale" if changes else "current")
    again = pages.stamped(page.read_text(), script, tmp_path)
    assert again.count("<!-- engine") == 1 and pages.stamped(again, script, tmp_path) == again


def test_every_page_has_a_hash_and_every_writer_is_there() -> None:
    for name, script in pages.WRITERS.items():
        page = ROOT / "docs/results" / f"{name}.md"
        assert (ROOT / "scripts" / script).exists() and page.exists()
        assert pages.stamped_with(page) is not None, name
    # The loop's pages depend on the search, a page of environments on its scenarios.
    reached = {p.relative_to(ROOT).as_posix() for p in pages.closure(ROOT / "scripts/close_loop_on_measured_data.py")}
    assert {"insenv/identify/search/round.py", "insenv/effects/rate/scale.py"} <= reached
    assert "insenv/systems/two_position/film.py" not in reached
    assert "estimators/north_finder/gls.py" in {
        p.relative_to(ROOT).as_posix() for p in pages.closure(ROOT / "scripts/leaderboard.py")
    }


def test_the_method_page_names_modules_that_are_there() -> None:
    rooms = {path.name for path in (ROOT / "insenv").iterdir() if path.is_dir()}
    named = re.findall(r"`(?:insenv\.)?(\w+(?:\.\w+)+)", (ROOT / "docs/method.md").read_text(encoding="utf-8"))
    places = {name: ROOT / "insenv" / name.replace(".", "/") for name in named if name.split(".")[0] in rooms}
    gone = {name for name, place in places.items() if not (place.is_dir() or place.with_suffix(".py").exists())}
    # The last part may be a function of a module.
    gone = {name for name in gone if not places[name].parent.with_suffix(".py").exists()}
    assert len(places) > 50 and gone == set()
