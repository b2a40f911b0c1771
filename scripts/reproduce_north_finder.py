"""Reproduce the rate-biased laser-gyro north finder, and say what of it reproduces.

Zhang Yan, Wu Wenqi, Wu Meiping, Optics and Precision Engineering 19 (2011) 146: tables 1 to 4, figures 2, 5 and 6, each
beside what this package finds; then what estimators, table rate and plan are worth. Writes a page of Markdown and its
pictures.
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

import studies.north_finder.figures as figures
import studies.north_finder.judged as judged
import studies.north_finder.rates as rates
import studies.north_finder.tables as tables
from studies.result_page import Section, write

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "results"
PAGE = """\
# The rate-biased laser-gyro north finder

Zhang Yan, Wu Wenqi and Wu Meiping, *Online estimation for scale factor of north-finder based on rate biased ring laser
gyroscope*, Optics and Precision Engineering 19 (2011) 146, simulated anew. This page and its pictures are written by

```sh
python scripts/reproduce_north_finder.py --seeds {seeds}
```

Where nothing else is said: latitude 40 deg, tilt 30 deg, 10 deg/s, 300 s, 100 Hz, pulses of 0.46634601 arcsec, angle
random walk 3e-4 deg/sqrt(h); errors are root mean squares over {seeds} runs of azimuth uniform on the circle (standard
error {error:.1f} %). Estimators and policies are the plug-ins of those names. `(°)` in the paper's tables 1 and 2 reads
arcsec; the paper's latitude is inferred.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=400, help="runs behind each figure")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of the page")
    given = parser.parse_args()
    if given.seeds < 2:
        parser.error(f"--seeds {given.seeds} given; wanted at least 2")
    head = PAGE.format(seeds=given.seeds, error=100 / (2 * given.seeds) ** 0.5)
    write(given.out / "north_finder.md", head, sections(given.seeds), 12)
    print(given.out / "north_finder.md")


def sections(count: int) -> Iterator[Section]:
    """The page's parts in order; each is worked out when it is asked for."""
    seeds = range(1, count + 1)
    yield tables.equation_3()
    yield tables.table_1()
    yield judged.scale_factor_test()
    yield from tables.tables_2_and_3()
    yield tables.table_4()
    yield figures.figure_2(seed=1)
    yield figures.figure_5(seed=1)
    yield figures.figure_6(seed=1)
    yield judged.estimators(seeds)
    yield judged.plans(seeds)
    yield rates.section(rates.study(seeds))


if __name__ == "__main__":
    main()
