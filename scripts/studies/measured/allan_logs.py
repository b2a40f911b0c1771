"""Bias instability of measured rests by the fit of the Allan variance, against the floor of the deviation.

The floor divided by 0.664 is the most that B can be, for white noise and random walk are in it. So a fit is not asked
for the floor's figure but for the floor: a fitted noise is simulated, and the floor of its records must be the one that
was observed, within 25 % of their median or among 95 % of them (a floor at a tenth of the record and later is the
least of few and scattered averages). Where flicker makes most of the floor, B is compared with the floor's figure.

    python allan_logs.py MANIFEST.toml ... [--records 60] [--seed 1]
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

import argparse
from math import exp, log, pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from estimators.common.allan_terms import TERMS, FittedTerms, fitted, floor
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.effects.base import NoiseEffect
from insenv.effects.catalogue import by_key

Floats = NDArray[np.float64]
#: Factors and powers of the averaging time of the terms in the Allan variance.
FACTORS, POWERS = np.array([3.0, 1.0, 2 * log(2) / pi, 1 / 3, 0.5]), np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
#: Rows of a simulated record at most; share by which floors may differ; share of flicker that makes most of a floor.
ROWS, CLOSE, MOST = 16384, 0.25, 0.6


def octaves(rate: Floats, dt: float) -> tuple[Floats, Floats, Floats]:
    """Averaging times, Allan variance of neighbouring means, degrees of freedom, shapes (k,)."""
    rows = []
    while len(rate) >= 3:
        steps = np.diff(rate)
        rows.append((dt, float(steps @ steps) / (2 * len(steps)), max(2 * len(steps) / 3, 1.0)))
        rate = rate[: len(rate) // 2 * 2].reshape(-1, 2).mean(axis=1)
        dt *= 2
    taus, variance, edf = np.array([row for row in rows if row[1] > 0]).T
    return taus, variance, edf


def simulated(found: FittedTerms, n: int, dt: float, rng: np.random.Generator) -> Floats:
    """A record of the fitted noise: means over ``dt``, shape (n,)."""
    out = np.zeros(n)
    for name in TERMS[:4]:
        effect = by_key(name)
        assert isinstance(effect, NoiseEffect)
        if found.coefficients[name].value > 0:
            state = effect.start(rng.standard_normal(effect.draws_at_start))
            size = np.array([found.coefficients[name].value])
            out += effect.drive(size, dt, state, rng.standard_normal((effect.draws, n)))[0]
    out += found.coefficients["rate_ramp"].value * dt * np.arange(n)
    for other in found.others:
        if other.kind == "sinusoid":  # its mean over dt
            inside = np.sinc(other.shape * dt) * np.sqrt(2 * other.square)
            out += inside * np.sin(2 * pi * other.shape * dt * np.arange(n) + rng.uniform(0, 2 * pi))
        else:
            keep, sd = exp(-dt / other.shape), np.sqrt(other.square * other.shape / 2)
            start = sd * rng.standard_normal()
            draws = sd * np.sqrt(1 - keep**2) * rng.standard_normal(n)
            out += lfilter([1.0], [1.0, -keep], draws, zi=[keep * start])[0]
    return out


def judged(rate: Floats, dt: float, records: int, rng: np.random.Generator) -> tuple[str, bool | None, bool | None]:
    """What is to be said of a channel, whether its floor is met, and whether B is where flicker makes it."""
    taus, variance, edf = octaves(rate, dt)
    least, at = floor(taus, variance, edf)
    found = fitted(taus, variance, edf)
    if not np.isfinite(least.value):
        return f"no floor (p = {found.p_value:.2g})", None, None
    said = f"floor / 0.664 {least.value:.3g} +- {least.sd:.1g} at {at:.3g} s"
    if not found.coefficients or np.isnan(found.coefficients[TERMS[0]].value):
        return f"{said}: no model fits (p = {found.p_value:.2g})", False, None
    times = 2 ** max(0, int(np.ceil(np.log2(len(rate) / ROWS))))
    floors = []
    for _ in range(records):
        one = octaves(simulated(found, len(rate) // times, times * dt, rng), times * dt)
        floors.append(floor(*one)[0].value)
    seen = np.array([x for x in floors if np.isfinite(x)])
    if len(seen) < records / 10:
        return f"{said}: simulated records have none", False, None
    low, middle, high = np.quantile(seen, [0.025, 0.5, 0.975])
    met = abs(least.value / middle - 1) < CLOSE or low <= least.value <= high
    b = found.coefficients["bias_instability"]
    flicker = FACTORS[2] * b.value**2
    powers = at**POWERS * np.array([found.coefficients[t].value ** 2 for t in TERMS])
    whole = float(FACTORS @ powers) + sum(float(o.variance(np.array([at]))[0]) for o in found.others)
    share = flicker / (whole or 1.0)
    others = ", ".join(f"{o.kind} {o.shape:.3g}" for o in found.others)
    said += (
        f"; simulated {middle:.3g} ({low:.3g} to {high:.3g}); B {b.value:.3g} +- {b.sd:.1g}, "
        f"{share:.0%} of the floor; p = {found.p_value:.2g} {others}"
    )
    return said, bool(met), abs(b.value / least.value - 1) < CLOSE if share > MOST else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("manifests", nargs="+", type=Path)
    parser.add_argument("--records", type=int, default=60, help="simulated records of each channel")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    floors: list[bool] = []
    of_flicker: list[bool] = []
    logs = set()
    for manifest in given.manifests:
        read = load_manifest(manifest)
        recording = read_recordings(read)[0]
        dt = float(np.median(np.diff(recording.t)))
        for target in (t for t in read.model.targets if t in recording.channels):
            rate = np.asarray(recording.channels[target].values, np.float64)
            said, met, flicker = judged(rate, dt, given.records, rng)
            word = {None: "", True: "met", False: "NOT MET"}[met]
            print(f"{manifest.parent.name}/{manifest.stem} {target}: {said} {word}", flush=True)
            if met is not None:
                floors.append(met)
                logs.add(manifest)
            if flicker is not None:
                of_flicker.append(flicker)
    print(f"{len(logs)} logs with {len(floors)} floors: met in {sum(floors)}")
    print(f"flicker makes more than {MOST:.0%} of {len(of_flicker)}: B within {CLOSE:.0%} in {sum(of_flicker)}")


if __name__ == "__main__":
    main()
