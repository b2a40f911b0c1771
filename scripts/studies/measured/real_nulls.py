"""False names on real noise: a long rest is cut into disjoint pieces, and the loop is closed on each.

What an instrument does lasts or recurs: a name that stands in fewer than a third of the pieces of a channel, or in
one alone, is counted as false, and so is a name that needs motion, for there is none. `alpha` is the share of pieces
in which a false name is promised at most. A step, a drift or a warm-up happens once, and so is put to the next piece,
which no fit has seen: where its level has changed by half to twice of what the name foretells, it is borne out, and
told beside. A line that has no name in another piece may stand in its samples all the same: how many do is told too.
Pieces with a gap are left out. Answers are kept in a store, a line each: a study that was interrupted goes
on, and may be made in parts (`--minutes`).

    python real_nulls.py MANIFEST.toml ... [--piece 600] [--most 20] [--store FILE.jsonl] [--minutes 4]
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import argparse
import json
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.identify.findings import TargetFindings
from insenv.identify.fit.problem import NOISE_TERMS
from insenv.trust.rates import Rate

#: Noise that wanders: a name with one of these in its set says itself that it may be none.
NOISE = tuple(term.id for term in NOISE_TERMS)
#: A name that recurs in this share of a channel's pieces is the instrument's.
RECURS = 1.0 / 3.0
#: At rest these cannot be told: there is no rate and no specific force beyond the instrument's own noise.
NEED_MOTION = frozenset({"cross_axis", "g_sensitivity", "misalignment", "base_tilt"})
GYRO, ACCEL = "rad/s", "m/s^2"
#: Means of a piece that are kept to judge by; share of the change foretold from which on it is borne out.
MEANS, BORNE_OUT = 24, (0.5, 2.0)
#: Share of a line's frequency, and bins at most, within which other pieces may have it; deviations that make it so.
ABOUT, MOST_BINS, SURE = 0.03, 60, 6.0
#: A piece that lasts longer than its rows by this share has a gap.
GAP = 0.02


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
        if np.ptp(recording.t[rows_of]) > (1 + GAP) * length:
            continue
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


def answer(manifest: Path) -> dict[str, dict[str, Any]]:
    """What the loop says of each channel: its verdict, and the effects that it adds with p-value and parameters."""
    rows = np.load(manifest.with_suffix(".npz"))["rows"]
    rows = rows[: len(rows) // MEANS * MEANS].reshape(MEANS, -1, rows.shape[1]).mean(axis=1)
    said = {t.target: _of_channel(t) for t in close(manifest).targets}
    return {t: one | {"means": rows[:, j].tolist()} for j, (t, one) in enumerate(said.items())}


def _of_channel(said: TargetFindings) -> dict[str, Any]:
    added = [
        {
            "effect": a.effect,
            "p": a.p_value,
            "values": {p.parameter: (p.value, p.sd) for p in a.parameters},
            "noise": any(key in NOISE for key in a.confounded_with),
        }
        for a in said.added
    ]
    return {"verdict": said.verdict, "added": added}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("manifests", nargs="+", type=Path)
    parser.add_argument("--piece", type=float, default=600.0, help="length of a piece, seconds")
    parser.add_argument("--most", type=int, default=20, help="pieces of a recording")
    parser.add_argument("--store", type=Path, help="file of the answers, a line for each piece")
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after so long")
    given = parser.parse_args()
    end = time.monotonic() + 60 * given.minutes
    said = stored(given.store)
    for manifest in given.manifests:
        with tempfile.TemporaryDirectory() as folder:
            for piece in pieces(manifest, given.piece, given.most, Path(folder)):
                key = (str(manifest), given.piece, piece.stem)
                if key in said:
                    continue
                if time.monotonic() > end:
                    print("stopped; call again to go on")
                    return
                try:
                    said[key] = answer(piece)
                except InputError as error:
                    print(f"{manifest} {piece.stem}: {error}")
                    said[key] = {}
                print(manifest.stem, piece.stem, {t: [a["effect"] for a in x["added"]] for t, x in said[key].items()})
                if given.store:
                    with given.store.open("a", encoding="utf-8") as file:
                        file.write(json.dumps([*key, said[key]]) + "\n")
    print(*false_names(said), *summary(said), standing(given.manifests, said), sep="\n")


Said = dict[tuple[str, float, str], dict[str, dict[str, Any]]]


def stored(store: Path | None) -> Said:
    """The answers that a store has, by manifest, length of the piece and piece."""
    if store is None or not store.exists():
        return {}
    rows = (json.loads(line) for line in store.read_text(encoding="utf-8").splitlines())
    return {(manifest, length, piece): answers for manifest, length, piece, answers in rows}


@dataclass(frozen=True)
class Judged:
    """What is false in one channel of one piece, if anything is, and whether the next piece bears it out."""

    where: str
    names: tuple[str, ...]
    wrong: tuple[dict[str, Any], ...]
    verdict: str
    later: bool


def judged(said: Said) -> list[Judged]:
    """Every channel of every piece, of recordings that have two and more."""
    of: dict[tuple[str, float, str], list[tuple[str, dict[str, Any]]]] = defaultdict(list)
    for (manifest, length, piece), answers in sorted(said.items()):
        for target, one in answers.items():
            of[manifest, length, target].append((piece, one))
    out = []
    for (manifest, length, target), rows in of.items():
        if len(rows) < 2:
            continue  # nothing could recur
        count = Counter(name for _, one in rows for name in {a["effect"] for a in one["added"]})
        lasting = {n for n, k in count.items() if k >= max(2.0, RECURS * len(rows)) and n not in NEED_MOTION}
        for piece, one in rows:
            wrong = tuple(a for a in one["added"] if a["effect"] not in lasting)
            later = next((other for name, other in rows if name == _next(piece)), None)
            on = bool(wrong) and all(borne_out(a, one, later, length) for a in wrong)
            names = tuple(a["effect"] for a in one["added"] if a["effect"] in lasting)
            out.append(Judged(f"{manifest} {piece} {target}", names, wrong, one["verdict"], on))
    return out


def false_names(said: Said) -> list[str]:
    """A line for each channel of a piece with a name that does not recur."""
    return [
        f"  {one.where} ({one.verdict}{', borne out' * one.later}): "
        + ", ".join(f"{a['effect']} p = {a['p']:.1g} {a['values']}" for a in one.wrong)
        for one in judged(said)
        if one.wrong
    ]


def summary(said: Said) -> list[str]:
    """Pieces and channels that were judged, what recurs, what does not."""
    rows = judged(said)
    false = [one for one in rows if one.wrong]
    stated = sum(one.verdict == "effects-found" for one in false)
    later = sum(one.later for one in false)
    doubtful = [all(a.get("noise") for a in one.wrong) for one in false]
    neither = sum(not (one.later or may_be) for one, may_be in zip(false, doubtful, strict=True))
    once = Counter(name for one in false for name in {a["effect"] for a in one.wrong})
    recur = Counter(name for one in rows for name in set(one.names))
    return [
        f"{len({manifest for manifest, _, _ in said})} recordings, {len(rows)} pieces of channels",
        f"with a name that does not recur: {_share(len(false), len(rows))}; stated without doubt: "
        + _share(stated, len(rows)),
        f"of those the next piece bears out {later}; without them: {_share(len(false) - later, len(rows))}",
        f"that are in a set with noise by their own account {sum(doubtful)}; without them: "
        + _share(len(false) - sum(doubtful), len(rows)),
        "neither borne out nor in such a set: " + _share(neither, len(rows)),
        f"do not recur, or need motion: {dict(once)}",
        f"recur: {dict(recur)}",
    ]


def standing(manifests: Iterable[Path], said: Said) -> str:
    """How many of the lines that do not recur by name the other pieces of their channel have all the same.

    The power of the samples about the frequency (within `ABOUT` of it), over that beside it, is in means over the
    other pieces `SURE` deviations more than noise leaves (neighbouring bins of a window are not independent).
    """
    lines: dict[str, list[tuple[str, str, float]]] = defaultdict(list)
    for one in judged(said):
        manifest, piece, target = one.where.rsplit(" ", 2)
        tones = (added for added in one.wrong if added["effect"] == "tone")
        lines[manifest] += [(piece, target, float(added["values"]["f"][0])) for added in tones]
    count = 0
    for manifest in map(str, manifests):
        own = lines[manifest]
        if not own:
            continue
        recording = max(read_recordings(load_manifest(Path(manifest))), key=lambda r: r.t.size)
        rate = 1.0 / float(np.median(np.diff(recording.t)))
        rows = int(max(length for m, length, _ in said if m == manifest) * rate)
        pieces = sorted({name for m, _, name in said if m == manifest})
        for piece, target, frequency in own:
            values = recording.channels[target].values
            starts = [int(name.removeprefix("piece")) * rows for name in pieces if name != piece]
            found = [_over_its_side(values[a : a + rows], frequency / rate) for a in starts]
            mean = float(np.mean([ratio for ratio, _ in found]))
            count += mean > 1 + SURE / np.sqrt(sum(bins for _, bins in found))
    return f"of {sum(map(len, lines.values()))} lines among them the samples of the other pieces have {count} as well"


def _over_its_side(values: Floats, frequency: float) -> tuple[float, int]:
    """Power of the samples about a frequency [1/row] over that beside it, and the bins of which it is a mean."""
    row = np.arange(len(values))
    power = np.abs(np.fft.rfft((values - np.polyval(np.polyfit(row, values, 2), row)) * np.hanning(len(row)))) ** 2
    at = round(frequency * len(values))
    reach = max(2, int(ABOUT * at)) if ABOUT * at < MOST_BINS else MOST_BINS
    near = np.abs(np.arange(len(power)) - at)
    beside = power[(near > reach + 2) & (near < 8 * reach + 20)]
    about = power[near <= reach]
    return float(about.mean() / beside.mean()), len(about)


def borne_out(added: dict[str, Any], one: dict[str, Any], later: dict[str, Any] | None, length: float) -> bool:
    """Whether the ``later`` piece has the level that an effect of time foretells of it."""
    means = np.array(one.get("means", []))
    values = {name: value[0] for name, value in added["values"].items()}
    if later is None or not later.get("means") or not len(means):
        return False
    t = (np.arange(MEANS) + 0.5) * length / MEANS
    curves = {
        "bias_step": lambda x: values["c"] * (x > values["t0"]),
        "bias_drift": lambda x: values["c"] * x,
        "bias_warm_up": lambda x: values["c"] * np.exp(-x / values["tau"]),
    }
    if added["effect"] not in curves:
        return False
    curve = curves[added["effect"]]
    first = t < min(values.get("t0", np.inf), max(values.get("tau", 0.25 * length), 2 * length / MEANS))
    foretold = float(np.mean(curve(t + length)) - np.mean(curve(t[first])))
    seen = float(np.mean(later["means"]) - np.mean(means[first]))
    return bool(BORNE_OUT[0] < seen / foretold < BORNE_OUT[1]) if foretold else False


def _next(piece: str) -> str:
    return f"piece{int(piece.removeprefix('piece')) + 1:02d}"


def _share(count: int, of: int) -> str:
    low, high = Rate(count, of).interval
    return (
        f"{count} of {of} ({100 * count / max(of, 1):.1f} %, exact 95 % interval {100 * low:.1f} to {100 * high:.1f} %)"
    )


if __name__ == "__main__":
    main()
