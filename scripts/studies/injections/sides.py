"""Which recordings of the measured library are there to develop on, and which are kept closed: by owner, with a seed.

    python sides.py > sides.toml

Written before an effect was put into any of them. Of each owner who is kept closed nothing is looked at until the end.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

MEASURED = Path(__file__).resolve().parents[1] / "measured"
SEED = 20261128
#: Share of the owners that are kept closed.
CLOSED = 0.4
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
    rows = sorted(recordings())
    rng = np.random.default_rng(SEED)
    owners = sorted({owner.partition("/")[0] for owner, *_ in rows})
    closed = {owners[i] for i in rng.permutation(len(owners))[: round(CLOSED * len(owners))]}
    order = rng.permutation(len(rows))
    out = [f"# Written by sides.py with seed {SEED}: recordings in drawn order, no more than one of an owner and kind."]
    for name, inside in (("developed", False), ("closed", True)):
        out += ["", f"[{name}]"]
        for kind in KINDS:
            seen: set[str] = set()
            listed = []
            for owner, of, manifest in (rows[i] for i in order):
                owner = owner.partition("/")[0]
                if of == kind and (owner in closed) == inside and owner not in seen:
                    seen.add(owner)
                    listed.append(manifest)
            out += [f"{kind} = [", *(f'  "{manifest}",' for manifest in listed), "]"]
    sys.stdout.write("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
