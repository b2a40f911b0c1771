"""Align with measured data: a parked, disturbed vehicle in windows, and a unit that rests in two positions.

Writes a page of Markdown and its pictures. The recordings are looked for as by `insenv datasets`.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import studies.alignment.two_rests as align_two_rests
import studies.alignment.windows as align_windows
from studies.result_page import Section, write

from insenv.core.errors import InputError
from insenv.datasets import load

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "results"
HEAD = """\
# Alignment with measured data

Two recordings that other people published. `insenv datasets --fetch` brings them, or `INSENV_DATA` names a folder that
has them; then this page and its pictures are written by

```sh
python scripts/align_measured_data.py
```
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of the page")
    given = parser.parse_args()
    try:
        for name in (align_windows.NAME, align_two_rests.NAME):
            load(name)
    except InputError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None
    write(given.out / "alignment_measured.md", HEAD, sections(), 2)
    print(given.out / "alignment_measured.md")


def sections() -> Iterator[Section]:
    """The page's parts in order; each is worked out when it is asked for."""
    yield align_windows.section()
    yield align_two_rests.section()


if __name__ == "__main__":
    main()
