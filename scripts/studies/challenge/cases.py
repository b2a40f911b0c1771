"""Writes the cases of the challenge: recordings by the contract, the truth apart from them, and its sha256.

Written with NumPy alone, so that nothing of the program under test is in its cases. A gyro on a turning table,

    y = mean over a row of (u + law(u, a, T, t)) + white noise + random walk,     a = angle that an encoder reads

with bias and scale factor, which are declared. The strength of a law is the norm of what it adds to means over a
second, whitened by the true noise, after bias and scale factor are projected out: so many standard deviations as the
best test that knew all but its size would see.

    python cases.py FOLDER --each 300 --nulls 3000 --seed 1

writes FOLDER/cases/NNNN/run.toml and run.csv, FOLDER/truth.json, FOLDER/truth.sha256. Who sets the challenge publishes
the cases and the sha256, and the truth when the answers are in.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rng = np.random.Generator
DEG = np.pi / 180.0
#: Row [s], rows, parts of a row at which laws are evaluated, rows of a mean in which strength is measured.
DT, ROWS, FINE, BLOCK = 0.2, 3600, 5, 5
T_REF = 25.0
STRENGTHS = (5.0, 7.0, 10.0, 15.0)
#: Strength of each law of a pair, and of what no catalogue has.
OF_PAIR, OF_UNKNOWN = 12.0, 15.0


@dataclass(frozen=True)
class Run:
    """What a law may follow, at the parts of the rows: shape (ROWS * FINE,)."""

    t: Floats
    u: Floats
    angle: Floats
    kelvin: Floats
    rng: Rng


Law = Callable[[Run], Floats]


def _lagged(x: Floats, step: float, tau: float) -> Floats:
    """First-order lag, by its impulse response."""
    n = len(x)
    kernel = np.exp(-np.arange(n) * step / tau) * (1 - np.exp(-step / tau))
    size = 2 * n
    return np.asarray(np.fft.irfft(np.fft.rfft(x - x[0], size) * np.fft.rfft(kernel, size), size)[:n]) + x[0]


def _centred(x: Floats) -> Floats:
    return np.asarray(x - x.mean())


def _tau(run: Run) -> float:
    return float(run.t[-1] * run.rng.uniform(0.08, 0.25))


def _anomaly(run: Run) -> Floats:
    top = np.abs(run.u).max()
    u0 = top * run.rng.uniform(0.3, 0.7)
    return np.sign(run.u) * np.exp(-((np.abs(run.u) - u0) ** 2) / (2 * (0.12 * top) ** 2))


def _wave(order: int) -> Law:
    def law(run: Run) -> Floats:
        return np.cos(order * run.angle + run.rng.uniform(0, 2 * np.pi))

    return law


def _of_encoder(order: int) -> Law:
    """The error of an angle in the rate that it gives: its derivative, with the other sign."""

    def law(run: Run) -> Floats:
        return order * run.u * np.sin(order * run.angle + run.rng.uniform(0, 2 * np.pi))

    return law


#: Laws of the contract, of unit size. All are proportional to their size.
LAWS: dict[str, Law] = {
    "bias_drift": lambda r: r.t / r.t[-1],
    "bias_warm_up": lambda r: np.exp(-r.t / _tau(r)),
    "bias_step": lambda r: np.where(r.t > r.t[-1] * r.rng.uniform(0.15, 0.5), 1.0, 0.0),
    "bias_temperature": lambda r: r.kelvin,
    "bias_temperature_rate": lambda r: np.gradient(r.kelvin, r.t),
    "bias_thermal_lag": lambda r: r.kelvin - _lagged(r.kelvin, r.t[1] - r.t[0], _tau(r)),
    "scale_factor_drift": lambda r: r.u * r.t,
    "scale_factor_warm_up": lambda r: r.u * np.exp(-r.t / _tau(r)),
    "scale_factor_temperature": lambda r: r.u * r.kelvin,
    "scale_factor_asymmetry": lambda r: np.abs(r.u),
    "scale_factor_cubic": lambda r: r.u**3,
    "scale_factor_anomaly": _anomaly,
    "encoder_harmonic:1": _of_encoder(1),
    "encoder_harmonic:2": _of_encoder(2),
    "angle_locked_rate:1": _wave(1),
    "angle_locked_rate:2": _wave(2),
    "timing_skew": lambda r: -np.gradient(r.u, r.t),
    "tone": lambda r: np.sin(2 * np.pi * r.rng.uniform(0.02, 0.3) * r.t + r.rng.uniform(0, 2 * np.pi)),
}

#: Laws that no name of the contract is; centred, so that they are no known law for the most part.
UNKNOWN: dict[str, Law] = {
    "|u| * (T - mean T)": lambda r: np.abs(r.u) * _centred(r.kelvin),
    "u * dT/dt": lambda r: r.u * np.gradient(r.kelvin, r.t),
    "u * (T - mean T)^2": lambda r: r.u * _centred(_centred(r.kelvin) ** 2),
    "|u| * (t - mean t)": lambda r: np.abs(r.u) * _centred(r.t),
    "u^3 * (T - mean T)": lambda r: r.u**3 * _centred(r.kelvin),
    "(T - mean T) * cos(a)": lambda r: _centred(r.kelvin) * np.cos(r.angle + r.rng.uniform(0, 2 * np.pi)),
    "(t - mean t) * cos(a)": lambda r: _centred(r.t) * np.cos(r.angle + r.rng.uniform(0, 2 * np.pi)),
    "chirp": lambda r: np.sin(2 * np.pi * (0.01 * r.t + 0.04 * r.t**2 / r.t[-1])),
    "three level shifts": lambda r: np.searchsorted([0.21, 0.33, 0.52], r.t / r.t[-1]) % 2.0,
    "u lagged by a minute": lambda r: _lagged(r.u, r.t[1] - r.t[0], 0.1 * r.t[-1]),
}


def motion(rng: Rng) -> Run:
    """Rates held one after another with ramps between, both ways; a temperature that settles and swings."""
    step = DT / FINE
    t = np.asarray((np.arange(ROWS * FINE) + 0.5) * step, np.float64)
    top = rng.uniform(20.0, 60.0)
    levels: list[float] = []
    while len(levels) * 30.0 < t[-1]:
        ladder = top * np.array([0.1, 0.25, 0.5, 0.75, 1.0])
        levels += list(rng.permutation(np.concatenate([ladder, -ladder, [0.0]])))
    wanted = np.repeat(levels, round(30.0 / step))[: len(t)]
    ramp = round(2.0 / step)
    u = np.convolve(np.pad(wanted, (ramp // 2, ramp - ramp // 2 - 1), mode="edge"), np.ones(ramp) / ramp, "valid") * DEG
    rise, period = rng.uniform(2.0, 8.0), t[-1] * rng.uniform(0.3, 0.6)
    kelvin = rise * (1 - np.exp(-t / (0.3 * t[-1]))) + 0.3 * rise * np.sin(2 * np.pi * t / period)
    angle = np.cumsum(u) * step - 0.5 * u * step
    return Run(t, u, angle, kelvin + rng.uniform(-3, 3), rng)


def by_rows(fine: Floats) -> Floats:
    """Means over rows."""
    return np.asarray(fine.reshape(ROWS, FINE).mean(axis=1))


@dataclass(frozen=True)
class Noise:
    """Angle random walk N [rad/sqrt(s)] and rate random walk K [rad/s/sqrt(s)]."""

    white: float
    walk: float

    def of_rows(self, rng: Rng) -> Floats:
        """One draw, shape (ROWS,)."""
        white = self.white / np.sqrt(DT) * rng.standard_normal(ROWS)
        return np.asarray(white + self.walk * np.sqrt(DT) * np.cumsum(rng.standard_normal(ROWS)))

    def whitened(self, rows: Floats) -> Floats:
        """Means over blocks in units in which the noise is white, shape (blocks, k)."""
        blocks = rows.reshape(ROWS // BLOCK, BLOCK, -1).mean(axis=1)
        n, length = len(blocks), BLOCK * DT
        index = np.arange(1, n + 1)
        # The walk from the start of the run: its covariance between two means, but for what it does within one.
        cov = self.walk**2 * length * np.minimum.outer(index, index) + self.white**2 / length * np.eye(n)
        return np.asarray(np.linalg.solve(np.linalg.cholesky(cov), blocks))


def strength(noise: Noise, law: Floats, u: Floats) -> float:
    """Of a law as means over rows."""
    white = noise.whitened(np.column_stack([law, np.ones(ROWS), u]))
    law, declared = white[:, 0], white[:, 1:]
    return float(np.linalg.norm(law - declared @ np.linalg.lstsq(declared, law, rcond=None)[0]))


MANIFEST = """\
title = "Challenge, case {name}"
data = "run.csv"

[channels]
time = {{ column = "time_s", unit = "s" }}
gyro = {{ column = "gyro_deg_s", unit = "deg/s", covers = "interval" }}
table_angle = {{ column = "angle_deg", unit = "deg", source = "encoder" }}
temperature = {{ column = "temp_degC", unit = "degC" }}

[model]
target = "gyro"
declared = ["bias", "scale_factor"]
reference_temperature = "25 degC"
{noise}"""


def write_case(folder: Path, name: str, wanted: list[tuple[str, Law, float]], rng: Rng) -> dict[str, object]:
    """Write a case; its truth."""
    run = motion(rng)
    noise = Noise(0.02 * DEG / 60 * 10 ** rng.uniform(0, 1), DEG / 3600 / 60 * 10 ** rng.uniform(-0.5, 0.7))
    u = by_rows(run.u)
    added, angle = np.zeros(ROWS), np.append(0.0, (np.cumsum(run.u) * DT / FINE)[FINE - 1 :: FINE])
    sizes = []
    for key, law, strong in wanted:
        fine = law(run)
        size = float(rng.choice([-1.0, 1.0])) * strong / strength(noise, by_rows(fine), u)
        sizes.append(size)
        if key.startswith("encoder_harmonic"):
            # The encoder reads too much; the gyro knows nothing of it. The law is minus the rate of that error.
            error = -np.append(0.0, np.cumsum(by_rows(size * fine)) * DT)
            angle = angle + error
        else:
            added = added + by_rows(size * fine)
    gyro = u * (1 + rng.normal(0, 3e-4)) + rng.normal(0, 5.0) * DEG / 3600 + added + noise.of_rows(rng)
    declares = rng.random() < 0.5
    said = ""
    if declares:
        walk = noise.walk * np.sqrt(3600) * 3600 / DEG
        said = f'\n[noise]\nangle_random_walk = "{noise.white * 60 / DEG:.6g} deg/sqrt(h)"\n'
        said += f'rate_random_walk = "{walk:.6g} deg/h/sqrt(h)"\n'
    folder.mkdir(parents=True, exist_ok=True)
    # An increment covers the time that ends at its row; angle and temperature are values at that time.
    time = np.arange(1, ROWS + 1) * DT
    kelvin = np.interp(time, run.t, run.kelvin)
    table = np.column_stack([time, gyro / DEG, angle[1:] / DEG, kelvin + T_REF])
    np.savetxt(
        folder / "run.csv", table, delimiter=",", header="time_s,gyro_deg_s,angle_deg,temp_degC", comments="",
        fmt=("%.1f", "%.10f", "%.9f", "%.5f"),
    )  # fmt: skip
    (folder / "run.toml").write_text(MANIFEST.format(name=name, noise=said))
    return {"effects": [key for key, *_ in wanted], "sizes": sizes, "noise_declared": declares}


def plan(each: int, nulls: int) -> list[str]:
    """Kinds of the cases, mixed so that every beginning of the list has them in proportion."""
    counts = {f"single {s:g}": each for s in STRENGTHS} | {"pair": each, "unknown": each, "null": nulls}
    places = [((k + 0.5) / n, kind) for kind, n in counts.items() for k in range(n)]
    return [kind for _, kind in sorted(places)]


def drawn(kind: str, turn: int, rng: Rng) -> list[tuple[str, Law, float]]:
    """Laws of a case: each name has its turn."""
    names, unknown = list(LAWS), list(UNKNOWN)
    if kind == "null":
        return []
    if kind == "unknown":
        key = unknown[turn % len(unknown)]
        return [(key, UNKNOWN[key], OF_UNKNOWN)]
    if kind == "pair":
        pair = rng.choice(len(names), 2, replace=False)
        return [(names[i], LAWS[names[i]], OF_PAIR) for i in pair]
    key = names[turn % len(names)]
    return [(key, LAWS[key], float(kind.split()[1]))]


def write(folder: Path, each: int, nulls: int, seed: int) -> str:
    """Write all cases and the truth; its sha256."""
    turns: dict[str, int] = {}
    truth: dict[str, object] = {}
    for number, kind in enumerate(plan(each, nulls)):
        rng = np.random.default_rng([seed, number])
        turn = turns[kind] = turns.get(kind, -1) + 1
        name = f"{number:04d}"
        case = write_case(folder / "cases" / name, name, drawn(kind, turn, rng), rng)
        truth[name] = {"kind": kind, **case}
    text = json.dumps({"seed": seed, "cases": truth}, indent=1) + "\n"
    (folder / "truth.json").write_text(text)
    digest = hashlib.sha256(text.encode()).hexdigest()
    (folder / "truth.sha256").write_text(f"{digest}  truth.json\n")
    return digest


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--each", type=int, default=300)
    parser.add_argument("--nulls", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print(write(given.folder, given.each, given.nulls, given.seed))


if __name__ == "__main__":
    main()
