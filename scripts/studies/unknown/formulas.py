"""How often a search among formulas finds a law that no catalogue has, and how often it finds one where there is none.

    python scripts/studies/unknown/formulas.py STORE [--seeds 3] [--strength 20] [--nulls 300] [--minutes 5]
    python scripts/studies/unknown/formulas.py STORE --rests REST.toml ... [--seeds 3] [--nulls 300]
    python scripts/studies/unknown/formulas.py STORE --beside STORE --out PAGE.md

Laws are those of `laws.py`, which imports nothing of insenv; with --rests they are put into pieces of measured rests,
under a table and in a chamber that were never there (`studies/injected.py`). Of a null the search is made whatever the
verdict: what it finds there is false. What the store holds is not run again.
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
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[2])]

from files import written
from generate import made, plans
from laws import ALIKE, LAWS, Law, addition, columns_at, left, on_rows
from studies.injected import Drivers, Floats, Logger, drawn_piece, heat, programme
from studies.injected import written as logged
from world import FITTED, cosine, span

from insenv.close import close, opened
from insenv.core.errors import InputError
from insenv.data.load import read_recordings
from insenv.data.power import by_power_up
from insenv.data.split import split
from insenv.effects.catalogue import catalogue
from insenv.identify.findings import Formulas
from insenv.identify.formula import sought
from insenv.identify.loop import trace
from insenv.trust.rates import Rate

Kept = dict[str, Any]
#: Slowest modes of a rest, of which one variance is told.
LEAST_MODES = 8


def of_law(law: Law, seed: int, strength: float) -> Kept:
    """The loop on a recording with a law, and whether its formula is the law."""
    rng = np.random.default_rng([LAWS.index(law), seed, 20])
    test = law.test(rng)
    cause = law.cause(float(rng.uniform(0, 6)))
    size = test.sized(cause, strength)
    with tempfile.TemporaryDirectory() as name:
        written(Path(name), test, [(cause, size)], rng)
        (target,) = close(Path(name) / "manifest.toml", formula=True).targets
    kept = _said(target.formulas)
    if target.formulas is not None and (found := target.formulas.found):
        tau = next((p.value for p in found.parameters if p.parameter == "tau"), 0.0)
        kept["left"] = left(test, cause, size, found.formula, tau)
    added = [a.effect if a.order is None else f"{a.effect}:{a.order}" for a in target.added]
    return {"law": law.formula, "verdict": target.verdict, "added": added, **kept}


def of_rest(manifest: Path, law: Law | None, seed: int, strength: float, length: float = 1500.0) -> Kept:
    """The same on a piece of a measured rest; without a law the search among formulas, whatever the verdict."""
    rng = np.random.default_rng([seed, len(LAWS) if law is None else LAWS.index(law), 21])
    piece = drawn_piece(read_recordings(opened(manifest))[0], rng, length)
    t, rest = piece.t, piece.rest
    turns = rng.uniform() < 0.6 if law is None else law.kind != "rest"
    wanted, u = programme(t, rng) if turns else (0.0 * t, 0.0 * t)
    d = Drivers(t, u, np.cumsum(u) * piece.dt, heat(t, rng), rest, rng)
    at = on_rows(t, u, d.angle, d.kelvin)
    declared = [np.ones(t.size), *([u] if turns else [])]
    phase = float(rng.uniform(0, 6))
    added = 0.0 * t
    if law is not None:
        added = addition(law, {**at, "a": at["a"] + phase})
        added = added * strength / _beside(added, rest, declared)
    known = '["bias", "scale_factor"]' if turns else '["bias"]'
    source = f"{manifest.parent.name}/{manifest.stem}/{piece.name}"
    with tempfile.TemporaryDirectory() as folder:
        path = logged(rest + u + added, d, wanted, turns, Logger(), known, Path(folder))
        if law is None:
            return {"source": source, **forced(path)}
        (target,) = close(path, formula=True).targets
    kept = {"law": law.formula, "source": source, "verdict": target.verdict, **_said(target.formulas)}
    kept["added"] = [a.effect if a.order is None else f"{a.effect}:{a.order}" for a in target.added]
    if target.formulas is not None and (found := target.formulas.found):
        tau = next((p.value for p in found.parameters if p.parameter == "tau"), 0.0)
        beside = [*declared, *columns_at(found.formula, at, tau).T]
        kept["left"] = _beside(added, rest, beside)
    return kept


def _beside(added: Floats, rest: Floats, columns: list[Floats]) -> float:
    """Strength of an addition beside columns on the fitted rows: its modes by the scatter of the rest's own there.

    The variance of a mode is the mean of the rest's power over modes of a fifth of an octave and more.
    """
    kept = int(FITTED * added.size)
    power = cosine(rest[:kept] - rest[:kept].mean())[1:] ** 2
    order = np.arange(1, kept)
    band = np.maximum(np.floor(5 * np.log2(order / LEAST_MODES)), 0).astype(int)
    root = np.sqrt((np.bincount(band, power) / np.maximum(np.bincount(band), 1))[band])
    basis = span(
        np.column_stack([cosine(c[:kept])[1:] / root for c in columns if np.ptp(c)] or [np.zeros((kept - 1, 0))])
    )
    own = cosine(added[:kept])[1:] / root
    return float(np.linalg.norm(own - basis @ (basis.T @ own)))


def of_null(number: int, seed: int) -> Kept:
    """The search among formulas on a recording that lacks nothing, whatever the verdict."""
    plan = next(p for p in plans(number + 1) if p.name == f"null-{number}")
    with tempfile.TemporaryDirectory() as name:
        made(plan, Path(name), seed)
        return forced(Path(name) / plan.name / "manifest.toml")


def forced(manifest: Path) -> Kept:
    """The search among formulas on every target of a recording, whatever the verdict."""
    read = opened(manifest)
    recordings = by_power_up(read_recordings(read))
    outcome = trace(read, recordings, split(read, recordings), catalogue())
    found = [_said(sought(track, outcome.alpha, outcome.seed)) for track in outcome.tracks]
    return {"targets": found, "added": [[s.hit.candidate.effect.key for s in t.steps] for t in outcome.tracks]}


def _said(formulas: Formulas | None) -> Kept:
    if formulas is None:
        return {}
    found = formulas.found
    told: Kept = {}
    if found is not None:
        told = {
            "found": found.formula,
            "alike": list(found.alike),
            "instead_of": list(found.instead_of),
            "p": found.p_value,
        }
    return {"tried": formulas.tried, "reason": formulas.reason, **told}


def right(kept: Kept) -> str:
    """The word for a law: right, an equivalent, wrong, or why there is none."""
    if "error" in kept:
        return "refused"
    if "found" not in kept:
        return "none"
    if kept["found"] == kept["law"]:
        return "right"
    return "equivalent" if kept["left"] < ALIKE else "wrong"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--strength", type=float, default=20.0)
    parser.add_argument("--nulls", type=int, default=0)
    parser.add_argument("--rests", nargs="*", type=Path, default=[], help="manifests of measured rests instead")
    parser.add_argument("--part", default="1/1", help="of the cases, as 1/2")
    parser.add_argument("--minutes", type=float, default=np.inf, help="after which no further case is begun")
    parser.add_argument("--beside", type=Path, help="store of the measured rests, for the page")
    parser.add_argument("--out", type=Path, metavar="PAGE.md")
    given = parser.parse_args()
    if given.out is not None:
        given.out.write_text(page(given.store, given.beside), encoding="utf-8")
        return
    given.store.mkdir(parents=True, exist_ok=True)
    part, parts = map(int, given.part.split("/"))
    end = time.monotonic() + 60 * given.minutes
    for name, job in list(_jobs(given))[part - 1 :: parts]:
        path = given.store / f"{name}.json"
        if path.exists() or time.monotonic() > end:
            continue
        began = time.process_time()
        try:
            kept = job()
        except InputError as error:
            kept = {"error": str(error)}
        kept["seconds"] = time.process_time() - began
        path.write_text(json.dumps(kept, indent=1), encoding="utf-8")
    print(listed(given.store))


def _jobs(given: argparse.Namespace) -> Iterator[tuple[str, Callable[[], Kept]]]:
    """Cases, laws first, each with the name that it is kept by."""
    for seed in range(given.seeds):
        for k, law in enumerate(LAWS):
            name = f"law-{k:02d}-{seed}-{given.strength:g}"
            if given.rests:
                manifest = given.rests[(k + 7 * seed) % len(given.rests)]
                yield name, partial(of_rest, manifest, law, seed, given.strength)
            else:
                yield name, partial(of_law, law, seed, given.strength)
    for n in range(given.nulls):
        if given.rests:
            yield f"null-{n:03d}", partial(of_rest, given.rests[n % len(given.rests)], None, n, 0.0)
        else:
            yield f"null-{n:03d}", partial(of_null, n, 20)


def listed(store: Path) -> str:
    """A line for each case, and counts."""
    rows, words = [], dict[str, int]()
    nulls, false = 0, 0
    for path in sorted(store.glob("*.json")):
        kept = json.loads(path.read_text(encoding="utf-8"))
        if path.name.startswith("law"):
            word = right(kept)
            words[word] = words.get(word, 0) + 1
            what = kept.get("found", kept.get("reason", kept.get("error", "")))
            rows.append(
                f"{word:16s} {kept.get('law', path.stem):26s} {kept.get('verdict', ''):24s} "
                f"{','.join(kept.get('added', [])):30s} {what} [{kept['seconds']:.1f} s]"
            )
        elif "targets" in kept:
            nulls += len(kept["targets"])
            told = [t["found"] for t in kept["targets"] if "found" in t]
            false += len(told)
            rows += [f"false            {path.stem} {told} {kept['added']}"] if told else []
    return "\n".join([*rows, f"laws: {words}", f"nulls: {false} of {nulls}"])


WORDS = ("right", "equivalent", "wrong", "none", "refused")


def page(store: Path, beside: Path | None) -> str:
    """The page of both stores."""
    lines = [
        "# Formulas for what has no name",
        "",
        "Made by `python scripts/studies/unknown/formulas.py STORE --seeds 3 --nulls 300`, the same with `--rests` and",
        "manifests of measured rests, and `--beside STORE --out docs/results/formulas.md`.",
        "",
        "* **Laws**: twenty products that no effect of the catalogue is, written with NumPy alone (`laws.py`) as means",
        "  over the rows of products at four parts of a row; on rate tables (ladders, loops, stops, swings; angle,",
        "  command or both) and at rest, in a room or in a chamber that goes from level to level. Strength 20: norm of",
        "  the whitened law beside the declared model, on the fitted rows; on measured rests whitened by their own",
        "  spectrum.",
        "* **right** is the law's own formula, **equivalent** one that leaves less than 3 of its strength, **wrong**",
        "  another; **none**: none is told. Formulas that the report names beside are not counted.",
        "* **False**: the search is made on every recording that lacks nothing, whatever the verdict, so that it is",
        "  asked hundreds of times as often as by users who ask where something is left. A target is a look.",
        "* **Measured rests**: pieces of 1500 s of gyros at rest (three ADIS16405, an MTi-G, an IG-500N, an MPU-9250,",
        "  all of `scripts/studies/measured/facts_dev.toml`).",
        "* Intervals: exact, 95 %.",
        "",
    ]
    for title, one in (("Simulated noise", store), ("Measured rests", beside)):
        if one is not None:
            lines += [f"## {title}", "", *_counts(one), "", *_by_law(one), ""]
    return "\n".join(lines)


def _stored(store: Path, begin: str) -> list[Kept]:
    return [json.loads(p.read_text(encoding="utf-8")) for p in sorted(store.glob(f"{begin}-*.json"))]


def _counts(store: Path) -> Iterator[str]:
    words = [right(kept) for kept in _stored(store, "law")]
    targets = [t for kept in _stored(store, "null") for t in kept.get("targets", [])]
    good, false = sum(w in ("right", "equivalent") for w in words), sum("found" in t for t in targets)
    yield "| | count | of | share |"
    yield "|---|---:|---:|---|"
    rows = [(word, words.count(word), len(words)) for word in WORDS if words.count(word)]
    for name, count, of in [("right or equivalent", good, len(words)), *rows, ("false", false, len(targets))]:
        rate = Rate(count, of)
        low, high = rate.interval
        yield f"| {name} | {count} | {of} | {rate.share:.1%} ({low:.1%} to {high:.1%}) |"


def _by_law(store: Path) -> Iterator[str]:
    yield "| law | verdict of the loop | formula told | word |"
    yield "|---|---|---|---|"
    for kept in sorted(_stored(store, "law"), key=lambda k: [law.formula for law in LAWS].index(k.get("law", "u|u|"))):
        told = str(kept.get("found", kept.get("error", ""))).replace("|", "\\|")
        told = f"`{told}`" if told else ""
        law = str(kept.get("law", "")).replace("|", "\\|")
        added = f" ({', '.join(kept['added'])})" if kept.get("added") else ""
        yield f"| `{law}` | {kept.get('verdict', '')}{added} | {told} | {right(kept)} |"


if __name__ == "__main__":
    main()
