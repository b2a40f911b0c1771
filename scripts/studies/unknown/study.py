"""How often the loop is right, honest or wrong about causes that no catalogue has.

    python scripts/studies/unknown/study.py STORE [--seed N] [--minutes 5]          run the cases, one file each
    python scripts/studies/unknown/study.py STORE --out PAGE.md [--before STORE]    the page

Cases are made by `generate.py`, which imports nothing of insenv, and judged by `rules.py`. What the store holds is not
run again.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from generate import Plan, made, plans
from rules import judge

from insenv.close import close
from insenv.core.errors import InputError
from insenv.identify.findings import Findings

Kept = dict[str, Any]


def run(plan: Plan, seed: int, store: Path) -> Kept:
    """The outcome of a case, from the store where it is there."""
    path = store / f"{plan.name}-{seed}.json"
    if path.exists():
        return dict(json.loads(path.read_text(encoding="utf-8")))
    with tempfile.TemporaryDirectory() as name:
        truth = made(plan, Path(name), seed)
        began = time.process_time()
        try:
            answer = _said(close(Path(name) / plan.name / "manifest.toml"))
        except InputError as error:
            answer = {"error": str(error)}
    kept = {"truth": asdict(truth), "answer": answer, "seconds": time.process_time() - began}
    kept = json.loads(json.dumps(kept))
    path.write_text(json.dumps(kept, indent=1), encoding="utf-8")
    return kept


def _said(found: Findings) -> Kept:
    targets = {}
    for target in found.targets:
        added = [
            (_key(a.effect, a.order), list(a.confounded_with), list(getattr(a, "same_curve", ())))
            for a in target.added
            if not a.generic
        ]
        words = [
            _key(a.effect, a.order) + (f" | {', '.join(r)}" if (r := a.confounded_with) else "") for a in target.added
        ]
        targets[target.target] = {
            "verdict": target.verdict,
            "added": added,
            "text": "; ".join(words) or "nothing",
            "reasons": list(target.reasons),
            "rejected": [[r.effect, r.p_value, r.reason] for r in target.rejected[:6]],
        }
    return {"targets": targets}


def _key(effect: str, order: int | None) -> str:
    return effect if order is None else f"{effect}:{order}"


def tally(kept: Iterable[Kept]) -> Counter[str]:
    """Words of the cases."""
    return Counter(judge(k["truth"], k["answer"])[0] for k in kept)


def _all(store: Path) -> list[Kept]:
    return [json.loads(p.read_text(encoding="utf-8")) for p in sorted(store.glob("*.json"))]


def listed(kept: Iterable[Kept]) -> str:
    """A line for each case that is not right, and the counts by family."""
    rows = []
    for k in kept:
        word, why = judge(k["truth"], k["answer"])
        if word != "right":
            rows.append(f"{word:15s} {k['truth']['name']:36s} {why}")
    return "\n".join(sorted(rows))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path)
    parser.add_argument("--part", default="1/1", help="of the cases, as 1/2")
    parser.add_argument("--only", default="", help="cases whose name has this")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--nulls", type=int, default=45)
    parser.add_argument("--minutes", type=float, default=np.inf, help="after which no further case is begun")
    parser.add_argument("--before", type=Path, help="store of the program as it was")
    parser.add_argument("--out", type=Path, metavar="PAGE.md")
    given = parser.parse_args()
    if given.out is not None:
        from page import page

        given.out.write_text(page(_all(given.store), _all(given.before) if given.before else None), encoding="utf-8")
        return
    given.store.mkdir(parents=True, exist_ok=True)
    part, parts = map(int, given.part.split("/"))
    every = plans(given.nulls)
    # In an order by chance: a run that is stopped early has something of everything.
    order = np.random.default_rng(1).permutation(len(every))
    chosen = [every[k] for k in order if given.only in every[k].name][part - 1 :: parts]
    kept, began = [], time.monotonic()
    for plan in chosen:
        if time.monotonic() - began > 60 * given.minutes:
            break
        kept.append(run(plan, given.seed, given.store))
        print(f"{plan.name}: {judge(kept[-1]['truth'], kept[-1]['answer'])[0]}", file=sys.stderr)
    print(listed(kept))
    for family in ("unknown", "pair", "control", "null"):
        print(family, dict(tally(k for k in kept if k["truth"]["family"] == family)))


if __name__ == "__main__":
    main()
