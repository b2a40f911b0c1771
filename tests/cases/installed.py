"""Packages of other authors, installed in an environment of its own that sees this one's packages."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

from command import Ended

ROOT = Path(__file__).parents[2]
#: Commands one after another in one process: to start it takes longer than most of them.
COMMANDS = """
import contextlib, io, json, sys
from insenv.cli import main

ended = []
for options in json.loads(sys.argv[1]):
    out, err, status = io.StringIO(), io.StringIO(), 0
    sys.argv[1:] = options
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as end:
        status = end.code or 0
    ended.append((status, out.getvalue(), err.getvalue()))
print(json.dumps(ended))
"""


def commands(python: Path, folder: Path, *lines: tuple[str, ...]) -> list[Ended]:
    """How `insenv` with each of these options ends, run by another Python in ``folder``."""
    told = subprocess.run(
        [python, "-c", COMMANDS, json.dumps(lines)], cwd=folder, capture_output=True, text=True, timeout=500
    )
    assert told.returncode == 0, told.stdout + told.stderr
    return [Ended(*one) for one in json.loads(told.stdout)]


def environment_with(examples: Sequence[Path], folder: Path) -> Path:
    """A fresh virtual environment that sees the packages of this one, with examples installed; its Python.

    With the build backend of the examples at hand they are installed by pip, without a network; else their files and
    metadata are put where an installer would put them.
    """
    venv.create(folder)
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    program = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(subprocess.run([python, "-c", program], capture_output=True, text=True, check=True).stdout.strip())
    there = sysconfig.get_path("purelib")
    (site / "parent.pth").write_text(f"{ROOT}\nimport site; site.addsitedir({there!r})\n")
    copies = [folder / "source" / example.name for example in examples]
    for example, copy in zip(examples, copies, strict=True):
        shutil.copytree(example, copy, ignore=shutil.ignore_patterns("__pycache__"))
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet"]
    pip += ["--no-deps", "--no-index", "--no-build-isolation", *map(str, copies)]
    if subprocess.run(pip, capture_output=True).returncode != 0:
        for copy in copies:
            _put(copy, site)
    return python


def _put(source: Path, site: Path) -> None:
    """Files and metadata of a project where an installer would put them."""
    project = SimpleNamespace(**tomllib.loads((source / "pyproject.toml").read_text())["project"])
    info = site / f"{project.name.replace('-', '_')}-{project.version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project.name}\nVersion: {project.version}\n")
    points = vars(project)["entry-points"]
    text = "\n".join(
        f"[{group}]\n" + "\n".join(f"{k} = {v}" for k, v in some.items()) for group, some in points.items()
    )
    (info / "entry_points.txt").write_text(text + "\n")
    for each in source.iterdir():
        if each.is_dir():
            shutil.copytree(each, site / each.name)
        elif each.suffix == ".py":
            shutil.copy(each, site)
