"""Which recordings of the measured library are there to develop on, and which are kept closed: by owner, with a seed.

    python sides.py > sides.toml
    python sides.py --later twentieth twentyfirst > sides_later.toml
    python sides.py --later twentysecond twentythird twentyfourth > sides_fresh.toml
    python sides.py --later twentyfifth ... thirtythird > sides_last.toml    (all nine parts written out)
    python sides.py --later thirtyfourth ... thirtyeighth > sides_newest.toml
    python sides.py --later thirtyninth ... fortythird > sides_latest.toml

Written before an effect was put into any of them. Of each owner who is kept closed nothing is looked at until the end.
Parts of the library that were made later are closed as a whole, but for owners who were there before.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

MEASURED = Path(__file__).resolve().parents[1] / "measured"
SEED = 20261128
#: Share of the owners that are kept closed.
CLOSED = 0.4
#: Parts that were made after the first split.
LATER = (
    *("twentieth", "twentyfirst", "twentysecond", "twentythird", "twentyfourth", "twentyfifth", "twentysixth"),
    *("twentyseventh", "twentyeighth", "twentyninth", "thirtieth", "thirtyfirst", "thirtysecond", "thirtythird"),
    *("thirtyfourth", "thirtyfifth", "thirtysixth", "thirtyseventh", "thirtyeighth"),
    *("thirtyninth", "fortieth", "fortyfirst", "fortysecond", "fortythird", "fortyfourth"),
)
KINDS = ("reference", "attitudes", "rest")


def kind_of(manifest: Path) -> str:
    """What a recording has: a reference of rate or angle, many attitudes, or neither."""
    told = tomllib.loads(manifest.read_text(encoding="utf-8"))
    if {"table_angle", "table_rate"} & set(told["channels"]):
        return "reference"
    return "attitudes" if told["model"].get("procedure") == "multi-position" else "rest"


def recordings() -> Iterator[tuple[str, str, str]]:
    """Owner and repository, kind, and PART/SOURCE/NAME.toml of each measured recording; no simulation."""
    for facts in sorted(MEASURED.glob("facts_*.toml")):
        told, part = tomllib.loads(facts.read_text(encoding="utf-8")), facts.stem.removeprefix("facts_")
        for fact in told["recording"]:
            manifest = MEASURED / "library" / part / fact["manifest"]
            source = told["sources"].get(fact["manifest"].partition("/")[0], {})
            if manifest.exists() and fact.get("class") != "simulated" and "repository" in source:
                yield source["repository"].lower(), kind_of(manifest), f"{part}/{fact['manifest']}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--later", nargs="+", default=[], metavar="PART", help="parts of which all is closed")
    later = parser.parse_args().later
    rows = sorted(recordings())
    if later:
        after = LATER[LATER.index(later[-1]) + 1 :]
        before = {_name(owner) for owner, _, manifest in rows if _part(manifest) not in (*later, *after)}
        rows = [row for row in rows if _part(row[2]) in later and _name(row[0]) not in before]
    else:
        rows = [row for row in rows if _part(row[2]) not in LATER]
    rng = np.random.default_rng(SEED)
    owners = sorted({_name(owner) for owner, *_ in rows})
    closed = {owners[i] for i in rng.permutation(len(owners))[: round((1.0 if later else CLOSED) * len(owners))]}
    order = rng.permutation(len(rows))
    out = [f"# Written by sides.py with seed {SEED}: recordings in drawn order, no more than one of an owner and kind."]
    for name, inside in (("closed", True),) if later else (("developed", False), ("closed", True)):
        out += ["", f"[{name}]"]
        for kind in KINDS:
            seen: set[str] = set()
            listed = []
            for owner, of, manifest in (rows[i] for i in order):
                owner = _name(owner)
                if of == kind and (owner in closed) == inside and owner not in seen:
                    seen.add(owner)
                    listed.append(manifest)
            out += [f"{kind} = [", *(f'  "{manifest}",' for manifest in listed), "]"]
    sys.stdout.write("\n".join(out) + "\n")


def _name(repository: str) -> str:
    return repository.partition("/")[0]


def _part(manifest: str) -> str:
    return manifest.partition("/")[0]


if __name__ == "__main__":
    main()
