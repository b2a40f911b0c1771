"""Whether the error of a whole search by signs is uniform where nothing is to be found.

    python whole_error.py nulls --count 3000 --seed 1 --out nulls.jsonl [--until 600]
    python whole_error.py named --count 3000 --seed 1 --out named.jsonl [--until 600]
    python whole_error.py page nulls.jsonl --out whole_error.md

A null is a gyro on a table or at rest with a temperature: bias, scale factor and noise, written with NumPy alone. White
noise and a random walk are the noise that the loop fits; in every third null the white noise has heavy tails, which it
does not know. Of the best of all effects, lines and held-out data included, p by signs and p with looks counted are
noted. `named` closes the loop on the same nulls, with all that it refuses, and notes what it adds. Under the null p is
to be uniform, or larger: the band about the diagonal holds for all p at once in 95 %
(Dvoretzky, Kiefer and Wolfowitz); of small p, where that band says nothing, the exact binomials of a few p together.
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
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr
from scipy.stats import beta

from insenv.close import opened
from insenv.data.load import read_recordings
from insenv.data.reference import with_reference
from insenv.data.split import split
from insenv.effects.catalogue import CATALOGUE
from insenv.effects.tone import Tone
from insenv.identify.assemble import findings
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import solve
from insenv.identify.fit.heldout import held_out_score
from insenv.identify.loop import trace
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.candidates import candidates
from insenv.identify.search.round import by_fit_alone, confronted
from insenv.identify.search.scan import reference
from insenv.identify.search.tracks import Track
from insenv.identify.search.whole.directions import to_modes
from insenv.identify.search.whole.error import DRAWS, Residual

Floats = NDArray[np.float64]
#: Rows of a second, designs, and nulls of a design one after another.
ROWS, DESIGNS, IN_A_ROW = 300, 12, 10
#: Noise in whose set of rivals an effect may stand.
NOISES = ("bias_instability", "rate_random_walk")
#: Probabilities at which counts are shown.
LEVELS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
#: Candidates, best by score first, whose likelihood ratio is taken.
JUDGED = 4
#: What a problem remembers that does not depend on its readings.
OF_EXPOSURE = ("columns", "transformed", "stacked", "modes", "held-out modes", "grouping", "weight", "free")
DEG = np.pi / 180

MANIFEST = """\
title = "null"
data = "run.csv"
[channels]
time = {{ column = "t", unit = "s" }}
gyro = {{ column = "gyro", unit = "rad/s", covers = "interval" }}
temperature = {{ column = "T", unit = "degC" }}
{table}
[model]
target = "gyro"
declared = {declared}
[held_out]
averaging = "1 s"
"""
TABLE = 'table_rate = { column = "rate", unit = "rad/s", covers = "interval", source = "command" }'


def design(folder: Path, number: int, seed: int) -> Track:
    """A gyro on a table, or at rest, ready to be searched; its readings are replaced by those of the nulls."""
    rng = np.random.default_rng([seed, number])
    t = np.arange(1.0, ROWS + 1)
    kelvin = 25 + rng.uniform(2, 8) * (1 - np.exp(-t / (0.3 * t[-1]))) + np.sin(2 * np.pi * t / rng.uniform(100, 200))
    turns = number % 3 != 0
    levels = rng.permutation(np.array([0, 5, -5, 10, -10, 20, -20, 40, -40, 2, -2, 30]))
    rate = np.repeat(levels, ROWS // len(levels))[:ROWS] * DEG * turns
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(
        folder / "run.csv",
        np.column_stack([t, rate + 1e-6 * rng.standard_normal(ROWS), kelvin, rate]),
        delimiter=",", header="t,gyro,T,rate", comments="", fmt=("%.0f", "%.12e", "%.6f", "%.12e"),
    )  # fmt: skip
    text = MANIFEST.format(table=TABLE if turns else "", declared='["bias", "scale_factor"]' if turns else '["bias"]')
    (folder / "run.toml").write_text(text)
    manifest = opened(folder / "run.toml")
    recordings = tuple(map(with_reference, read_recordings(manifest)))
    prepared = prepare(manifest, recordings, split(manifest, recordings), "gyro", tones=False, holds=False)
    found, blind = candidates(prepared.problem, CATALOGUE)
    declared = {term.effect.key for term in prepared.model}
    found = tuple(c for c in found if c.effect.key not in declared)
    fit = solve(prepared.problem, prepared.model)
    return Track(prepared, found, blind, fit, held_out_score(prepared.problem, fit))


def noise(number: int, seed: int, bins: int) -> Floats:
    """White noise and a random walk; every third null has white noise with heavy tails (Student's t of 4)."""
    rng = np.random.default_rng([seed, 10**6 + number])
    white = rng.standard_t(4, bins) / np.sqrt(2) if number % 3 == 2 else rng.standard_normal(bins)
    walk = 10 ** rng.uniform(-2.5, -0.5) * np.cumsum(rng.standard_normal(bins))
    return np.asarray(1e-6 * (white + walk))


def with_noise(track: Track, values: Floats) -> Track:
    """The track with other readings: all that follows from what the gyro was exposed to is kept."""
    problem = track.problem
    kept = {k: v for k, v in problem.cache.items() if (k[0] if isinstance(k, tuple) else k) in OF_EXPOSURE}
    problem = replace(problem, y=values, cache=kept)
    fit = solve(problem, track.prepared.model)
    prepared = replace(track.prepared, problem=problem, plain=problem)
    return replace(track, prepared=prepared, fit=fit, score=held_out_score(problem, fit))


def judged(track: Track, seed: int, draws: int) -> dict[str, object]:
    """The best of a search, and both of its p-values.

    The likelihood ratio is taken of the candidates that are best by their score.
    """
    residual = Residual.of(track)
    searches = residual.chance(seed, draws)
    w = to_modes(residual.whole.fitted, residual.series[:, None].astype(np.float32))
    v = to_modes(residual.whole.held, residual.held[:, None].astype(np.float32))
    scored = residual.whole.deviates(w, v, np.random.default_rng(seed))
    order = sorted(scored, key=lambda key: float(log_tail(float(scored[key][0][0])) + np.log(searches.looks[key])))
    best = order[:JUDGED]
    found = tuple(c for c in track.candidates if c.effect.key in best)
    problem, fit = track.problem, track.fit
    base = reference(problem, fit.model, fit.noise.power)
    hits = by_fit_alone(problem, fit, base, found, seed, track.family, Tone.id in best)
    hits = [confronted(problem, fit, base, hit) for hit in hits]
    ps = [searches.p(hit)[0] for hit in hits]
    at = int(np.argmin(ps))
    return {"p_signs": ps[at], "p_looks": min(h.p_value for h in hits), "best": hits[at].candidate.effect.key}


def nulls(out: Path, count: int, seed: int, until: float, draws: int) -> None:
    """Judge nulls that are not in ``out``, a line of JSON each."""
    done = {json.loads(line)["number"] for line in out.read_text().splitlines()} if out.exists() else set()
    with tempfile.TemporaryDirectory() as folder, out.open("a") as file:
        designs = [design(Path(folder) / str(k), k, seed) for k in range(DESIGNS)]
        for number in range(count):
            if number in done:
                continue
            if time.process_time() > until:
                break
            start = time.process_time()
            track = designs[number // IN_A_ROW % DESIGNS]
            row = judged(with_noise(track, noise(number, seed, track.problem.bins.n)), number, draws)
            seconds = round(time.process_time() - start, 3)
            line = {"number": number, "turns": track.problem.turns, "heavy": number % 3 == 2, **row, "seconds": seconds}
            file.write(json.dumps(line) + "\n")
            file.flush()


def named(out: Path, count: int, seed: int, until: float) -> None:
    """Close the loop on nulls that are not in ``out``: what is added, a line of JSON each."""
    done = {json.loads(line)["number"] for line in out.read_text().splitlines()} if out.exists() else set()
    with tempfile.TemporaryDirectory() as folder, out.open("a") as file:
        designs = []
        for k in range(DESIGNS):
            design(Path(folder) / str(k), k, seed)
            manifest = opened(Path(folder) / str(k) / "run.toml")
            designs.append((manifest, read_recordings(manifest)))
        for number in range(count):
            if number in done:
                continue
            if time.process_time() > until:
                break
            manifest, (recording,) = designs[number // IN_A_ROW % DESIGNS]
            rate = recording.channels["table_rate"].values if "table_rate" in recording.channels else np.zeros(ROWS)
            gyro = replace(recording.channels["gyro"], values=rate + noise(number, seed, ROWS))
            run = (replace(recording, channels={**recording.channels, "gyro": gyro}),)
            (target,) = findings(manifest, run, trace(manifest, run, split(manifest, run))).targets
            found = {one.effect: any(noise in one.confounded_with for noise in NOISES) for one in target.added}
            line: dict[str, object] = {"number": number, "turns": bool(np.any(rate)), "heavy": number % 3 == 2}
            line |= {"verdict": target.verdict, "added": found}
            file.write(json.dumps(line) + "\n")
            file.flush()


def page(rows: list[dict[str, object]], command: str) -> str:
    """The measured distribution of p, as Markdown."""
    n, seconds = len(rows), float(np.median([float(str(row["seconds"])) for row in rows]))
    signs, looks = (np.sort([float(str(row[key])) for row in rows]) for key in ("p_signs", "p_looks"))
    band = float(np.sqrt(np.log(2 / 0.05) / (2 * n)))
    above = float(np.max(np.arange(1, n + 1) / n - signs))
    below = float(np.max(signs - 1 / (DRAWS + 1) - np.arange(n) / n))
    lines = [
        "# The error of a whole search, by signs",
        "",
        f"Made by `{command}`.",
        "",
        "*By signs* in a report: the whitened residual of the model gets signs by chance, and is searched as the",
        "recording itself was, every shape of every effect, lines and held-out data included. p is the rank of the",
        f"finding among {DRAWS} such searches. Where nothing is to be found p is to be uniform.",
        "",
        f"{n} simulated nulls: {ROWS} readings of a second, 12 designs (at rest, and on a table that turns at twelve",
        "rates), white noise and a random walk, in every third null with heavy tails (Student's t of 4). Noted is the",
        f"best of all {JUDGED} candidates that lead by score, its likelihood ratio with the noise fitted anew, shapes",
        f"refined. A null takes {seconds:.2g} s of a processor.",
        "",
        "| p at most | expected | by signs | looks counted | band of all rows, 95 % |",
        "|---:|---:|---:|---:|---|",
    ]
    for level in LEVELS:
        own, counted = int(np.sum(signs <= level + 1e-12)), int(np.sum(looks <= level))
        low, high = _band(n, level)
        mark = "" if low <= own <= high else " (outside)"
        lines.append(f"| {level:g} | {level * n:.1f} | {own}{mark} | {counted} | {low} to {high} |")
    lines += [
        "",
        f"Largest distance of the distribution from uniform: {above:+.3f} above and {below:+.3f} below; the band that",
        f"holds for all p at once in 95 % (Dvoretzky, Kiefer, Wolfowitz) is {band:.3f}. So many nulls say nothing of p",
        f"below {3 / n:.1g}.",
        "",
        "| nulls | number | p by signs at most 0.01 | at most 0.05 | at most 0.5 |",
        "|---|---:|---:|---:|---:|",
    ]
    for name, own_rows in _parts(rows):
        p = np.array([float(str(row["p_signs"])) for row in own_rows])
        shares = (f"{100 * np.mean(p <= level + 1e-12):.1f} %" for level in (0.01, 0.05, 0.5))
        lines.append(f"| {name} | {len(p)} | {' | '.join(shares)} |")
    return "\n".join([*lines, "", *REMAINS, ""])


REMAINS = (
    "What remains approximate: the model stays whitened by the noise of the recording, which is fitted anew to",
    "residuals of chance only where few modes tell it and their evidence is among the largest eighth; the",
    "residual of a fitted model is a little shorter than the noise, and is scaled; shapes are refined off their",
    "grid in the finding and not in chance; what another curve in each run or errors of the reference refuse is",
    "no finding, and chance knows nothing of such refusals, which makes p larger. The nulls here have the noise",
    "that the loop fits: noise that jumps or bursts is not in them.",
    "",
    "How chance draws its noise was settled on nulls of seeds 1 and 2. With the noise held fixed 5 of 122 nulls had",
    "p by signs of at most 0.01, with noise drawn from what the fit leaves open 23 of 921 (9 expected; looks",
    "counted 9). On 6000 nulls of a fresh seed, 4801, p by signs is below 0.01 in 1.6 % and p with looks counted in",
    "1.2 %; of p below 0.001, 26 and 21 where 6 are to be expected, a step of the bias has eleven each: a walk that",
    "goes in the last fitted seconds stands in the held-out ones as well, which a step has in common with it. Without",
    "the nulls whose best is a step 15 and 10 of 5619 are below 0.001, 66 and 44 below 0.01 (6 and 56): p with looks",
    "counted is the one to trust. Closed with all that it refuses, the loop names something beyond a set with noise in",
    "66 of the 6000, in 46 without a doubt; of 90 that have a doubt and no name 63 have it for the level of held-out",
    "data, which has gone by more than twice the scatter that the fitted noise foretells, as it does where a walk is",
    "too weak to be fitted. On 6000 more of seeds 501 and 502, closed by 2626612 with a knee of the scale factor and",
    "waves of any order in the catalogue, it names something so in 48 (0.8 %, 0.6 to 1.1 %), in 31 without a doubt.",
)


def _parts(rows: list[dict[str, object]]) -> list[tuple[str, list[dict[str, object]]]]:
    return [
        ("at rest", [row for row in rows if not row["turns"]]),
        ("on a table", [row for row in rows if row["turns"]]),
        ("Gaussian", [row for row in rows if not row["heavy"]]),
        ("heavy tails", [row for row in rows if row["heavy"]]),
    ]


def _band(n: int, level: float) -> tuple[int, int]:
    """Counts that hold at all `LEVELS` at once with 95 % or more, were p uniform."""
    side = 0.025 / len(LEVELS)
    counts = np.arange(n + 1)
    low = int(np.searchsorted(bdtr(counts, n, level), side))
    high = int(np.searchsorted(bdtr(counts, n, level), 1 - side))
    return low, high


def section(rows: list[dict[str, object]]) -> list[str]:
    """What the whole loop says where nothing is to be found, as Markdown."""
    lines = ["## What the loop says", ""]
    lines.append(
        "The loop closed on the same nulls, with all that it refuses; intervals are exact, 95 %. In a set with noise"
    )
    lines.append("a name stands beside the gyro's own flicker or walk, from which it is said not to be told.")
    lines += [
        "",
        "| nulls | number | something named | only in a set with noise | nothing named, a doubt |",
        "|---|---:|---|---|---|",
    ]
    for name, own in (("all", rows), *_parts(rows)):
        names = [dict(row["added"]) for row in own]  # type: ignore[call-overload]
        some = [one for one in names if one]
        alone = sum(not all(one.values()) for one in some)
        doubts = sum(row["verdict"] != "nothing-significant" and not row["added"] for row in own)
        shares = (_share(k, len(own)) for k in (alone, len(some) - alone, doubts))
        lines.append(f"| {name} | {len(own)} | {' | '.join(shares)} |")
    keys = Counter(key for row in rows for key in dict(row["added"]))  # type: ignore[call-overload]
    lines += ["", "Named: " + (", ".join(f"`{key}` {count}" for key, count in keys.most_common()) or "nothing") + "."]
    return lines


def _share(k: int, n: int) -> str:
    low, high = (beta.ppf(0.025, k, n - k + 1) if k else 0.0), beta.ppf(0.975, k + 1, n - k)
    return f"{k} = {100 * k / n:.2g} % ({100 * low:.2g} to {100 * high:.2g} %)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    which = parser.add_subparsers(dest="what", required=True)
    for name in ("nulls", "named"):
        one = which.add_parser(name)
        one.add_argument("--count", type=int, default=3000)
        one.add_argument("--seed", type=int, default=1)
        one.add_argument("--until", type=float, default=float("inf"), help="CPU time after which to stop [s]")
        if name == "nulls":
            one.add_argument("--draws", type=int, default=DRAWS)
        one.add_argument("--out", type=Path, required=True)
    last = which.add_parser("page")
    last.add_argument("rows", type=Path)
    last.add_argument("--named", type=Path, help="what the loop adds to the same nulls")
    last.add_argument("--seed", default="1", help="of the nulls, for the page")
    last.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    if given.what == "nulls":
        nulls(given.out, given.count, given.seed, given.until, given.draws)
    elif given.what == "named":
        named(given.out, given.count, given.seed, given.until)
    else:
        rows = [json.loads(line) for line in given.rows.read_text().splitlines()]
        command = (
            f"python scripts/studies/whole_error.py nulls --count {len(rows)} --seed {given.seed} --out nulls.jsonl"
        )
        text = page(rows, f"{command}` and `page nulls.jsonl")
        if given.named is not None:
            text += (
                "\n" + "\n".join(section([json.loads(line) for line in given.named.read_text().splitlines()])) + "\n"
            )
        given.out.write_text(text)


if __name__ == "__main__":
    main()
