"""Effects of known size in measured recordings: cases drawn, the loop closed on them, answers judged.

    python study.py draw  developed FOLDER STORE --cases 120 --seed 1     altered recordings, STORE/cases/NNN
    python study.py close STORE LABEL [--only PATTERN]                    answers, STORE/LABEL/*.json
    python study.py judge STORE LABEL                                     words, by kind and by law

FOLDER holds the parts of the measured library as `measured/library.py` lays them out. Untouched controls are closed
with the cases: a case is judged beside what the same engine says of the recording as it was. Interrupted, it goes on.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
from cases import NoneSuch, drawn
from judge import GOOD, Word, answer, judge
from laws import IN_ATTITUDES, RESTED, TURNED
from recordings import read, written

from insenv.core.errors import InputError

HERE = Path(__file__).resolve().parent
THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
#: Seconds after which a recording counts as not answered.
LIMIT = 600.0
#: Recordings longer than so many rows are left out: the study is of many.
MOST_ROWS = 400_000
#: Share of the cases of each kind, and how many recordings of it there are.
SHARES = {"reference": 0.6, "attitudes": 0.2, "rest": 0.2}
LAWS = {"reference": TURNED, "attitudes": IN_ATTITUDES, "rest": RESTED}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    draw_ = commands.add_parser("draw")
    draw_.add_argument("side", choices=("developed", "closed"))
    draw_.add_argument("folder", type=Path)
    draw_.add_argument("store", type=Path)
    draw_.add_argument("--cases", type=int, default=120)
    draw_.add_argument("--recordings", type=int, default=40)
    draw_.add_argument("--seed", type=int, default=1)
    draw_.set_defaults(run=draw)
    close_ = commands.add_parser("close")
    close_.add_argument("store", type=Path)
    close_.add_argument("label")
    close_.add_argument("--only", default="*")
    close_.add_argument("--minutes", type=float, default=1e9)
    close_.set_defaults(run=close)
    judge_ = commands.add_parser("judge")
    judge_.add_argument("store", type=Path)
    judge_.add_argument("label")
    judge_.add_argument("--all", action="store_true", help="right ones too")
    judge_.set_defaults(run=report)
    given = parser.parse_args()
    given.run(given)


def draw(given: argparse.Namespace) -> None:
    """Cases of each kind, one after the other over its recordings; laws in turn."""
    split = tomllib.loads((HERE / "split.toml").read_text(encoding="utf-8"))[given.side]
    number = 0
    for kind, share in SHARES.items():
        there = [m for m in split[kind] if (given.folder / m).exists()][: round(share * given.recordings)]
        laws, turn = list(LAWS[kind]), 0
        for k in range(round(share * given.cases)):
            if not there:
                break
            name = there[k % len(there)]
            wanted = [laws[(turn + j) % len(laws)] for j in range(len(laws))]
            try:
                _keep(given.folder / name, given.store / "untouched" / _stem(name))
                seed = [given.seed, number]
                truth = drawn(given.folder / name, name, kind, wanted, seed, given.store / "cases" / f"{number:03d}")
            except (NoneSuch, InputError, LookupError, ValueError, np.linalg.LinAlgError) as fault:
                print(f"    {name}: {fault}", file=sys.stderr)
                there = [m for m in there if m != name]
                continue
            turn = laws.index(truth.law) + 1
            print(f"{number:03d} {name:45s} {truth.target:8s} {truth.law:26s} {truth.size:9.3g} at {truth.strength:4.1f}", flush=True)
            number += 1


def _keep(path: Path, folder: Path) -> None:
    if (folder / "case.toml").exists():
        return
    kept = read(path)
    if sum(map(len, kept.runs)) > MOST_ROWS:
        raise NoneSuch("has more rows than are looked at here")
    folder.mkdir(parents=True, exist_ok=True)
    written(kept, folder)


def _stem(name: str) -> str:
    return name.removesuffix(".toml").replace("/", "__")


def truths(store: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Number and truth of each case."""
    for path in sorted(store.glob("cases/*/truth.json")):
        yield path.parent.name, json.loads(path.read_text(encoding="utf-8"))


def close(given: argparse.Namespace) -> None:
    """Close the loop on cases and on what they were made of; answers that are there are kept."""
    answers = given.store / given.label
    answers.mkdir(parents=True, exist_ok=True)
    for number, truth in truths(given.store):
        if fnmatch(number, given.only) or fnmatch(truth["law"], given.only) or fnmatch(truth["recording"], given.only):
            _close(given.store / "untouched" / _stem(truth["recording"]), answers / _stem(truth["recording"]))
            _close(given.store / "cases" / number, answers / number)
            print(_line(number, truth, _word(truth, answers, number)), flush=True)


def _close(case: Path, stem: Path) -> None:
    if stem.with_suffix(".err").exists():
        return
    words = [sys.executable, "-m", "insenv", "close-loop", str(case / "case.toml"), "-q", "--json", f"{stem}.json"]
    try:
        told = subprocess.run(words, env=os.environ | THREADS, capture_output=True, timeout=LIMIT).stderr
    except subprocess.TimeoutExpired:
        told = f"insenv: no answer within {LIMIT:g} s".encode()
    stem.with_suffix(".err").write_bytes(told)


def _word(truth: Mapping[str, Any], answers: Path, number: str) -> Word:
    return judge(truth, answers / _stem(truth["recording"]), answers / number)


def _line(number: str, truth: Mapping[str, Any], word: Word) -> str:
    what = f"{truth['law']} {truth['size']:.3g} at {truth['strength']:.1f}"
    return f"{number} {word.word:20s} {what:40s} {truth['recording']} {truth['target']}\n      {word.said} | {word.why}"


def report(given: argparse.Namespace) -> None:
    """Words of all cases that are answered, counted by kind and by law."""
    answers = given.store / given.label
    rows = [(n, t, _word(t, answers, n)) for n, t in truths(given.store) if (answers / f"{n}.err").exists()]
    for number, truth, word in rows:
        if given.all or word.word != "right":
            print(_line(number, truth, word))
    for key in ("law", "kind"):
        print()
        for one in sorted({t[key] for _, t, _ in rows}):
            print(f"{one:28s}", counted([w for _, t, w in rows if t[key] == one]))
    print(f"\n{'all':28s}", counted([w for *_, w in rows]))


def counted(words: Sequence[Word]) -> str:
    """How many are right or honest, and how often each word was given."""
    count = Counter(w.word for w in words)
    good = sum(count[w] for w in GOOD)
    return f"{good}/{len(words)}  " + ", ".join(f"{w} {n}" for w, n in count.most_common())


if __name__ == "__main__":
    main()
