"""False names on real noise: a long rest is cut into disjoint pieces, and the loop is closed on each.

What an instrument does lasts or recurs: a name that stands in fewer than a third of the pieces of a channel, or in
one alone, is counted as false, and so is a name that needs motion, for there is none. `alpha` is the share of pieces
in which a false name is promised at most.

    python real_nulls.py MANIFEST.toml ... [--piece 1000] [--most 10] [--out FILE.json]
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import argparse
import json
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from insenv.close import close
from insenv.core.errors import InputError
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest

#: A name that recurs in this share of a channel's pieces is the instrument's.
RECURS = 1.0 / 3.0
#: At rest these cannot be told: there is no rate and no specific force beyond the instrument's own noise.
NEED_MOTION = frozenset({"cross_axis", "g_sensitivity", "misalignment", "base_tilt"})
GYRO, ACCEL = "rad/s", "m/s^2"


def pieces(manifest: Path, length: float, most: int, folder: Path) -> Iterator[Path]:
    """Manifests of the pieces; their data lie beside them."""
    read = load_manifest(manifest)
    recording = read_recordings(read)[0]
    values = {name: np.asarray(channel.values) for name, channel in recording.channels.items()}
    targets = [t for t in read.model.targets if t in values]
    rate = 1.0 / float(np.median(np.diff(recording.t)))
    rows = int(length * rate)
    for k in range(min(recording.t.size // rows, most)):
        stem = folder / f"piece{k:02d}"
        rows_of = slice(k * rows, (k + 1) * rows)
        np.savez(stem.with_suffix(".npz"), rows=np.column_stack([values[t][rows_of] for t in targets]))
        channels = [
            f'{t} = {{ column = "rows[{j}]", unit = "{GYRO if t.startswith("gyro") else ACCEL}" }}'
            for j, t in enumerate(targets)
        ]
        text = [
            f'data = "{stem.name}.npz"',
            "[channels]",
            f'time = {{ rate = "{rate:.9g} Hz" }}',
            *channels,
            "[model]",
            f"target = {json.dumps(targets)}",
            'declared = ["bias"]',
        ]
        stem.with_suffix(".toml").write_text("\n".join(text) + "\n", encoding="utf-8")
        yield stem.with_suffix(".toml")


def named(manifest: Path) -> dict[str, list[str]]:
    """Names that the loop adds, by channel."""
    found = close(manifest)
    return {t.target: sorted({added.effect for added in t.added}) for t in found.targets}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("manifests", nargs="+", type=Path)
    parser.add_argument("--piece", type=float, default=1000.0, help="length of a piece, seconds")
    parser.add_argument("--most", type=int, default=10, help="pieces of a recording")
    parser.add_argument("--out", type=Path, help="JSON of what was named")
    given = parser.parse_args()
    said: dict[str, list[dict[str, list[str]]]] = {}
    for manifest in given.manifests:
        with tempfile.TemporaryDirectory() as folder:
            rows = []
            for piece in pieces(manifest, given.piece, given.most, Path(folder)):
                try:
                    rows.append(named(piece))
                except InputError as error:
                    print(f"{manifest} {piece.stem}: {error}")
                    rows.append({})
                print(manifest.stem, piece.stem, rows[-1], flush=True)
            said[str(manifest)] = rows
            if given.out:
                given.out.write_text(json.dumps(said, indent=1), encoding="utf-8")
    print(*summary(said), sep="\n")


def summary(said: dict[str, list[dict[str, list[str]]]]) -> list[str]:
    """Lines: pieces and channels that were judged, what recurs, what does not."""
    once: Counter[str] = Counter()
    recur: Counter[str] = Counter()
    judged = false = 0
    for rows in said.values():
        for target in sorted({t for row in rows for t in row}):
            names = [row.get(target, []) for row in rows]
            count = Counter(n for row in names for n in row)
            lasting = {n for n, k in count.items() if k >= max(2.0, RECURS * len(names)) and n not in NEED_MOTION}
            judged += len(names)
            false += sum(any(n not in lasting for n in row) for row in names)
            once.update({n: k for n, k in count.items() if n not in lasting})
            recur.update({n: k for n, k in count.items() if n in lasting})
    return [
        f"{judged} pieces of channels; {false} with a false name ({100 * false / max(judged, 1):.1f} %)",
        f"do not recur, or need motion: {dict(once)}",
        f"recur: {dict(recur)}",
    ]


if __name__ == "__main__":
    main()
