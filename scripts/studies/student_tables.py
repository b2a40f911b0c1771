"""Student rate tables: gain, skew and hold of a gyro against a real encoder, over many simulated units.

The bench shares no code with insenv. The table is driven by sines, by steps through a motor's lag or by hand; the gyro
repeats a value for 30 ms at rows of 10 ms, from another phase in every file, rounds to 0.01 rad/s and turns the other
way at 0.87 of the rate; the encoder is late, noisy and rounded.

    y_k = round(g u(t_k') + b + noise),      w_k = round(u(t_k - late_r) + noise)

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
import tempfile
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.stats import beta
from tqdm import tqdm

from insenv.close import close
from insenv.identify.findings import TargetFindings

Floats = NDArray[np.float64]
ROW, FINE = 0.01, 0.001


@dataclass(frozen=True)
class Unit:
    """What is true of a unit and of its files."""

    seed: int
    gain: float
    bias: float
    hold: float
    late: tuple[float, ...]
    noise: float
    logged: str
    encoder_noise: float
    motion: tuple[str, ...]
    duration: tuple[float, ...]
    instant: bool = True


def drawn(seed: int) -> Unit:
    """One unit of the family."""
    rng = np.random.default_rng(seed)
    files = int(rng.integers(1, 5))
    late = 0.02 + (0.004 * rng.standard_normal(files) if rng.random() < 0.5 else np.zeros(files))
    logged = str(rng.choice(["rate", "angle", "both"]))
    return Unit(
        seed=seed,
        gain=float(rng.choice([-0.87, -1.0, 0.87, 1.0, -0.93])) * (1 + 0.01 * rng.standard_normal()),
        bias=float(0.02 * rng.standard_normal()),
        hold=0.0 if rng.random() < 0.25 else 0.03,
        late=tuple(map(float, late)),
        noise=float(rng.uniform(0.002, 0.008)),
        logged=logged,
        encoder_noise=float(rng.uniform(0.005, 0.03) if logged == "rate" else rng.uniform(1e-4, 6e-4)),
        motion=tuple(str(rng.choice(["sine", "steps", "hand"])) for _ in range(files)),
        duration=tuple(float(d) for d in rng.uniform(13, 80, files)),
    )


def moved(kind: str, t: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """True and commanded rate on a fine grid [rad/s]."""
    top = rng.uniform(0.8, 3.0)
    if kind == "sine":
        told = top * np.sin(2 * np.pi * rng.uniform(0.15, 0.8) * t + rng.uniform(0, 6))
        return lagged(told, 0.03), told
    if kind == "steps":
        dwell = rng.uniform(2.0, 5.0)
        told = top * rng.uniform(-1, 1, int(t[-1] / dwell) + 1)[(t / dwell).astype(int)]
        return lagged(lagged(told, rng.uniform(0.1, 0.3)), 0.05), told
    white = rng.standard_normal(len(t))
    for tau in (0.25, 0.25, 0.1):
        white = lagged(white, tau)
    return top * white / (1.5 * np.std(white)), np.zeros(len(t))


def lagged(x: Floats, tau: float) -> Floats:
    """First-order lag."""
    from scipy.signal import lfilter

    a = np.exp(-FINE / tau)
    return np.asarray(lfilter([1 - a], [1, -a], x - x[0]) + x[0])


def file_of(unit: Unit, number: int) -> dict[str, Floats]:
    """The columns of one file, SI units."""
    rng = np.random.default_rng([unit.seed, number])
    start, duration = 0.5, unit.duration[number]
    fine = np.arange(0.0, duration + 2 * start, FINE)
    true, told = moved(unit.motion[number], fine, rng)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (true[1:] + true[:-1])) * FINE])
    t: Floats = start + ROW * np.arange(round(duration / ROW), dtype=np.float64)

    def at(values: Floats, when: Floats) -> Floats:
        return np.interp(when, fine, values)

    def mean(when: Floats) -> Floats:
        """Mean rate over a row."""
        return (at(angle, when + 0.5 * ROW) - at(angle, when - 0.5 * ROW)) / ROW

    renewed = t
    if unit.hold:
        phase = rng.integers(0, 3)
        renewed = t - ROW * ((np.arange(len(t)) + phase) % round(unit.hold / ROW))
    noise = unit.noise * rng.standard_normal(len(t) + 3)
    fresh = np.rint((renewed - t[0]) / ROW).astype(int) + 3
    gyro = 0.01 * np.rint((unit.gain * at(true, renewed) + unit.bias + noise[fresh]) / 0.01)
    columns = {"time": t - t[0], "gyro": gyro}
    seen = t - unit.late[number]
    jitter = unit.encoder_noise * rng.standard_normal(len(t))
    if unit.logged == "rate":
        columns["table_rate"] = 0.005 * np.rint((at(true, seen) + jitter) / 0.005)
    else:
        step = 2 * np.pi / 16384
        columns["table_angle"] = step * np.rint((at(angle, seen) + jitter) / step)
    if unit.logged == "both":
        columns["table_rate"] = at(told, t)
    return columns


def written(unit: Unit, folder: Path) -> Path:
    """Files and manifest of a unit."""
    names = []
    for number in range(len(unit.duration)):
        columns = file_of(unit, number)
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
    kept: dict[str, Any] = {"unit": asdict(unit)}
    with tempfile.TemporaryDirectory() as name:
        try:
            found = close(written(unit, Path(name)))
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
        z["hold"] = [(share.value - 1.0) / share.sd, (hold.value - unit.hold) / hold.sd]
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
    holding = [k for k in whole if k["unit"]["hold"]]
    told("hold share and time", lambda k: k["hold"], holding)
    free = [k for k in whole if not k["unit"]["hold"]]
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
            head = f"{unit['seed']}: {unit['logged']} hold {unit['hold']} gain {unit['gain']:.3f} {unit['motion']}"
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
