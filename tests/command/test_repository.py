"""Facts about the repository itself: what is tracked, its version, the cost of importing it."""

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from fnmatch import fnmatch
from pathlib import Path, PurePosixPath

import pytest

import insenv

ROOT = Path(__file__).parents[2]

LOCK_FILES = ("uv.lock", "pylock*.toml", "poetry.lock", "package-lock.json")

# Assembled from parts, so that this file holds none of what it forbids.
INDEX_OPTIONS = tuple("--" + name for name in ("index-url", "extra-index-url", "find-links", "default-index"))
INDEX_TABLES = ("[[tool.uv." + "index]]", "[[" + "index]]")
REGISTRY_HOSTS = tuple(
    ".".join(parts)
    for parts in (
        ("pypi", "org"),
        ("pythonhosted", "org"),
        ("pypi", "python", "org"),
        ("npmjs", "org"),
        ("npmjs", "com"),
        ("yarnpkg", "com"),
        ("anaconda", "org"),
    )
)
FORBIDDEN_TEXT = INDEX_OPTIONS + INDEX_TABLES + REGISTRY_HOSTS
FORBIDDEN = re.compile("|".join(map(re.escape, FORBIDDEN_TEXT)), re.IGNORECASE)

# Each costs a tenth of a second or more, and none is needed before the first call that uses it.
IMPORTED_WHEN_USED = ("scipy", "matplotlib", "pint", "numba", "joblib", "jinja2", "pyarrow", "h5py", "pooch")


def lock_files(paths: Iterable[str]) -> list[str]:
    """Return those of ``paths`` that are lock files, in whatever folder."""
    return [path for path in paths if any(fnmatch(PurePosixPath(path).name, lock) for lock in LOCK_FILES)]


def index_settings(files: Iterable[tuple[str, str]]) -> list[str]:
    """Return ``path:line: text found`` wherever a file, given as ``(path, text)``, names a package index."""
    return [
        f"{path}:{number}: {found.group()}"
        for path, text in files
        for number, line in enumerate(text.splitlines(), start=1)
        if (found := FORBIDDEN.search(line))
    ]


def tracked_paths() -> list[str]:
    """Return the paths that git would commit: tracked ones, and new ones that it does not ignore."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    try:
        listed = subprocess.run(command, cwd=ROOT, capture_output=True, check=True, text=True).stdout
    except (FileNotFoundError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout: nothing is tracked here")
    return [path for path in listed.split("\0") if path and (ROOT / path).is_file()]


def texts(paths: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield ``(path, text)`` for those files that are text: without a NUL byte, as git judges."""
    for path in paths:
        content = (ROOT / path).read_bytes()
        if b"\0" not in content:
            yield path, content.decode(errors="replace")


def modules_after(statement: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter holds after ``statement``."""
    program = f"{statement}\nimport sys\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    command = [sys.executable, "-c", program]
    return set(subprocess.run(command, cwd=ROOT, capture_output=True, check=True, text=True).stdout.split())


def test_no_lock_file_is_tracked() -> None:
    assert lock_files(tracked_paths()) == []


@pytest.mark.parametrize("name", [*LOCK_FILES, "pylock.docs.toml"])
def test_a_lock_file_is_found_in_any_folder(name: str) -> None:
    locks = [name, f"a/b/{name}"]
    assert lock_files([*locks, "constraints.txt", "insenv/data/clock.py"]) == locks


def test_no_tracked_text_names_a_package_index() -> None:
    paths = tracked_paths()
    assert "pyproject.toml" in paths  # the list is that of this repository, not of an empty one
    assert index_settings(texts(paths)) == []


@pytest.mark.parametrize("forbidden", FORBIDDEN_TEXT)
def test_an_index_setting_is_found_with_its_line(forbidden: str) -> None:
    files = [("good.txt", "numpy==2.0\n"), ("bad.txt", f"numpy==2.0\n# x {forbidden.upper()} y\n")]
    assert index_settings(files) == [f"bad.txt:2: {forbidden.upper()}"]


def test_version_is_the_same_everywhere() -> None:
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert insenv.__version__ == declared


def test_importing_insenv_loads_no_heavy_library() -> None:
    assert modules_after("import insenv").isdisjoint(IMPORTED_WHEN_USED)


def test_what_an_environment_imports_leaves_slow_parts_of_scipy_until_they_are_used() -> None:
    """They cost more than all the rest of a first step: imports at the head of these modules are read."""
    slow = {"scipy.signal", "scipy.interpolate", "scipy.ndimage", "scipy.optimize", "scipy.stats"}
    folders = ("core", "data", "effects", "sensors", "plants", "scenario", "envs", "systems")
    assert [one for folder in folders for one in at_the_head(ROOT / "insenv" / folder, slow)] == []


def test_no_module_imports_the_distributions_of_scipy_at_its_head() -> None:
    """They cost a quarter of what `insenv close-loop` imports, and its special functions give the same numbers.

    `scipy.signal` brings them along.
    """
    assert at_the_head(ROOT / "insenv", {"scipy.stats", "scipy.signal"}) == []


def at_the_head(folder: Path, slow: set[str]) -> list[str]:
    """Imports of ``slow`` modules at the head of those in a folder."""
    found = []
    for path in sorted(folder.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            heads = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            heads += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            found += [f"{path}: {name}" for name in heads if name in slow]
    return found


@pytest.mark.parametrize("name", ["scipy", "pint"])
def test_a_heavy_library_would_be_noticed(name: str) -> None:
    assert name in modules_after(f"import {name}")
