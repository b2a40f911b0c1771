"""Student rate tables: gain, skew and hold of a gyro against a real encoder, over many simulated units.

The files are those of `tests/blind/kinds/student.py`, which shares no code with insenv: a table that is driven by
sines, by steps through a motor's lag or by hand. Of that family the study takes a gyro that repeats a value for 30 ms
at rows of 10 ms, from another phase in every file, rounds to 0.01 rad/s and may turn the other way at 0.87 of the
rate; the encoder is late, noisy and rounded.

A run of the study is one unit with its files. Shown is how often the value found is within two standard deviations of
the truth (exact 95 % intervals), and what else was named.
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
import traceback
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from scipy.stats import beta
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from blind.kinds.student import Unit, files_of

from insenv.close import close
from insenv.identify.findings import TargetFindings

#: Time from row to row [s].
ROW = 0.01


def drawn(seed: int) -> Unit:
    """One unit of the family."""
    rng = np.random.default_rng(seed)
    files = int(rng.integers(1, 5))
    late = 0.02 + (0.004 * rng.standard_normal(files) if rng.random() < 0.5 else np.zeros(files))
    logged = str(rng.choice(["rate", "angle", "both"]))
    return Unit(
        dt=ROW,
        gain=float(rng.choice([-0.87, -1.0, 0.87, 1.0, -0.93])) * (1 + 0.01 * rng.standard_normal()),
        bias=float(0.02 * rng.standard_normal()),
        hold=1 if rng.random() < 0.25 else 3,
        step=0.01,
        noise=float(rng.uniform(0.002, 0.008)),
        logged=logged,
        form="delay",
        late=tuple(map(float, late)),
        encoder_noise=float(rng.uniform(0.005, 0.03) if logged == "rate" else rng.uniform(1e-4, 6e-4)),
        encoder_step=0.005 if logged == "rate" else 2 * np.pi / 16384,
        eccentricity=0.0,
        stale=0.0,
        motion=tuple(str(rng.choice(["sine", "steps", "hand"])) for _ in range(files)),
        duration=tuple(float(d) for d in rng.uniform(13, 80, files)),
        extra="",
    )


def written(unit: Unit, seed: int, folder: Path) -> Path:
    """Files and manifest of a unit."""
    names = []
    for number, file in enumerate(files_of(unit, 0.0, np.random.default_rng([seed, 1]))):
        columns = file.columns
        names.append(f"file_{number + 1}.csv")
        table = np.column_stack(list(columns.values()))
        np.savetxt(folder / names[-1], table, "%.10g", ",", header=",".join(columns), comments="")
    units = {"time": "s", "gyro": "rad/s", "table_rate": "rad/s", "table_angle": "rad"}
    lines = [f"data = {json.dumps(names)}", "[channels]"]
    lines += [f'{name} = {{ column = "{name}", unit = "{units[name]}" }}' for name in columns]
    lines += ["[model]", 'target = "gyro"', 'declared = ["bias", "scale_factor"]']
    path = folder / "unit.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def outcome(seed: int) -> dict[str, Any]:
    """What is said of a unit, in standard deviations from the truth."""
    unit = drawn(seed)
    kept: dict[str, Any] = {"seed": seed, "unit": asdict(unit)}
    with tempfile.TemporaryDirectory() as name:
        try:
            found = close(written(unit, seed, Path(name)))
        except Exception:
            return kept | {"error": traceback.format_exc()[-1500:]}
    (target,) = found.targets
    return kept | {
        "verdict": target.verdict,
        "reasons": list(target.reasons),
        "cautions": list(target.cautions),
        "named": [a.effect if a.order is None else f"{a.effect}:{a.order}" for a in target.added],
        "rivals": [list(a.confounded_with) for a in target.added],
        "values": [[(p.parameter, p.value, p.sd) for p in a.parameters] for a in target.added],
        "held_out": [target.held_out.before, target.held_out.after, target.held_out.noise_floor],
        "averaging": target.held_out.averaging,
        "after": [(e.effect, e.parameter, e.value, e.sd) for e in target.estimates_after],
        **deviates(unit, target),
    }


def deviates(unit: Unit, target: TargetFindings) -> dict[str, Any]:
    """Errors of gain, skews and hold over their standard deviations; None where the effect was not named."""
    scale = next((e for e in target.estimates_after if e.effect == "scale_factor"), None)
    z: dict[str, Any] = {"gain": None, "gain_sd": None}
    if scale is not None:
        z = {"gain": [(1 + scale.value - unit.gain) / scale.sd], "gain_sd": scale.sd}
    skew = [p for a in target.added if a.effect == "timing_skew" for p in a.parameters if p.parameter.startswith("c")]
    true = [-late for late in unit.late]
    if len(skew) == 1:
        true = [float(np.mean(true))]
    z["skew"] = [(p.value - c) / p.sd for p, c in zip(skew, true, strict=False)] if skew else None
    z["skew_sd"] = [p.sd for p in skew]
    holds = [a for a in target.added if a.effect == "sample_hold"]
    z["hold"] = None
    if holds:
        share, hold = (next(p for p in holds[0].parameters if p.parameter == n) for n in ("c", "hold"))
        z["hold"] = [(share.value - 1.0) / share.sd, (hold.value - unit.hold * unit.dt) / hold.sd]
        z["hold_value"] = [share.value, share.sd, hold.value, hold.sd]
    return z


def rate(good: int, total: int) -> str:
    """A share with its exact 95 % interval."""
    low = beta.ppf(0.025, good, total - good + 1) if good else 0.0
    high = beta.ppf(0.975, good + 1, total - good) if good < total else 1.0
    return f"{good}/{total} = {good / max(total, 1):.1%} [{low:.1%}, {high:.1%}]"


def summary(kept: list[dict[str, Any]]) -> list[str]:
    """The table."""
    whole = [k for k in kept if "error" not in k]
    lines = [f"units: {len(kept)}, refused or failed: {len(kept) - len(whole)}"]

    def told(name: str, pick: Callable[[dict[str, Any]], list[float] | None], wanted: list[dict[str, Any]]) -> None:
        z = [one for k in wanted for one in (pick(k) or [])]
        missed = sum(pick(k) is None for k in wanted)
        good = sum(abs(one) <= 2 for one in z)
        rms = float(np.sqrt(np.mean(np.square(z)))) if z else np.nan
        lines.append(
            f"{name}: within 2 sd {rate(good, len(z))}, rms z {rms:.2f}, not named in {missed} of {len(wanted)}"
        )

    told("gain", lambda k: k["gain"], whole)
    told("skew", lambda k: k["skew"], whole)
    holding = [k for k in whole if k["unit"]["hold"] > 1]
    told("hold share and time", lambda k: k["hold"], holding)
    free = [k for k in whole if k["unit"]["hold"] == 1]
    lines.append(f"hold named where none is: {rate(sum(k['hold'] is not None for k in free), len(free))}")
    others = [k for k in whole if set(k["named"]) - {"timing_skew", "sample_hold"}]
    lines.append(f"anything else named: {rate(len(others), len(whole))}")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--units", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="seed of the first unit")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for one file per unit; what it holds is not computed again")
    parser.add_argument("--verbose", action="store_true", help="show each unit")
    options = parser.parse_args()

    def kept(seed: int) -> dict[str, Any]:
        path = None if options.keep is None else options.keep / f"{seed}.json"
        if path is not None and path.exists():
            return dict(json.loads(path.read_text()))
        found = outcome(seed)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(found, default=float))
        return found

    seeds = range(options.first, options.first + options.units)
    all_kept = list(
        tqdm(
            Parallel(n_jobs=options.jobs, return_as="generator")(delayed(kept)(seed) for seed in seeds),
            total=len(seeds),
            unit="unit",
        )
    )
    if options.verbose:
        for k in all_kept:
            unit = k["unit"]
            head = f"{k['seed']}: {unit['logged']} hold {unit['hold']} gain {unit['gain']:.3f} {unit['motion']}"
            if "error" in k:
                print(head, k["error"])
                continue
            print(head, k["verdict"], k["named"], k["rivals"])
            print(
                "   z gain",
                k["gain"],
                "skew",
                np.round(k["skew"], 1) if k["skew"] else None,
                "hold",
                np.round(k["hold"], 1) if k["hold"] else None,
                k["values"],
                k["held_out"],
                k["averaging"],
            )
            print("   ", k["after"], k["reasons"], k["cautions"])
    print("\n".join(summary(all_kept)))


if __name__ == "__main__":
    main()
