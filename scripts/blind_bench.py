"""How often `insenv close-loop` is right on recordings whose maker knows nothing of it: the blind bench.

Cases are drawn by the generator in tests/blind. Each outcome is kept as one file in ``--store``: an interrupted run
goes on where it stopped. The table shows exact 95 % intervals (Clopper and Pearson 1934).
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

from joblib import Parallel, delayed
from studies.blind_bench.page import failures, figures, page
from studies.blind_bench.run import Job, Kept, damaged, done
from tqdm import tqdm

#: Cases of each kind, where nothing else is asked.
COUNTS = {"null": 300, "exact": 120, "realistic": 120, "pair": 60, "unknown": 60, "confounded": 48, "triad": 28}
COUNTS |= {"student": 60}


def jobs(options: argparse.Namespace) -> Iterator[Job]:
    if options.only:
        kind, _, number = options.only.partition(":")
        yield Job(kind, int(number), options.seed, options.strength)
        return
    counts = {kind: count if (n := getattr(options, kind)) is None else n for kind, count in COUNTS.items()}
    # All kinds keep pace: a run that is stopped early has something of each.
    order = sorted((number / counts[kind], kind, number) for kind in counts for number in range(counts[kind]))
    for _, kind, number in order:
        yield Job(kind, number, options.seed, None if kind == "null" else options.strength)


def main() -> None:
    options = _options()
    store = options.store or Path(tempfile.mkdtemp(prefix="blind-"))
    store.mkdir(parents=True, exist_ok=True)
    work = list(jobs(options))
    calls = (delayed(done)(job, store, options.keep_data or bool(options.only)) for job in work)
    outcomes = Parallel(n_jobs=options.jobs, return_as="generator_unordered")(calls)
    kept: list[Kept] = sorted(tqdm(outcomes, total=len(work), unit="case"), key=lambda k: str(k["name"]))
    if options.only or options.list_failures:
        print(failures(kept, everything=bool(options.only)))
    if options.only:
        print(f"data and truth: {store / 'data'}")
        return
    faults = damaged(options.seed)
    print("\n".join(figures(kept, faults)))
    if options.list_failures:
        print("\n".join(f"damaged file, {name}: {'; '.join(short)}" for name, short in faults if short))
    if options.out is not None:
        page(options.out, kept, faults, _asked(options))


def _asked(options: argparse.Namespace) -> str:
    counts = " ".join(f"--{kind} {n}" for kind in COUNTS if (n := getattr(options, kind)) is not None)
    strength = f" --strength {options.strength:g}" if options.strength else ""
    return f"python scripts/blind_bench.py --seed {options.seed}{strength} {counts}".strip()


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    for kind, count in COUNTS.items():
        parser.add_argument(f"--{kind}", type=int, metavar="N", help=f"cases of this kind ({count})")
    parser.add_argument("--strength", type=float, help="of every cause; default: drawn from 10 (12), 20 and 40")
    parser.add_argument("--seed", type=int, default=0, help="of everything that is drawn")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--store", type=Path, help="folder of outcomes, one file each")
    parser.add_argument("--keep-data", action="store_true", help="keep the recordings too, in STORE/data")
    parser.add_argument("--only", metavar="KIND:NUMBER", help="one case, shown in full, its data kept")
    parser.add_argument("--list-failures", action="store_true", help="show each case that is not as wanted")
    parser.add_argument("--out", type=Path, metavar="PAGE.md", help="write the page of results")
    return parser.parse_args()


if __name__ == "__main__":
    main()
