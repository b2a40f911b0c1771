"""Would the tests notice? Small faults are put into the code one at a time, and the tests beside it are run.

A fault (mutant) is one of Cosmic Ray's: another comparison, another sign or operation, a number one more or one less,
`and` for `or`, `not` put in, True for False, a loop left out. It is drawn in two steps, a place in the code and then
a fault there, so that a line counts once however many faults fit it. Type hints and the identity of None are left
alone: such faults change nothing. The work is done in a copy of the tree.

The score is the share of the mutants that a test notices (fails, or does not end in time). It is a sample: its
interval of 95 % is exact (Clopper and Pearson 1934).

    pip install cosmic-ray==8.7.0
    python scripts/studies/mutation/study.py STORE --most 40 [--part effects]   # goes on where it stopped
    python scripts/studies/mutation/study.py STORE --survivors                  # what no test noticed
"""

from __future__ import annotations

import argparse
import difflib
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from time import monotonic

import parso
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names
from scipy.stats import beta

ROOT = Path(__file__).resolve().parents[3]
TARGETS = Path(__file__).with_name("targets.toml")
ARITHMETIC = ("Add", "Sub", "Mul", "Div", "Pow")
COMPARISONS = ("Eq", "NotEq", "Lt", "LtE", "Gt", "GtE")
KINDS = (
    "AddNot",
    "NumberReplacer",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ZeroIterationForLoop",
    "ReplaceUnaryOperator_USub_UAdd",
)
TIMES = 4.0  # a mutant is noticed that takes this many times the time of the sound code


@dataclass(frozen=True)
class Mutant:
    """One fault: file (of the tree), line, Cosmic Ray's operator and which of its occurrences in the file."""

    part: str
    file: str
    line: int
    operator: str
    occurrence: int


@dataclass(frozen=True)
class Outcome:
    """What the tests said of a mutant."""

    mutant: Mutant
    noticed: bool
    diff: str


def operators() -> list[str]:
    """Names of the operators that are used."""
    pairs = [f"ReplaceBinaryOperator_{a}_{b}" for a in ARITHMETIC for b in ARITHMETIC]
    pairs += [f"ReplaceComparisonOperator_{a}_{b}" for a in COMPARISONS for b in COMPARISONS]
    wanted = {f"core/{name}" for name in (*KINDS, *pairs)}
    return [name for name in operator_names() if name in wanted]


def of_type_hint(node: parso.tree.NodeOrLeaf) -> bool:
    """Whether a place stands in a type hint, which nothing runs."""
    while node.parent is not None:
        parent = node.parent
        if parent.type in ("annassign", "tfpdef") and parent.children[1] is node:
            return True
        if parent.type == "funcdef" and node in parent.children[3:-2]:
            return True
        node = parent
    return False


def places(source: str) -> dict[int, list[tuple[str, int]]]:
    """Faults that fit each line: (operator, occurrence)."""
    found: dict[int, list[tuple[str, int]]] = defaultdict(list)
    tree = get_ast(source)
    for name in operators():
        operator = get_operator(name)()
        sites = ((node, start) for node in ast_nodes(tree) for start, _ in operator.mutation_positions(node))
        for occurrence, (node, start) in enumerate(sites):
            if not of_type_hint(node):
                found[start[0]].append((name, occurrence))
    return found


def drawn(part: str, modules: list[str], most: int, seed: int) -> list[Mutant]:
    """`most` mutants of a part, no two of one line."""
    files = sorted({p for pattern in modules for p in ROOT.glob(pattern) if p.name != "__init__.py"})
    lines = [
        (str(file.relative_to(ROOT)), line, faults)
        for file in files
        for line, faults in sorted(places(file.read_text()).items())
    ]
    draw = random.Random(f"{part} {seed}")
    return [
        Mutant(part, file, line, *draw.choice(faults))
        for file, line, faults in draw.sample(lines, min(most, len(lines)))
    ]


def copy_of_tree(to: Path) -> None:
    """What git knows of the tree, so that a fault never stands in the tree itself."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in filter(None, names.split("\0")):
        (to / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, to / name)


def passes(tree: Path, tests: list[str], limit_s: float | None = None) -> bool:
    """Whether the fast tests pass in a tree."""
    environment = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "", "MPLBACKEND": "Agg"}
    environment |= {"PYTHONPYCACHEPREFIX": str(tree / ".compiled")}
    environment |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-m", "not slow", "-p", "no:cacheprovider", *tests]
    try:
        ran = subprocess.run(command, cwd=tree, env=environment, capture_output=True, timeout=limit_s, check=False)
    except subprocess.TimeoutExpired:
        return False
    return ran.returncode == 0


def outcome(mutant: Mutant, tree: Path, tests: list[str], limit_s: float) -> Outcome | None:
    """Put the fault into the copy, run the tests, take it out; None where the operator leaves the text alone."""
    path = tree / mutant.file
    sound = path.read_text()
    faulty = mutate_code(sound, get_operator(mutant.operator)(), mutant.occurrence)
    if faulty is None or faulty == sound:
        return None
    diff = "\n".join(difflib.unified_diff(sound.splitlines(), faulty.splitlines(), mutant.file, "", n=2, lineterm=""))
    try:
        path.write_text(faulty)
        return Outcome(mutant, not passes(tree, tests, limit_s), diff)
    finally:
        path.write_text(sound)


def kept(store: Path) -> Iterator[Outcome]:
    """Outcomes of a store."""
    for line in store.read_text().splitlines() if store.exists() else ():
        row = json.loads(line)
        yield Outcome(Mutant(**row["mutant"]), row["noticed"], row["diff"])


def interval(good: int, n: int) -> tuple[float, float]:
    """Exact 95 % interval of a share."""
    low = beta.ppf(0.025, good, n - good + 1) if good else 0.0
    high = beta.ppf(0.975, good + 1, n - good) if good < n else 1.0
    return float(low), float(high)


def table(outcomes: list[Outcome]) -> str:
    """Score of each part and of all."""
    rows = ["| part | noticed | 95 % |", "| --- | --- | --- |"]
    parts = list(dict.fromkeys(one.mutant.part for one in outcomes))
    for name, members in [(p, [o for o in outcomes if o.mutant.part == p]) for p in parts] + [("all", outcomes)]:
        good, n = sum(o.noticed for o in members), len(members)
        low, high = interval(good, n)
        rows.append(f"| {name} | {good}/{n} = {good / n:.0%} | {low:.0%} to {high:.0%} |")
    return "\n".join(rows)


def run(store: Path, parts: dict[str, dict[str, list[str]]], most: int, seed: int) -> None:
    """Run what the store does not hold yet."""
    done = {one.mutant for one in kept(store)}
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        copy_of_tree(tree)
        for name, part in parts.items():
            wanted = [m for m in drawn(name, part["modules"], most, seed) if m not in done]
            if not wanted:
                continue
            limit_s = TIMES * sound_time_s(tree, part["tests"])
            for number, mutant in enumerate(wanted, 1):
                found = outcome(mutant, tree, part["tests"], limit_s)
                if found is not None:
                    with store.open("a") as file:
                        file.write(json.dumps(asdict(found)) + "\n")
                    print(f"{name} {number}/{len(wanted)} {'noticed' if found.noticed else 'SURVIVED'} {mutant}")


def sound_time_s(tree: Path, tests: list[str]) -> float:
    """Time of the tests on the sound code, which must pass."""
    start = monotonic()
    if not passes(tree, tests):
        raise SystemExit(f"The sound code fails its own tests: {' '.join(tests)}.")
    return monotonic() - start


def main() -> None:
    """Run the study, or show it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path, metavar="STORE", help="file of outcomes, one line each")
    parser.add_argument("--most", type=int, default=40, help="mutants of each part (%(default)s)")
    parser.add_argument("--part", action="append", help="this part alone; again for more")
    parser.add_argument("--seed", type=int, default=0, help="of the draw (%(default)s)")
    parser.add_argument("--survivors", action="store_true", help="show what no test noticed, run nothing")
    asked = parser.parse_args()
    parts = {name: part for name, part in tomllib.loads(TARGETS.read_text()).items() if name in (asked.part or [name])}
    if not asked.survivors:
        run(asked.store, parts, asked.most, asked.seed)
    outcomes = [one for one in kept(asked.store) if one.mutant.part in parts]
    if asked.survivors:
        print("\n\n".join(one.diff for one in outcomes if not one.noticed))
    if outcomes:
        print(table(outcomes))


if __name__ == "__main__":
    main()
