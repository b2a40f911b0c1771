"""Which results pages are older than the code that makes their figures.

python scripts/pages.py [--stamp]

A page ends with the hash of its engine when it was written: of the script that writes it and of every module of this
project that the script imports, directly or not, with the plug-ins and scenarios that it names. Comments, docstrings
and layout do not count. A page whose hash is another today is listed as stale: its figures may be others now. Nothing
fails for that. --stamp gives pages that have no hash the one that the code had when they were last committed.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import re
import subprocess
import tarfile
import tempfile
import tomllib
from collections.abc import Iterator
from functools import cache
from io import BytesIO
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Page and the script that writes it.
WRITERS = {
    "alignment_measured": "align_measured_data.py",
    "beat_the_papers": "beat_the_papers.py",
    "blind_bench": "studies/blind_bench/page.py",
    "bounds": "bounds_judged.py",
    "fog_test": "reproduce_fog_test.py",
    "injected": "studies/injections/injected_page.py",
    "leaderboard": "leaderboard.py",
    "measured": "close_loop_on_measured_data.py",
    "north_finder": "reproduce_north_finder.py",
    "online_policies": "online_policies.py",
    "search_study": "search_study.py",
    "system_calibration": "calibrate_unit.py",
    "two_position": "reproduce_two_position.py",
}
_STAMP = re.compile(r"^<!-- engine ([0-9a-f]{12}) of (\S+) -->$", re.MULTILINE)
#: Packages whose modules count.
_PACKAGES = ("insenv", "estimators")


def engine(script: Path, root: Path = ROOT) -> str:
    """Hash of what makes a script's figures."""
    sha = hashlib.sha256()
    for path in sorted(closure(script, root)):
        sha.update(f"\n{path.relative_to(root)}\n".encode())
        sha.update(_meaning(path).encode())
    return sha.hexdigest()[:12]


def closure(script: Path, root: Path = ROOT) -> set[Path]:
    """The script, all modules of the project that it imports, and the plug-ins and scenarios that it names."""
    found: set[Path] = set()
    open_ = [script]
    while open_:
        path = open_.pop()
        if path in found or not path.exists():
            continue
        found.add(path)
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".py":
            open_ += _imported(text, path, root)
            if path.is_relative_to(root / "scripts"):
                open_ += _named(text, root)
    return found


def _imported(text: str, path: Path, root: Path) -> Iterator[Path]:
    for name in _names(text):
        own = name.partition(".")[0] in _PACKAGES
        yield from _places(name, (root,) if own else (path.parent, root / "scripts"))


@cache
def _places(name: str, bases: tuple[Path, ...]) -> tuple[Path, ...]:
    """Where a module may stand."""
    places = [base.joinpath(*name.split(".")) for base in bases]
    return tuple(file for place in places for file in (place.with_suffix(".py"), place / "__init__.py"))


@cache
def _names(text: str) -> tuple[str, ...]:
    """Names that a module imports."""
    names: list[str] = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(names)


@cache
def _hashed(text: str) -> str:
    """Hash of a module without comments, docstrings and layout."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                node.body = node.body[1:] or [ast.Pass()]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def _named(text: str, root: Path) -> Iterator[Path]:
    """Modules of the plug-ins and files of the packaged scenarios whose names stand in a script."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    for group in project["project"].get("entry-points", {}).values():
        for name, place in group.items():
            if re.search(rf'["\'`]{name}["\'`]', text):
                where = root.joinpath(*place.partition(":")[0].split("."))
                yield where.with_suffix(".py")
                yield from where.glob("*.py")  # of a system, its folder
    for path in (root / "insenv/systems").glob("*/scenarios/*.toml"):
        if f"{path.parents[1].name}/{path.stem}" in text:
            yield path
            yield from path.parents[1].glob("*.py")


def _meaning(path: Path) -> str:
    """A module without comments, docstrings and layout; another file as it is."""
    text = path.read_text(encoding="utf-8")
    return _hashed(text) if path.suffix == ".py" else text


def written(page: Path, text: str) -> None:
    """Write a page, with the hash of today's engine where its script is known."""
    script = WRITERS.get(page.stem)
    page.write_text(stamped(text, ROOT / "scripts" / script) if script else text, encoding="utf-8")


def stamped(text: str, script: Path, root: Path = ROOT) -> str:
    """The page with the hash of today's engine at its end."""
    return f"{_STAMP.sub('', text).rstrip()}\n\n<!-- engine {engine(script, root)} of {script.name} -->\n"


def state(page: Path, script: Path, root: Path = ROOT) -> str:
    """What a page is: "current", "stale", or "unknown" where nothing says of what engine it is."""
    was = stamped_with(page)
    if was is None:
        return "unknown"
    return "current" if was == engine(script, root) else "stale"


def stamped_with(page: Path) -> str | None:
    """The hash that a page ends with, if it has one."""
    found = _STAMP.search(page.read_text(encoding="utf-8"))
    return None if found is None else found[1]


def _at_commit(page: Path, script: Path) -> str:
    """The page with the hash that the engine had when the page was last committed."""
    commit = _git("log", "-1", "--format=%H", "--", str(page)).decode().strip()
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=BytesIO(_git("archive", commit))) as archive:
            archive.extractall(folder, filter="data")
        root = Path(folder)
        there = root / script.relative_to(ROOT)
        return stamped(page.read_text(encoding="utf-8"), there, root) if there.exists() else page.read_text("utf-8")


def _git(*arguments: str) -> bytes:
    return subprocess.run(["git", "-C", str(ROOT), *arguments], check=True, capture_output=True).stdout


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stamp", action="store_true", help="give pages without a hash that of their last commit")
    stamp = parser.parse_args().stamp
    for page in sorted((ROOT / "docs/results").glob("*.md")):
        if page.stem not in WRITERS:
            print(f"{page.name:24s} written by hand, or by several scripts")
            continue
        script = ROOT / "scripts" / WRITERS[page.stem]
        if stamp and state(page, script) == "unknown":
            page.write_text(_at_commit(page, script), encoding="utf-8")
        print(f"{page.name:24s} {state(page, script):8s} scripts/{script.name}")


if __name__ == "__main__":
    main()
