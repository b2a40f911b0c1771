"""Reproduce the two-position calibration of an optical sight and an inertial system, and say what of it reproduces.

Guo Qiang, Li Suilao, He Ying (2018), DOI 10.11977/j.issn.1004-2474.2018.01.016: table 1 conditions, headline figures
and convergence, each beside what this package finds; then estimators, time needed, and the design of the procedure.
Writes a page of Markdown and its pictures.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

# Each process has a core of its own; threads of theirs would wait for each other.
for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
from collections.abc import Iterator
from pathlib import Path

import studies.two_position.design as design
import studies.two_position.figures as figures
import studies.two_position.tables as tables
from studies.result_page import Section, write

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "results"
PAGE = """\
# The two-position calibration of a sight and an inertial system

Guo Qiang, Li Suilao and He Ying, *Error analysis and two-position calibration method of sensitive axis installation
angle* (2018), DOI 10.11977/j.issn.1004-2474.2018.01.016, simulated anew. This page and its pictures are written by

```sh
python scripts/reproduce_two_position.py --seeds {seeds}
```

Where nothing else is said: latitude 38 deg, 300 s at rest, a turn of 170 deg in 20 s, 300 s at rest, six axes at
100 Hz, gyro biases of 0.01 deg/h and accelerometer biases of 50 ug (one sigma, drawn anew for each of the {seeds}
seeds). Equations 7, 12, 15 to 18 are used as corrected: with the printed M and N equation 16 is singular at 180 deg and
wrong by 393 arcmin at 170 deg, which a test keeps.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=300, help="runs behind each figure")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of the page")
    given = parser.parse_args()
    if given.seeds < 6:
        parser.error(f"--seeds {given.seeds} given; wanted at least 6")
    write(given.out / "two_position.md", PAGE.format(seeds=given.seeds), sections(given.seeds), 5)
    print(given.out / "two_position.md")


def sections(count: int) -> Iterator[Section]:
    """The page's parts in order; each is worked out when it is asked for."""
    seeds = range(1, count + 1)
    yield tables.headline(seeds)
    yield figures.converging(seed=1)
    yield tables.estimators(seeds)
    yield tables.time_needed(seeds)
    yield design.design(seeds)


if __name__ == "__main__":
    main()
