"""The loop on every manifest of laid-out parts (`library.py`), several at a time; answers as `judge.py` reads them.

    python board.py FOLDER/PART ANSWERS [--jobs 2] [--only PATTERN]

ANSWERS gets `source__name.json` and what was written to standard error, `source__name.err`. An answer that is there is
kept: interrupted, the board goes on.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatch
from pathlib import Path

import tqdm

THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
#: Seconds after which a recording counts as not answered.
LIMIT = 900.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", type=Path)
    parser.add_argument("answers", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="*", help="manifests as SOURCE/NAME.toml that match this pattern")
    given = parser.parse_args()
    given.answers.mkdir(parents=True, exist_ok=True)
    todo = list(_open(given.part, given.answers, given.only))
    with ThreadPoolExecutor(given.jobs) as pool:
        for _ in tqdm.tqdm(pool.map(lambda m: close(given.part, m, given.answers), todo), total=len(todo)):
            pass


def _open(part: Path, answers: Path, only: str) -> Iterator[str]:
    for path in sorted(part.glob("*/*.toml")):
        manifest = path.relative_to(part).as_posix()
        stem = _stem(manifest, answers)
        if fnmatch(manifest, only) and not stem.with_name(stem.name + ".err").exists():
            yield manifest


def close(part: Path, manifest: str, answers: Path) -> None:
    """Close the loop on one manifest; what it says on standard error stands in `.err` once it has ended."""
    stem = _stem(manifest, answers)
    json, errors = (stem.with_name(stem.name + suffix) for suffix in (".json", ".err"))
    words = [sys.executable, "-m", "insenv", "close-loop", str(part / manifest), "--json", str(json), "-q"]
    try:
        told = subprocess.run(words, env=os.environ | THREADS, capture_output=True, timeout=LIMIT).stderr
    except subprocess.TimeoutExpired:
        told = f"insenv: no answer within {LIMIT:g} s".encode()
    errors.write_bytes(told)


def _stem(manifest: str, answers: Path) -> Path:
    return answers / manifest.removesuffix(".toml").replace("/", "__")


if __name__ == "__main__":
    main()
