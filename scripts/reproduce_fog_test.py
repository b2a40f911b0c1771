"""Reproduce the scale-factor and bias test of two fibre-optic gyros, and say what of it reproduces.

Zhang Long et al. (2016), DOI 10.11857/j.issn.1674-5124.2016.12.001: the procedure, its eight conclusions with how often
each comes out, table 5 and figures 1 to 7; then what the averaging time decides, policies that choose the rates, and
what closing the loop says of an error that is not declared.
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

import studies.fog_test.figures as figures
import studies.fog_test.tables as tables
from studies.fog_test.campaigns import campaigns
from studies.fog_test.coverage import coverage
from studies.rate_table.undeclared import undeclared
from studies.result_page import Section, write

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "results"
PAGE = """\
# Scale factor and bias of two fibre-optic gyros

Zhang Long, Ye Song, Zhou Shudao, Wang Xiaolei and Liu Feng, *Study on the methods for test and evaluation of FOG's
scale factor and bias*, China Measurement & Test 42 (12) (2016), DOI 10.11857/j.issn.1674-5124.2016.12.001, simulated
anew. This page and its pictures are written by

```sh
python scripts/reproduce_fog_test.py --seeds {seeds} --runs {runs} --undeclared {undeclared}
```

A campaign is seven power-ups with 36 rates within 35 deg/s, a turn of each (the two entries of zero join the rest of a
minute before and after); seven over the full range (rates assumed, 10 s or a turn each); seven with 6 min at rest, axis
up; and 27 h at rest, level and towards east. Preheated for 30 min (assumed), but for the 27 h. {seeds} campaigns of
each instrument: `rate_table/b215` and `rate_table/kvh13`, evaluated by the plug-ins `rate_line` and `static_bias`. The
closed-loop B-215 and the open-loop KVH-13 are modelled after what the paper says of them; their errors are assumed.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=50, help="campaigns of each instrument")
    parser.add_argument("--runs", type=int, default=100, help="runs with a fault of each policy; three times without")
    parser.add_argument("--undeclared", type=int, default=1, help="campaigns of each error that is not declared")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of the page")
    given = parser.parse_args()
    for name, least in (("seeds", 2), ("runs", 5), ("undeclared", 1)):
        if getattr(given, name) < least:
            parser.error(f"--{name} {getattr(given, name)} given; wanted at least {least}")
    head = PAGE.format(seeds=given.seeds, runs=given.runs, undeclared=given.undeclared)
    write(given.out / "fog_test.md", head, sections(given.seeds, given.runs, given.undeclared), 12)
    print(given.out / "fog_test.md")


def sections(count: int, runs: int, seeds: int) -> Iterator[Section]:
    """The page's parts in order; each is worked out when it is asked for."""
    yield tables.formulas()
    played = campaigns(count)
    yield tables.conclusions(played)
    yield tables.table_5(played)
    yield figures.curves(played)
    yield figures.at_rest(seed=1)
    yield figures.long_test(seed=1)
    yield figures.averaging_time(played)
    yield tables.full_range()
    yield tables.normalisations(played)
    yield figures.policy_section(runs, 3 * runs, max(5, runs // 3))
    yield coverage()
    yield undeclared(seeds)


if __name__ == "__main__":
    main()
