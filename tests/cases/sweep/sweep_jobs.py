"""Jobs of sweeps that worker processes import, and a driver that is there to be killed."""

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.sweep import Folder, Identity, backend, sweep

FIRST, TOTAL = 7, 600
#: Time that a run of the slow job takes [s].
PAUSE = 0.004


def walk(seeds: Sequence[int]) -> dict[str, NDArray[Any]]:
    """The end of a random walk."""
    ends = [np.random.default_rng(seed).standard_normal(100).sum() for seed in seeds]
    return {"seed": np.array(seeds), "end": np.array(ends)}


def slow(seeds: Sequence[int]) -> dict[str, NDArray[Any]]:
    """The same, so slowly that there is time to kill somebody."""
    time.sleep(PAUSE * len(seeds))
    return walk(seeds)


def short(seeds: Sequence[int]) -> dict[str, NDArray[Any]]:
    """A job that loses a row."""
    return {"seed": np.array(seeds)[1:]}


def failing(seeds: Sequence[int]) -> dict[str, NDArray[Any]]:
    """A job that refuses a seed."""
    if 300 in seeds:
        raise InputError("seed 300 is refused")
    return walk(seeds)


IDENTITY = Identity("sweep_jobs:slow", FIRST, TOTAL)


def main() -> None:
    """Drive a sweep of `slow` into a folder: its path, the processes, and a cluster if there is one."""
    path, jobs, *cluster = sys.argv[1:]
    store = Folder(Path(path), IDENTITY, resume=True)
    where = backend(int(jobs), cluster[0] if cluster else None)
    sweep(slow, FIRST, TOTAL, store, where, chunk=11)


if __name__ == "__main__":
    main()
