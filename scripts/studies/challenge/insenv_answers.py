"""Answers of ``insenv close-loop`` to the cases of the challenge, in the form that `score.py` reads.

    python insenv_answers.py FOLDER --out answers.jsonl [--until 1500]

One line of JSON a case; what is in the file already is left out, so that a run goes on where it was stopped.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import argparse
import json
import time
from pathlib import Path

from insenv.close import close
from insenv.identify.findings import Added, Findings


def key(added: Added) -> str:
    return added.effect if added.order is None else f"{added.effect}:{added.order}"


def answer(found: Findings) -> dict[str, object]:
    """What the challenge asks: a verdict, and the names with those that each was not told from."""
    (target,) = found.targets
    return {
        "verdict": found.verdict,
        "effects": [
            {"name": key(a), "rivals": [*a.confounded_with, *a.same_curve], "p_value": a.p_value} for a in target.added
        ],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--until", type=float, default=float("inf"), help="CPU time after which to stop [s]")
    given = parser.parse_args()
    done = set()
    if given.out.exists():
        done = {json.loads(line)["case"] for line in given.out.read_text().splitlines()}
    with given.out.open("a") as out:
        for case in sorted((given.folder / "cases").iterdir()):
            if case.name in done:
                continue
            if time.process_time() > given.until:
                break
            start = time.process_time()
            said = answer(close(case / "run.toml"))
            line = {"case": case.name, "seconds": round(time.process_time() - start, 3), **said}
            out.write(json.dumps(line) + "\n")
            out.flush()


if __name__ == "__main__":
    main()
