"""One case of the blind bench: make it, close the loop on it, keep what the report says beside what is true."""

# ruff: noqa: E402  (the bench's own physics lives with the tests: their folder must be found before it is imported)
from __future__ import annotations

import io
import json
import shutil
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tests"))  # the bench shares nothing with insenv

from blind.cases import Made, draw, further_run
from blind.damage import FAULTS, shortcomings, write

from insenv.cli import main as command
from insenv.close import close
from insenv.identify.findings import Added, Findings, TargetFindings

Kept = dict[str, Any]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Job:
    """Which case, and how."""

    kind: str
    number: int
    seed: int
    strength: float | None = None

    @property
    def name(self) -> str:
        """Of the outcome's file."""
        strength = "" if self.strength is None else f"-{self.strength:g}"
        return f"{self.kind}{strength}-{self.seed}-{self.number}"

    @property
    def command(self) -> str:
        """That runs this case alone."""
        strength = "" if self.strength is None else f" --strength {self.strength:g}"
        return f"python scripts/blind_bench.py --seed {self.seed}{strength} --only {self.kind}:{self.number}"


def done(job: Job, store: Path, keep_data: bool = False) -> Kept:
    """The outcome of a job; what the store holds is not computed again."""
    path = store / f"{job.name}.json"
    if path.exists():
        return dict(json.loads(path.read_text(encoding="utf-8")))
    folder = store / "data" / job.name
    made = draw(job.kind, job.number, job.seed, folder, job.strength)
    kept: Kept = {"name": job.name, "kind": job.kind, "command": job.command, "case": asdict(made.case)}
    # Time of the processor: what else the machine does is no fault of the search.
    began = time.process_time()
    try:
        found = close(made.case.manifest)
        seconds = time.process_time() - began
        kept |= {"seconds": seconds, **outcome(found, made)}
    except Exception as error:  # whatever ends a case is a result of the bench
        kept |= {"error": f"{type(error).__name__}: {error}", "seconds": time.process_time() - began}
    else:
        if job.kind == "confounded":
            kept["settled"] = settled(job, found.targets[0], folder)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(kept, indent=1, default=float), encoding="utf-8")
    part.replace(path)
    if not keep_data:
        shutil.rmtree(folder)
        folder.with_suffix(".truth.json").unlink()
    return kept


def damaged(seed: int) -> list[tuple[str, list[str]]]:
    """Every damaged recording: its fault, and what is wrong with how the command itself ended."""
    ended = []
    for fault in tqdm(FAULTS, unit="fault"):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            manifest = write(fault, folder, seed)
            before = set(folder.iterdir())
            status, out, err = _commanded("close-loop", str(manifest), "--json", str(folder / "out.json"))
            left = sorted(path.name for path in set(folder.iterdir()) - before)
            ended.append((fault.name, shortcomings(fault, status, out, err, left)))
    return ended


def _commanded(*words: str) -> tuple[int, str, str]:
    """Exit status and output of the command `insenv`, in this process."""
    out, err, status = io.StringIO(), io.StringIO(), 0
    with patch.object(sys, "argv", ["insenv", *words]), redirect_stdout(out), redirect_stderr(err):
        try:
            command()
        except SystemExit as end:
            status = int(end.code or 0)
    return status, out.getvalue(), err.getvalue()


def key(added: Added) -> str:
    return added.effect if added.order is None else f"{added.effect}:{added.order}"


def outcome(found: Findings, made: Made) -> Kept:
    target = found.targets[0]
    before, after = systematic(target, made)
    held = target.held_out
    return {
        "verdict": target.verdict,
        "reasons": list(target.reasons),
        "cautions": list(target.cautions),
        "added": [
            {
                "key": key(a),
                "p": a.p_value,
                "lr": a.likelihood_ratio,
                "rivals": list(a.confounded_with),
                "generic": a.generic,
                "remark": a.remark,
            }
            for a in target.added
        ],
        "rejected": [[r.effect, r.p_value, r.likelihood_ratio, r.reason] for r in target.rejected[:8]],
        "held_out": [held.before, held.after, held.noise_floor],
        "systematic": [before, after],
        "z": scale_factor_z(target, made),
        "noise": {n.effect: [n.value, n.sd] for n in target.noise},
    }


def settled(job: Job, target: TargetFindings, folder: Path) -> Kept | None:
    """What both recordings say once the table has run what was proposed; None where nothing for a table was."""
    rates = next((r for e in target.next_experiment if (r := table_rates(e.profile)) is not None), None)
    if rates is None:
        return None
    both = further_run(job.kind, job.number, job.seed, folder / "proposed", rates, job.strength)
    try:
        after = close(both).targets[0]
    except Exception as error:
        return {"verdict": f"{type(error).__name__}: {error}", "added": []}
    return {"verdict": after.verdict, "added": [[key(a), list(a.confounded_with)] for a in after.added]}


def table_rates(profile: Mapping[str, Any] | None) -> list[tuple[float, float]] | None:
    """What a table would do [(rad/s, s)], of a profile that is a chain of rates."""
    if profile is None or profile.get("kind") not in ("reversal", "staircase", "constant"):
        return None
    asked = profile.get("rates") or [profile["rate"]]
    rates = [float(np.deg2rad(_number(text, "deg/s"))) for text in asked]
    rates = [rates[0], -rates[0]] if profile["kind"] == "reversal" else rates
    dwell = _number(str(profile.get("dwell", profile.get("duration", "300 s"))), "s")
    return [(rate, dwell) for rate in rates]


def _number(text: str, unit: str) -> float:
    value, found = text.split()
    if found != unit:
        raise ValueError(f"{text!r} in {found}, wanted {unit}")
    return float(value)


def scale_factor_z(target: TargetFindings, made: Made) -> float | None:
    """Error of the declared scale factor after the search, in its own standard deviations."""
    true = made.case.scale_error
    after = [e for e in target.estimates_after if e.effect == "scale_factor" and e.sd > 0]
    return None if true is None or not after else (after[0].value - true) / after[0].sd


def systematic(target: TargetFindings, made: Made) -> tuple[float, float]:
    """Root mean square of the residual without its noise on held-out bins, before and after.

    The maker knows the noise of every row; its mean over the fitted rows goes into the bias and counts as noise too.
    """
    traces = target.traces
    mean = np.zeros(len(traces.t))
    for run in np.unique(traces.run):
        bins = traces.run == run
        mean[bins] = _noise_of_bins(made, int(run), traces.t[bins])
        fitted = bins & ~traces.held_out
        mean[bins] -= mean[fitted].mean() if fitted.any() else 0.0
    held = traces.held_out

    def rms(residual: Floats) -> float:
        return float(np.sqrt(np.mean((residual - mean)[held] ** 2)))

    return rms(traces.before), rms(traces.after)


def _noise_of_bins(made: Made, run: int, t: Floats) -> Floats:
    """Mean of the noise in the bins of a run whose middles are ``t`` [s], shape (bins,)."""
    rows, noise = made.rows[made.run == run], made.noise[made.run == run]
    w, dt = float(np.median(np.diff(t))), 1 / float(str(made.case.facts["rate_hz"]))
    middle = rows - dt + (0.5 if made.case.facts["instant"] else -0.5) * dt
    # A bin is found by its middle: gaps and bins left out are no trouble.
    number = np.rint((middle - t[0]) / w).astype(int)
    bins = np.rint((t - t[0]) / w).astype(int)
    inside = (number >= 0) & (number <= bins[-1])
    count = np.bincount(number[inside], minlength=bins[-1] + 1)[bins]
    return np.asarray(np.bincount(number[inside], noise[inside], minlength=bins[-1] + 1)[bins] / np.maximum(count, 1))
