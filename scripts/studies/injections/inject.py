"""Effects of known size in measured recordings: cases drawn, the loop closed on them, answers judged.

    python inject.py take developed FOLDER STORE LABEL --recordings 40   recordings, STORE/taken.json, closed untouched
    python inject.py draw FOLDER STORE --cases 120 --seed 1              altered recordings, STORE/cases/NNN
    python inject.py close STORE LABEL [--only PATTERN]                  answers, STORE/LABEL/*.json
    python inject.py judge STORE LABEL                                   words, by kind and by law

FOLDER holds the parts of the measured library as `measured/library.py` lays them out. Untouched controls are closed
with the cases: a case is judged beside what the same engine says of the recording as it was. Interrupted, it goes on.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import tempfile
import tomllib
import traceback
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
from altered_files import alters_what_is_used, read, written
from injected_cases import UnfitError, drawn
from injected_laws import IN_ATTITUDES, RESTED, TURNED
from injected_words import Word, answer, judge

import insenv.close as loop
import insenv.identify.assemble  # noqa: F401  (what a child would import again)
import insenv.identify.positions.findings  # noqa: F401  (what a child would import again)
from insenv.core.errors import InputError
from insenv.report.json import write_json

HERE = Path(__file__).resolve().parent
FORK = multiprocessing.get_context("fork")
#: Seconds after which a recording counts as not answered, unless told otherwise.
LIMIT = 600.0
#: Recordings longer than so many rows are left out: the study is of many.
MOST_ROWS = 30_000
#: Share of the cases of each kind, and how many recordings of it there are, unless told otherwise.
SHARES = {"reference": 0.6, "attitudes": 0.2, "rest": 0.2}
LAWS = {"reference": TURNED, "attitudes": IN_ATTITUDES, "rest": RESTED}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    take_ = commands.add_parser("take")
    take_.add_argument("side", choices=("developed", "closed"))
    take_.add_argument("folder", type=Path)
    take_.add_argument("store", type=Path)
    take_.add_argument("label")
    take_.add_argument("--recordings", type=int, default=40)
    take_.add_argument("--sides", type=Path, default=HERE / "sides.toml")
    take_.add_argument("--limit", type=float, default=LIMIT, help="seconds for an answer")
    take_.set_defaults(run=take)
    draw_ = commands.add_parser("draw")
    draw_.add_argument("folder", type=Path)
    draw_.add_argument("store", type=Path)
    draw_.add_argument("--cases", type=int, default=120)
    draw_.add_argument("--seed", type=int, default=1)
    draw_.add_argument("--laws", help="only these, with commas between")
    draw_.add_argument(
        "--shares", type=float, nargs=3, default=list(SHARES.values()), help="of the cases: " + ", ".join(SHARES)
    )
    draw_.add_argument("--first", type=int, default=0, help="number of the first case")
    draw_.set_defaults(run=draw)
    close_ = commands.add_parser("close")
    close_.add_argument("store", type=Path)
    close_.add_argument("label")
    close_.add_argument("--only", default="*")
    close_.add_argument("--limit", type=float, default=LIMIT, help="seconds for an answer")
    close_.set_defaults(run=close)
    judge_ = commands.add_parser("judge")
    judge_.add_argument("store", type=Path)
    judge_.add_argument("label")
    judge_.add_argument("--all", action="store_true", help="right ones too")
    judge_.set_defaults(run=report)
    given = parser.parse_args()
    given.run(given)


def take(given: argparse.Namespace) -> None:
    """The first recordings of the split that are laid out, can show an effect and are answered untouched."""
    split = tomllib.loads(given.sides.read_text(encoding="utf-8"))[given.side]
    answers = given.store / given.label
    answers.mkdir(parents=True, exist_ok=True)
    path = given.store / "taken.json"
    taken = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {kind: [] for kind in SHARES}
    left = given.store / "left.json"
    reasons = json.loads(left.read_text(encoding="utf-8")) if left.exists() else {}
    for kind, share in SHARES.items():
        for name in split[kind]:
            if len(taken[kind]) >= round(share * given.recordings):
                break
            if not (given.folder / name).exists() or name in taken[kind] or name in reasons:
                continue
            fault = _fault(given.folder / name, name, kind, given.store, answers, given.limit)
            if fault:
                reasons[name] = fault
            else:
                taken[kind].append(name)
            print(f"{kind:10s} {name:48s} {fault[:120]}", flush=True)
            path.write_text(json.dumps(taken, indent=1), encoding="utf-8")
            left.write_text(json.dumps(reasons, indent=1), encoding="utf-8")


def _fault(path: Path, name: str, kind: str, store: Path, answers: Path, limit: float) -> str:
    """Why a recording is not taken; nothing where it is."""
    try:
        _keep(path, store / "untouched" / stem_of(name))
        with tempfile.TemporaryDirectory() as folder:
            drawn(path, name, kind, list(LAWS[kind]), [0], Path(folder))
    except (UnfitError, InputError, LookupError, ValueError, np.linalg.LinAlgError) as fault:
        return str(fault) or type(fault).__name__
    _close(store / "untouched" / stem_of(name), answers / stem_of(name), limit)
    report_, told = answer(answers / stem_of(name))
    return "" if report_ is not None else told.splitlines()[-1]


def draw(given: argparse.Namespace) -> None:
    """Cases of each kind, one after the other over its recordings; laws in drawn turns."""
    taken = json.loads((given.store / "taken.json").read_text(encoding="utf-8"))
    number, only = given.first, given.laws.split(",") if given.laws else None
    for kind, share in zip(SHARES, given.shares, strict=True):
        laws = [law for law in LAWS[kind] if only is None or law in only]
        turns, rng = Counter(dict.fromkeys(laws, 0)), np.random.default_rng([given.seed, len(kind)])
        for k in range(round(share * given.cases)):
            if not laws or not taken[kind]:
                break
            name = taken[kind][k % len(taken[kind])]
            wanted = sorted(rng.permutation(laws).tolist(), key=turns.__getitem__)
            seed, number = [given.seed, number], number + 1
            try:
                truth = drawn(given.folder / name, name, kind, wanted, seed, given.store / "cases" / f"{seed[1]:03d}")
            except UnfitError as fault:
                print(f"{seed[1]:03d} {name}: {fault}", file=sys.stderr)
                continue
            turns[truth.law] += 1
            what = f"{truth.target:8s} {truth.law:26s} {truth.size:9.3g} at {truth.strength:4.1f}"
            print(f"{seed[1]:03d} {name:48s} {what}", flush=True)


def _keep(path: Path, folder: Path) -> None:
    if (folder / "case.toml").exists():
        return
    kept = read(path)
    if sum(map(len, kept.runs)) > MOST_ROWS:
        raise UnfitError("has more rows than are looked at here")
    folder.mkdir(parents=True, exist_ok=True)
    written(kept, folder)


def stem_of(name: str) -> str:
    """Of an untouched recording, the name of its copy and of its answer."""
    return name.removesuffix(".toml").replace("/", "__")


def truths(store: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Number and truth of each case."""
    for path in sorted(store.glob("cases/*/truth.json")):
        yield path.parent.name, json.loads(path.read_text(encoding="utf-8"))


def close(given: argparse.Namespace) -> None:
    """Close the loop on cases and on what they were made of; answers that are there are kept."""
    answers = given.store / given.label
    answers.mkdir(parents=True, exist_ok=True)
    cases = list(truths(given.store))
    for k in np.random.default_rng(0).permutation(len(cases)):  # what is answered so far is of all kinds
        number, truth = cases[k]
        if fnmatch(number, given.only) or fnmatch(truth["law"], given.only) or fnmatch(truth["recording"], given.only):
            own = stem_of(truth["recording"])
            _close(given.store / "untouched" / own, answers / own, given.limit)
            _close(given.store / "cases" / number, answers / number, given.limit)
            print(_line(number, truth, _word(truth, answers, number)), flush=True)


def _close(case: Path, stem: Path, limit: float) -> None:
    """Close the loop in a process of its own, which has the modules that this one has."""
    if stem.with_suffix(".err").exists():
        return
    child = FORK.Process(target=_answered, args=(case / "case.toml", stem))
    child.start()
    child.join(limit)
    if child.is_alive():
        child.kill()
        child.join()
        stem.with_suffix(".err").write_text(f"insenv: no answer within {limit:g} s", encoding="utf-8")


def _answered(manifest: Path, stem: Path) -> None:
    told = ""
    try:
        write_json(loop.close(manifest), stem.with_suffix(".json"))
    except InputError as error:
        told = f"insenv: {error}"
    except Exception:
        told = traceback.format_exc()
    stem.with_suffix(".err").write_text(told, encoding="utf-8")


def _word(truth: Mapping[str, Any], answers: Path, number: str) -> Word:
    return judge(truth, answers / stem_of(truth["recording"]), answers / number)


def _line(number: str, truth: Mapping[str, Any], word: Word) -> str:
    what = f"{truth['law']} {truth['size']:.3g} at {truth['strength']:.1f}"
    return f"{number} {word.word:20s} {what:40s} {truth['recording']} {truth['target']}\n      {word.said} | {word.why}"


def judged(store: Path, label: str) -> Iterator[tuple[str, Mapping[str, Any], Word]]:
    """Number, truth and word of each case that is answered, and that could be seen."""
    for number, truth in truths(store):
        case, untouched = store / "cases" / number, store / "untouched" / stem_of(truth["recording"])
        if (store / label / f"{number}.err").exists() and alters_what_is_used(case, untouched):
            yield number, truth, _word(truth, store / label, number)


def report(given: argparse.Namespace) -> None:
    """Words of all cases that are answered, counted by kind and by law."""
    rows = list(judged(given.store, given.label))
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
    good = sum(w.good for w in words)
    return f"{good}/{len(words)}  " + ", ".join(f"{w} {n}" for w, n in count.most_common())


if __name__ == "__main__":
    main()
