"""Whether two halves of a recording agree as their standard deviations say: a test of the values that needs no truth.

    python halves.py FOLDER/PART ANSWERS [--only PATTERN] [--effects a,b,...]
    python halves.py --table ANSWERS [ANSWERS ...]

Of every laid-out manifest (`library.py`) with a table's angle or rate the loop is closed on the first and on the second
half of its rows, whole runs where there are several, each with its own last 40 % held out. ANSWERS gets
`source__name.1.json` and `.2.json`; what is there is kept. Every parameter that both halves state is compared,

    z = (a - b) / sqrt(s_a^2 + s_b^2),

and the root mean square of z and the share beyond 3 are told for each kind: gain, bias, delay, others. A half *states*
its values where its verdict holds no doubt, and no reason or caution says that values differ from part to part.
``--effects`` tries those effects alone, which is faster.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from insenv.close import close_on, opened
from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest.spec import HeldOut, Manifest, RowRanges
from insenv.data.power import by_power_up
from insenv.data.split import HELD_OUT_SHARE, split
from insenv.effects.catalogue import by_key
from insenv.report.json import write_json

REFERENCES = ("table_angle", "table_rate")
#: Verdicts that hold no doubt, and z from which on halves disagree.
SURE, APART = ("effects-found", "nothing-significant"), 3.0
#: Kinds of parameters by their effect; all else is "others".
KINDS = {"scale_factor": "gain", "bias": "bias", "timing_skew": "delay"}


@dataclass(frozen=True, slots=True)
class Pair:
    """One parameter as both halves state it."""

    manifest: str
    target: str
    effect: str
    name: str
    values: tuple[float, float]
    deviations: tuple[float, float]
    doubted: bool

    @property
    def z(self) -> float:
        """Difference of the halves in its standard deviation."""
        return (self.values[0] - self.values[1]) / max(math.hypot(*self.deviations), 1e-300)

    @property
    def kind(self) -> str:
        """Gain, bias, delay or others."""
        return KINDS.get(self.effect, "others")


def halves(manifest: Manifest, recordings: tuple[Recording, ...]) -> Iterator[tuple[Manifest, tuple[Recording, ...]]]:
    """The manifest and the runs of each half, with rows of their own to fit and to hold out."""
    uses = split(manifest, recordings)
    usable = [use.fit | use.held_out for use in uses]
    middle = len(recordings) // 2
    for second in (False, True):
        if middle:
            runs = recordings[middle:] if second else recordings[:middle]
            rows = usable[middle:] if second else usable[:middle]
            yield _own(manifest, rows, runs), runs
            continue
        (mask,) = usable
        own = np.flatnonzero(mask)
        cut = int(own[len(own) // 2])
        rest = ~mask
        rest[cut:] |= not second
        rest[:cut] |= second
        yield _own(manifest, [~rest], recordings), recordings


def _own(manifest: Manifest, usable: Iterable[np.ndarray[Any, Any]], runs: tuple[Recording, ...]) -> Manifest:
    """The manifest that fits the first part of the usable rows of each run and holds the rest out."""
    fit, held = [], []
    for rows, run in zip(usable, runs, strict=True):
        t = run.t[rows]
        late = run.t > t[0] + (1 - HELD_OUT_SHARE) * (t[-1] - t[0])
        fit.append(rows & ~late)
        held.append(rows & late)
    return replace(
        manifest,
        fit_rows=_ranges(np.concatenate(fit)),
        held_out=HeldOut(rows=_ranges(np.concatenate(held)), averaging=manifest.held_out.averaging),
    )


def _ranges(mask: np.ndarray[Any, Any]) -> RowRanges:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return tuple((int(a), int(b)) for a, b in edges.reshape(-1, 2))


def close_halves(path: Path, stem: Path, effects: tuple[str, ...]) -> None:
    """Close the loop on both halves of a manifest; refusals stand in ``.err``."""
    try:
        read = opened(path)
        tried = tuple(by_key(key, where="effects to try") for key in effects) or None
        for number, (own, runs) in enumerate(halves(read, by_power_up(read_recordings(read))), start=1):
            out = stem.with_name(f"{stem.name}.{number}.json")
            if not out.exists():
                write_json(close_on(own, runs, tried), out)
    except InputError as fault:
        stem.with_name(stem.name + ".err").write_text(f"{fault}\n", encoding="utf-8")


def pairs(folder: Path) -> Iterator[Pair]:
    """Every parameter that both halves of a recording state."""
    for first in sorted(folder.glob("*.1.json")):
        stem = first.name.removesuffix(".1.json")
        second = folder / f"{stem}.2.json"
        if second.exists():
            reports = [json.loads(p.read_text(encoding="utf-8")) for p in (first, second)]
            told = [_told(report) for report in reports]
            for key in told[0].keys() & told[1].keys():
                (a, s), (b, r) = told[0][key], told[1][key]
                doubted = any(_doubts(report, key[0]) for report in reports)
                yield Pair(stem, *key, (a, b), (s, r), doubted)


def _told(report: Mapping[str, Any]) -> dict[tuple[str, str, str], tuple[float, float]]:
    """Values and deviations of a report by target, effect and parameter; of one of several runs, none."""
    only, out = _targets(report)[0], {}
    added = [
        (one.get("target", only), one["effect"], p["name"], p["value"], p["sd"])
        for one in report["added"]
        for p in one["parameters"]
    ]
    stated = [
        (e.get("target", only), e["effect"], e["name"], e["value"], e["sd"]) for e in report["estimates"]["after"]
    ]
    for target, effect, name, value, sd in (*added, *stated):
        if sd and "[" not in name and (target, effect, name) not in out:
            out[target, effect, name] = (float(value), float(sd))
    return out


def _targets(report: Mapping[str, Any]) -> list[str]:
    target = report.get("target", "gyro")
    return list(report["verdicts"]) if report.get("verdicts") else [target if isinstance(target, str) else target[0]]


def _doubts(report: Mapping[str, Any], target: str) -> bool:
    verdict = (report.get("verdicts") or {}).get(target, report["verdict"])
    return verdict not in SURE


def table(found: list[Pair]) -> Iterator[str]:
    """Root mean square of z and the share beyond 3 of each kind, then every pair that is apart."""
    kinds: dict[str, list[Pair]] = defaultdict(list)
    for pair in found:
        kinds[pair.kind].append(pair)
    yield "| parameter | pairs | z rms | z rms, clipped at 5 | beyond 3 | stated, beyond 4 |\n|---|---|---|---|---|---|"
    for kind in ("gain", "bias", "delay", "others"):
        z = np.array([p.z for p in kinds[kind]])
        if not len(z):
            continue
        rms, clipped = np.sqrt(np.mean(z**2)), np.sqrt(np.mean(np.clip(z, -5, 5) ** 2))
        stated = sum(abs(p.z) > 4 and not p.doubted for p in kinds[kind])
        far = int(np.sum(np.abs(z) > APART))
        yield f"| {kind} | {len(z)} | {rms:.2f} | {clipped:.2f} | {far} ({far / len(z):.0%}) | {stated} |"
    for p in sorted(found, key=lambda p: -abs(p.z)):
        if abs(p.z) > APART:
            (a, b), (s, r) = p.values, p.deviations
            doubt = "" if not p.doubted else ", doubted"
            yield f"{p.manifest} {p.effect} {p.name}: {a:.4g} +- {s:.2g}, {b:.4g} +- {r:.2g}, z = {p.z:.1f}{doubt}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    parser.add_argument("--table", action="store_true", help="only compare the answers in these folders")
    parser.add_argument("--only", default="*", help="manifests as SOURCE/NAME.toml that match this pattern")
    parser.add_argument("--effects", default="", help="keys of the effects to try, parted by commas; else all")
    given = parser.parse_args()
    if not given.table:
        part, answers = given.folders
        answers.mkdir(parents=True, exist_ok=True)
        for path in sorted(part.glob("*/*.toml")):
            name = path.relative_to(part).as_posix()
            if fnmatch(name, given.only) and any(word in path.read_text("utf-8") for word in REFERENCES):
                stem = answers / name.removesuffix(".toml").replace("/", "__")
                if not stem.with_name(stem.name + ".err").exists():
                    print(name, file=sys.stderr)
                    close_halves(path, stem, tuple(filter(None, given.effects.split(","))))
        given.folders = [answers]
    print("\n".join(table([pair for folder in given.folders for pair in pairs(folder)])))


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
