"""The measured library laid out: manifests from here, recordings from their owners' repositories.

    python library.py PART FOLDER [--clones DIR]

A part is `facts_PART.toml`: its `[sources]` say repository, commit and files. `library/PART/SOURCE/` holds the
manifests of a source and, where a file is no table that insenv reads, a `convert.py` that writes one (with what
stands beside this script, as `ros_bag`). In FOLDER/PART/SOURCE the files of the owner stand under `raw/`, beside them
the manifests. Clones are made in DIR with git, or found there as `OWNER+NAME` or `OWNER+NAME/repo`. Files that are
there are left; no recording is kept in this repository.
"""

from __future__ import annotations

import argparse
import itertools
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

HERE = Path(__file__).resolve().parent
BRACES = re.compile(r"\{([^{}]*)\}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", help="dev, sealed, second, ... as in facts_PART.toml")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--clones", type=Path, help="folder of clones (FOLDER/clones)")
    parser.add_argument("--source", action="append", help="only this source; may be given again")
    given = parser.parse_args()
    sources = tomllib.loads((HERE / f"facts_{given.part}.toml").read_text(encoding="utf-8"))["sources"]
    failed = []
    for name in given.source or sources:
        try:
            lay_out(given.part, name, sources[name], given.folder, given.clones or given.folder / "clones")
        except (subprocess.CalledProcessError, LookupError, OSError) as fault:
            failed.append(name)
            print(f"{name}: {_sentence(fault)}", file=sys.stderr)
    print(f"{given.part}: {len(given.source or sources) - len(failed)} sources in {given.folder / given.part}")
    sys.exit(1 if failed else 0)


def lay_out(part: str, name: str, source: Mapping[str, Any], folder: Path, clones: Path) -> None:
    """Lay one source out; raise LookupError where it has no manifests here or its files are not in the commit."""
    manifests = HERE / "library" / part / name
    if not manifests.is_dir():
        raise LookupError(f"no manifests in {manifests.relative_to(HERE)}")
    here = folder / part / name
    if not (here / "raw").exists():
        here.mkdir(parents=True, exist_ok=True)
        _extract(_clone(source["repository"], clones), source["commit"], source["path"], here)
    for file in manifests.iterdir():
        shutil.copy(file, here / file.name)
    if (here / "convert.py").exists():
        found = os.environ | {"PYTHONPATH": str(HERE)}
        subprocess.run([sys.executable, "convert.py"], cwd=here, check=True, capture_output=True, text=True, env=found)


def patterns(path: str) -> Iterator[str]:
    """The patterns of a source's `path`: parted by semicolons, with braces.

    >>> list(patterns("a/{x,y}.csv; b.txt"))
    ['a/x.csv', 'a/y.csv', 'b.txt']
    """
    for each in re.split(r"\s*;\s*", path.strip()):
        parts = BRACES.split(each)
        choices = [p.split(",") if k % 2 else [p] for k, p in enumerate(parts)]
        yield from ("".join(choice) for choice in itertools.product(*choices))


def _clone(repository: str, clones: Path) -> Path:
    here = clones / repository.replace("/", "+")
    if (here / "repo").exists():
        return here / "repo"
    if not here.exists():
        clones.mkdir(parents=True, exist_ok=True)
        address = f"https://github.com/{repository}.git"
        _run("git", "clone", "--quiet", "--bare", "--filter=blob:none", address, str(here))
    return here


def _extract(clone: Path, commit: str, path: str, here: Path) -> None:
    listed = _git(clone, "ls-tree", "-r", "-z", "--name-only", commit).decode().split("\0")
    wanted = list(patterns(path))
    files = [f for f in listed if any(fnmatchcase(f, pattern) for pattern in wanted)]
    without = [pattern for pattern in wanted if not any(fnmatchcase(f, pattern) for f in listed)]
    if without:
        raise LookupError(f"no file {without[0]!r} in {clone.name} at {commit[:10]}")
    literal = [f":(literal){file}" for file in files]
    with ZipFile(BytesIO(_git(clone, "archive", "--format=zip", commit, "--", *literal))) as packed:
        packed.extractall(here / "raw")


def _git(clone: Path, *words: str) -> bytes:
    return _run("git", "-c", "safe.directory=*", "-C", str(clone), *words)


def _run(*words: str) -> bytes:
    return subprocess.run(words, check=True, capture_output=True).stdout


def _sentence(fault: Exception) -> str:
    if isinstance(fault, subprocess.CalledProcessError):
        told = fault.stderr if isinstance(fault.stderr, str) else fault.stderr.decode(errors="replace")
        return (told.strip().splitlines() or [str(fault)])[-1]
    return str(fault.args[0]) if isinstance(fault, LookupError) else str(fault)


if __name__ == "__main__":
    main()
