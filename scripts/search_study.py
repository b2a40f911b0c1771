"""How often the search of ``insenv close-loop`` is right, and how often wrong: a Monte Carlo on simulated recordings.

Recordings that the declared model explains completely count false discoveries. Recordings with one effect that is
not declared count how often it is found and rightly named. Its strength is the norm of its whitened means beside
the declared model, with the true noise, on the rows that are fitted:

    snr^2 = min_b || W (a - X b) ||^2,        W W' = inverse covariance of the noise.

Writes a page of Markdown.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

# Each process has a core of its own; threads of theirs would wait for each other.
for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from pages import stamped
from scipy.fft import dct
from studies.search_study.page import Case, Found, Job, page
from tqdm import tqdm

from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Recording
from insenv.data.manifest import Manifest, Model
from insenv.data.split import HELD_OUT_SHARE, split
from insenv.effects.base import NoiseEffect
from insenv.effects.catalogue import by_key
from insenv.effects.noise import AngleRandomWalk, BiasInstability, RateRandomWalk
from insenv.identify.assemble import findings
from insenv.identify.loop import trace

PROCESSES = 2
ALPHA = 0.01
#: Samples, sampling period and the length of the means in which strength is defined [s].
N, DT, MEAN = 36_000, 0.1, 1.0
DEG_PER_HOUR = np.pi / 180 / 3600
PROFILES = ("constant", "staircase", "reversal", "sine", "rest")
#: Coefficients are drawn evenly in their logarithm from these ranges, in deg/h, s and their roots.
NOISE: tuple[tuple[NoiseEffect, float, float], ...] = (
    (AngleRandomWalk(), 0.3, 1.2),
    (BiasInstability(), 0.02, 0.3),
    (RateRandomWalk(), 0.0005, 0.015),
)
_TAU = (200.0, 900.0)
_TONE = (0.02, 0.4)
_ANOMALY = ((np.deg2rad(10.0), np.deg2rad(18.0)), (np.deg2rad(1.5), np.deg2rad(1.5)))

CASES = (
    Case("bias_drift", "constant"),
    Case("bias_warm_up", "reversal", (_TAU,)),
    Case("bias_step", "reversal", ((400.0, 1800.0),)),
    Case("bias_temperature:1", "reversal"),
    Case("bias_temperature_rate", "reversal"),
    Case("bias_thermal_lag", "rest", (_TAU,)),
    Case("scale_factor_drift", "reversal"),
    Case("scale_factor_warm_up", "staircase", (_TAU,)),
    Case("scale_factor_temperature", "staircase"),
    Case("scale_factor_asymmetry", "staircase"),
    Case("scale_factor_cubic", "sine"),
    Case("scale_factor_cubic", "staircase"),
    Case("scale_factor_anomaly", "sine", _ANOMALY),
    Case("lock_in", "staircase"),
    Case("encoder_harmonic:1", "constant"),
    Case("encoder_harmonic:1", "reversal"),
    Case("encoder_harmonic:2", "staircase"),
    Case("angle_locked_rate:1", "reversal"),
    Case("angle_locked_rate:2", "staircase"),
    Case("timing_skew", "sine"),
    Case("tone", "constant", (_TONE,)),
    Case("tone", "rest", (_TONE,)),
)


def table_rate(profile: str, rng: np.random.Generator) -> Floats:
    """Mean rate of the table in each interval [rad/s], shape (N,); steps take a second."""
    t = np.arange(N) * DT
    if profile == "constant":
        rate = np.full(N, rng.uniform(5, 40))
    elif profile == "staircase":
        steps = np.array([10.0, 15, 20, 30, 40, 60]) * rng.uniform(0.5, 1.5)
        steps = rng.permutation(np.concatenate([steps, -steps]))
        rate = np.tile(np.repeat(steps, N // 24), 2)
    elif profile == "reversal":
        rate = rng.uniform(8, 30) * np.where((t // 150) % 2 == 0, 1.0, -1.0)
    elif profile == "sine":
        rate = rng.uniform(20, 60) * np.sin(2 * np.pi * t / rng.uniform(60, 200))
    else:
        rate = np.zeros(N)
    ramp = round(1 / DT)
    eased = np.convolve(np.concatenate([np.full(ramp - 1, rate[0]), rate]), np.full(ramp, 1 / ramp), mode="valid")
    return np.deg2rad(eased)


def exposure(profile: str, rng: np.random.Generator) -> Motion:
    """A gyro along the table's axis, warming up in a room that is cooled and heated."""
    t = np.arange(N + 1, dtype=float) * DT
    rate = table_rate(profile, rng)
    rise, swing, phase = rng.uniform(2, 10), rng.uniform(1, 4), rng.uniform(0, 6)
    warm_up, period = rng.uniform(400, 2000), rng.uniform(1500, 4000)
    return Motion(
        t=t,
        rate=rate,
        angle=None if profile == "rest" else np.concatenate([[0.0], np.cumsum(rate * DT)]),
        rate_edges=np.concatenate([rate[:1], 0.5 * (rate[1:] + rate[:-1]), rate[-1:]]),
        temperature=298.15 + rise * (1 - np.exp(-t / warm_up)) + swing * np.sin(2 * np.pi * t / period + phase),
    )


def noise(coefficients: Floats, rng: np.random.Generator) -> Floats:
    """Sum of the noise terms, each in its stationary state, shape (N,)."""
    total = np.zeros(N)
    for (effect, _, _), c in zip(NOISE, coefficients, strict=True):
        state = effect.start(rng.standard_normal(effect.draws_at_start))
        total += effect.drive(np.array([c]), DT, state, rng.standard_normal((1, N)))[0]
    return total


def strength(added: Floats, rate: Floats, coefficients: Floats) -> float:
    """Signal-to-noise ratio of ``added`` beside bias and scale factor, on the fitted rows."""
    per_bin = round(MEAN / DT)
    bins = int((1 - HELD_OUT_SHARE) * N) // per_bin
    lam = 4 * np.sin(0.5 * np.pi * np.arange(1, bins) / bins) ** 2
    root = np.sqrt(sum(c**2 * e.spectrum(lam, MEAN) for (e, _, _), c in zip(NOISE, coefficients, strict=True)))

    def whitened(values: Floats) -> Floats:
        """All coefficients but the first, which the bias takes."""
        means = values[: bins * per_bin].reshape(bins, per_bin).mean(axis=1)
        return np.asarray(dct(means, type=2, norm="ortho")[1:] / root)

    a, x = whitened(added), whitened(rate)[:, None]
    return float(np.linalg.norm(a - x @ np.linalg.lstsq(x, a, rcond=None)[0]))


def undeclared(case: Case, snr: float, motion: Motion, coefficients: Floats, rng: np.random.Generator) -> Floats:
    """What the effect of ``case`` adds at strength ``snr``, shape (N,)."""
    effect = by_key(case.key)
    size = [1e-3 * p.sd * rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 1) for p in effect.linear]
    size = [abs(c) if p.low >= 0 else c for c, p in zip(size, effect.linear, strict=True)]
    theta = np.array([*size, *(rng.uniform(low, high) for low, high in case.shapes)])

    def added() -> Floats:
        return effect.apply(motion.rate, motion, theta, effect.begin(motion, theta))[0]

    for _ in range(3):  # lock-in is not quite proportional to its parameter
        theta[: len(size)] *= snr / strength(added(), motion.rate, coefficients)
    return added()


def recording(job: Job) -> Recording:
    rng = np.random.default_rng(job.seed)
    motion = exposure(job.profile, rng)
    coefficients = DEG_PER_HOUR * np.exp([rng.uniform(np.log(low), np.log(high)) for _, low, high in NOISE])
    y = motion.rate * (1 + 3e-4 * rng.standard_normal()) + 5 * DEG_PER_HOUR * rng.standard_normal()
    y += noise(coefficients, rng)
    assert motion.temperature is not None
    channels = {"temperature": Channel(motion.temperature[1:] + 0.02 * rng.standard_normal(N), "K")}
    if motion.angle is not None:
        channels["table_angle"] = Channel(motion.angle[1:], "rad")
        channels["table_rate"] = Channel(motion.rate, "rad/s", "interval")
    if job.case is not None:
        y += undeclared(job.case, job.snr, motion, coefficients, rng)
    return Recording(motion.t[1:], {"gyro": Channel(y, "rad/s", "interval"), **channels})


def closed(job: Job) -> Found:
    """Simulate, close the loop, keep what the report would say."""
    declared = ("bias",) if job.profile == "rest" else ("bias", "scale_factor")
    model = Model(("gyro",), declared)
    manifest = Manifest(Path("study.toml"), "study", (), {}, model, noise={})
    recordings = (recording(job),)
    outcome = trace(manifest, recordings, split(manifest, recordings), alpha=ALPHA, seed=job.seed[-1])
    target = findings(manifest, recordings, outcome).targets[0]
    names = tuple(a.effect if a.order is None else f"{a.effect}:{a.order}" for a in target.added)
    first = target.added[0] if target.added else None
    ratio = target.held_out.after / target.held_out.before
    return Found(job, names, first.confounded_with if first else (), first.p_value if first else 1.0, ratio)


def jobs(nulls: int, seeds: int, snrs: Sequence[float], seed: int) -> Iterator[Job]:
    for number in range(nulls):
        yield Job(PROFILES[number % len(PROFILES)], (seed, 0, number))
    for snr in snrs:
        for index, case in enumerate(CASES):
            for number in range(seeds):  # the same recordings at each strength
                yield Job(case.profile, (seed, 1, index, number), case, snr)


def facts(options: argparse.Namespace) -> dict[str, object]:
    """The set-up, as the page's template names it."""
    snrs = " ".join(f"{snr:g}" for snr in options.snr)
    asked = f"--nulls {options.nulls} --seeds {options.seeds} --snr {snrs} --seed {options.seed}"
    return {
        "command": f"python scripts/search_study.py {asked}",
        "n": f"{N:,}".replace(",", " "),
        "rate": 1 / DT,
        "hours": N * DT / 3600,
        "held": 100 * HELD_OUT_SHARE,
        "mean": MEAN,
        "profiles": ", ".join(PROFILES),
        "cases": len(CASES),
        "seeds": options.seeds,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--nulls", type=_count, default=300, help="recordings without an undeclared effect")
    parser.add_argument("--seeds", type=_count, default=4, help="recordings of each case at each strength")
    parser.add_argument("--snr", type=float, nargs="+", default=[10.0, 20.0], help="strengths of the effect")
    parser.add_argument("--seed", type=int, default=0, help="of everything that is drawn")
    parser.add_argument("--out", type=Path, default=Path("docs/results/search_study.md"), metavar="PATH.md")
    options = parser.parse_args()
    work = list(jobs(options.nulls, options.seeds, options.snr, options.seed))
    with ProcessPoolExecutor(PROCESSES) as pool:
        found = list(tqdm(pool.map(closed, work), total=len(work), unit="recording"))
    text = page(found, options.snr, ALPHA, **facts(options))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    beside = options.out.with_name(f".{options.out.name}.part")
    beside.write_text(stamped(text, Path(__file__)), encoding="utf-8")
    os.replace(beside, options.out)
    print(text)


def _count(text: str) -> int:
    if int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} given, wanted one or more")
    return int(text)


if __name__ == "__main__":
    main()
