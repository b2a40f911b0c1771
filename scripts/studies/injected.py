"""What the loop says of an effect of known size in real noise: rests of other people's instruments and a virtual table.

    y = what the instrument read at rest + u + effect,     u = rate of a table that was never there

The rest is a piece of a measured recording; programme of the table, temperature and effect are drawn with a seed and
written with NumPy alone. The strength is the effect's norm beside the scatter of the rest's own means over blocks,
after the declared terms are projected out: so many standard deviations as an analyst who looks at the means would see.

    python injected.py MANIFEST.toml ... --cases 60 --seed 1 --strength 15 [--length 1500] [--out FILE.json]
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
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.identify.findings import Findings

Floats = NDArray[np.float64]
GRAVITY = 9.80665
#: How far a table leans under a gyro that feels gravity.
LEAN = 0.5
DEG = np.pi / 180.0
#: Blocks over which the scatter of the rest is judged [s]: of effects that follow the table, of slow ones, of waves.
TABLE_BLOCK, SLOW_BLOCK = 5.0, 60.0
QUICK_BLOCK = 1.0
SURE = ("effects-found", "nothing-significant")
#: Other names that are right, for what no search tries or what is the same on one recording.
ALSO = {
    "sine_response": {"scale_factor_cubic"},
    "output_bandwidth": {"timing_skew", "bandwidth", "settling_after_turn"},
    "settling": {"timing_skew", "settling_after_turn", "output_bandwidth", "bandwidth"},
    "dead_band": {"lock_in"},
    "lock_in": {"dead_band"},
}
#: What is put in as it is, whatever the strength.
WHOLE = ("sample_hold",)


@dataclass(frozen=True)
class Drivers:
    """What an effect may follow, by rows."""

    t: Floats
    u: Floats
    angle: Floats
    kelvin: Floats
    rest: Floats
    rng: np.random.Generator


Law = Callable[[Drivers], Floats]


def _lagged(x: Floats, dt: float, tau: float) -> Floats:
    rest = np.exp(-dt / tau)
    return np.asarray(lfilter([1.0 - rest], [1.0, -rest], x, zi=[rest * x[0]])[0])


def _warm_up(d: Drivers) -> Floats:
    return np.exp(-d.t / (d.t[-1] * d.rng.uniform(0.08, 0.3)))


def _step(d: Drivers) -> Floats:
    return np.where(d.t > d.t[-1] * d.rng.uniform(0.2, 0.5), 1.0, 0.0)


def _tone(d: Drivers) -> Floats:
    return np.sin(2 * np.pi * d.rng.uniform(0.02, 0.4) * d.t + d.rng.uniform(0, 6.28))


def _thermal_lag(d: Drivers) -> Floats:
    return d.kelvin - _lagged(d.kelvin, d.t[1] - d.t[0], d.t[-1] * d.rng.uniform(0.03, 0.1))


def _anomaly(d: Drivers) -> Floats:
    top = np.max(np.abs(d.u))
    u0 = top * d.rng.uniform(0.3, 0.7)
    return np.sign(d.u) * np.exp(-((np.abs(d.u) - u0) ** 2) / (2 * (0.12 * top) ** 2))


def _lock_in(d: Drivers) -> Floats:
    least = np.min(np.abs(d.u[np.abs(d.u) > 1e-9]))
    limit = 0.5 * least
    with np.errstate(invalid="ignore"):
        held = np.sqrt(np.maximum(d.u**2 - limit**2, 0.0)) * np.sign(d.u)
    return held - d.u


def _scale_warm_up(d: Drivers) -> Floats:
    return d.u * np.exp(-d.t / (d.t[-1] * d.rng.uniform(0.08, 0.3)))


def _ripple(d: Drivers) -> Floats:
    full = 1.05 * np.max(np.abs(d.u))
    return np.sin(int(d.rng.choice([5, 7])) * np.arcsin(d.u / full))


def _sine(d: Drivers) -> Floats:
    phase = d.rng.uniform(0.5, 1.2) / np.max(np.abs(d.u))
    return np.sin(phase * d.u) / phase - d.u


def _play(x: Floats, radius: float) -> Floats:
    """Which way ``x`` was last moved by more than the radius, between -1 and 1."""
    out, now = np.empty_like(x), x[0]
    for i, one in enumerate(x):
        now = min(max(now, one - radius), one + radius)
        out[i] = now
    return (x - out) / radius


def _backlash(d: Drivers) -> Floats:
    return np.gradient(_play(d.angle, 0.002), d.t)


def _hysteresis(d: Drivers) -> Floats:
    return _play(d.u, 0.15 * float(np.max(np.abs(d.u))))


def _dead_band(d: Drivers) -> Floats:
    least = np.min(np.abs(d.u[np.abs(d.u) > 0.01 * np.max(np.abs(d.u))]))
    width = d.rng.uniform(0.5, 0.9) * max(least, 0.05 * float(np.max(np.abs(d.u))))
    return -np.clip(d.u / width, -1.0, 1.0)


def _heat_of_turning(d: Drivers) -> Floats:
    return _lagged(d.u**2, d.t[1] - d.t[0], d.t[-1] * d.rng.uniform(0.03, 0.1))


def _settling(d: Drivers) -> Floats:
    """After each change of the rate something settles, in the sense of the change."""
    dt = d.t[1] - d.t[0]
    return d.u - _lagged(d.u, dt, d.t[-1] * d.rng.uniform(0.004, 0.012))


def _bandwidth(d: Drivers) -> Floats:
    return _lagged(d.u, d.t[1] - d.t[0], d.rng.uniform(0.03, 0.15)) - d.u


def _hold(d: Drivers) -> Floats:
    """An output, noise and all, that is renewed every so many rows; as it is, whatever the strength."""
    rows, read = int(d.rng.integers(4, 9)), d.u + d.rest
    return read[np.arange(read.size) // rows * rows] - read


def _curved(order: int) -> Law:
    def law(d: Drivers) -> Floats:
        x = (d.kelvin - d.kelvin.mean()) / np.ptp(d.kelvin)
        return x + d.rng.choice([-1.0, 1.0]) * 3.0 * np.abs(x) ** order * (np.sign(x) if order == 3 else 1.0)

    return law


def _waves(order: int) -> Law:
    return lambda d: np.cos(order * d.angle + d.rng.uniform(0, 6.28))


#: Names, whether the table turns, the law (in any unit: it is scaled to its strength).
LAWS: dict[str, tuple[bool, Law]] = {
    "bias_drift": (False, lambda d: d.t),
    "bias_warm_up": (False, _warm_up),
    "bias_step": (False, _step),
    "tone": (False, _tone),
    "bias_temperature": (False, lambda d: d.kelvin),
    "bias_temperature_rate": (False, lambda d: np.gradient(d.kelvin, d.t)),
    "bias_thermal_lag": (False, _thermal_lag),
    "scale_factor": (True, lambda d: d.u),
    "scale_factor_asymmetry": (True, lambda d: np.abs(d.u)),
    "scale_factor_cubic": (True, lambda d: d.u**3),
    "scale_factor_anomaly": (True, _anomaly),
    "lock_in": (True, _lock_in),
    "scale_factor_temperature": (True, lambda d: d.u * (d.kelvin - d.kelvin.mean())),
    "scale_factor_drift": (True, lambda d: d.u * d.t),
    "timing_skew": (True, lambda d: np.gradient(d.u, d.t)),
    "angle_locked_rate": (True, _waves(1)),
    "angle_locked_rate:2": (True, _waves(2)),
    "encoder_harmonic": (True, lambda d: d.u * np.cos(d.angle + d.rng.uniform(0, 6.28))),
    "bias_temperature:2": (False, _curved(2)),
    "bias_temperature:3": (False, _curved(3)),
    "scale_factor_warm_up": (True, _scale_warm_up),
    "compensation_ripple": (True, _ripple),
    "sine_response": (True, _sine),
    "encoder_harmonic:2": (True, lambda d: d.u * np.cos(2 * d.angle + d.rng.uniform(0, 6.28))),
    "angle_locked_rate:3": (True, _waves(3)),
    "centripetal_acceleration": (True, lambda d: d.u**2),
    "dead_band": (True, _dead_band),
    "encoder_backlash": (True, _backlash),
    "scale_factor_hysteresis": (True, _hysteresis),
    "self_heating": (True, _heat_of_turning),
    "settling": (True, _settling),
    "output_bandwidth": (True, _bandwidth),
    "sample_hold": (True, _hold),
    "g_sensitivity": (True, lambda d: np.cos(d.angle)),
    "cross_axis": (True, lambda d: d.u),
    "none at rest": (False, lambda d: 0.0 * d.t),
    "none on a table": (True, lambda d: 0.0 * d.t),
}


def programme(t: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Commanded and true rates of a table: dwells at a ladder of rates, both senses, with ramps, in a drawn order."""
    top = rng.choice([20.0, 60.0, 120.0]) * DEG
    rates = top * np.linspace(1, int(rng.integers(4, 8)), int(rng.integers(4, 8))) / 8
    rates = rng.permutation(np.concatenate([rates, -rates]))
    rates = np.tile(rates, 2)
    edges = np.linspace(0.0, t[-1], rates.size + 1)
    wanted = rates[np.clip(np.searchsorted(edges, t, side="right") - 1, 0, rates.size - 1)]
    most, dt = rng.choice([20.0, 60.0]) * DEG, t[1] - t[0]
    out, now = np.empty_like(t), 0.0
    for i, one in enumerate(wanted):
        now += np.clip(one - now, -most * dt, most * dt)
        out[i] = now
    return wanted, out


def heat(t: Floats, rng: np.random.Generator) -> Floats:
    """Temperature of a chamber: ramps and soaks [degC]."""
    knots = np.sort(np.concatenate([[0.0, 1.0], rng.uniform(0.1, 0.9, 4)])) * t[-1]
    levels = 25.0 + np.concatenate([[0.0], rng.uniform(-10, 10, 5)])
    return _lagged(np.interp(t, knots, levels), t[1] - t[0], 0.01 * t[-1])


def scaled(effect: Floats, rest: Floats, declared: list[Floats], rows: int, strength: float) -> Floats:
    """The effect of the wanted strength beside the scatter of the rest's means over blocks of so many rows."""
    n = rest.size // rows
    if not np.any(effect) or n < 8:
        return 0.0 * effect

    def blocks(x: Floats) -> Floats:
        return x[: n * rows].reshape(n, rows).mean(axis=1)

    known = np.column_stack([blocks(d) for d in declared])
    left = blocks(effect) - known @ np.linalg.lstsq(known, blocks(effect), rcond=None)[0]
    noise = blocks(rest) - known @ np.linalg.lstsq(known, blocks(rest), rcond=None)[0]
    return effect * strength * float(np.std(noise)) / float(np.linalg.norm(left))


@dataclass(frozen=True)
class Logger:
    """How the table, the thermometer and the clock were logged."""

    reference: str = "angle"
    late: float = 0.0
    step: float = 0.0
    thermometer_lag: float = 0.0
    kelvin_step: float = 0.0
    jitter: float = 0.0
    lost: float = 0.0
    runs: int = 1

    @staticmethod
    def drawn(rng: np.random.Generator) -> Logger:
        """A logger of a laboratory: each fault is there or not."""
        return Logger(
            reference=str(rng.choice(["angle", "angle", "command", "rate"])),
            late=float(rng.choice([0.0, 0.004, 0.015])),
            step=float(rng.choice([0.0, 0.005, 0.02])) * DEG,
            thermometer_lag=float(rng.choice([0.0, 40.0])),
            kelvin_step=float(rng.choice([0.0, 0.0625, 0.1])),
            jitter=float(rng.choice([0.0, 0.0005])),
            lost=float(rng.choice([0.0, 0.002])),
            runs=int(rng.choice([1, 1, 3])),
        )

    @property
    def told(self) -> str:
        """What is not as it should be, in a few words."""
        named = [f"{self.reference}"]
        named += [f"{1000 * self.late:g} ms late"] if self.late else []
        named += [f"step {self.step / DEG:g} deg"] if self.step else []
        named += [f"thermometer {self.thermometer_lag:g} s behind"] if self.thermometer_lag else []
        named += [f"{self.kelvin_step:g} K"] if self.kelvin_step else []
        named += ["jitter"] if self.jitter else []
        named += ["lost rows"] if self.lost else []
        return ", ".join([*named, f"{self.runs} runs"] if self.runs > 1 else named)


@dataclass(frozen=True)
class Outcome:
    """One case: what was put in, what was said, and the word for it."""

    law: str
    source: str
    word: str
    said: str
    logger: str


def word(law: str, found: Findings, logger: Logger) -> tuple[str, str]:
    """Right, honest, wrong flagged, wrong stated, missed; and what was said."""
    target = found.targets[0]
    truth = law.partition(":")[0]
    names = [a.effect for a in target.added]
    rivals = {r.partition(":")[0] for a in target.added for r in a.confounded_with}
    said = f"{', '.join(names) or 'nothing'} ({target.verdict}){' or ' + ', '.join(sorted(rivals)) if rivals else ''}"
    right = {truth} | ALSO.get(truth, set())
    there = {
        *right,
        "tone",
        *(("timing_skew", "reference_lag") if logger.late or logger.reference == "command" else ()),
    }
    there |= (
        {"bias_thermal_lag", "bias_temperature_rate"}
        if logger.thermometer_lag and ("temp" in truth or "therm" in truth)
        else set()
    )
    false = [n for n in names if n not in there and not n.startswith("spline")]
    sure = target.verdict in SURE
    if law.startswith("none"):
        return ("wrong, stated" if false and sure else "wrong, flagged" if false else "right"), said
    if right & set(names):
        return ("right" if not false else "wrong, stated" if sure else "wrong, flagged"), said
    if right & rivals:
        return "honest", said
    if false:
        return ("wrong, stated" if sure else "wrong, flagged"), said
    return ("missed" if target.verdict == "nothing-significant" else "honest"), said


def rounded(x: Floats, step: float) -> Floats:
    """To multiples of the step, if there is one."""
    return step * np.round(x / step) if step else x


def written(y: Floats, d: Drivers, wanted: Floats, turns: bool, logger: Logger, known: str, folder: Path) -> Path:
    """The files of the runs, as the logger keeps them, and their manifest."""
    t, dt = d.t, d.t[1] - d.t[0]
    rng = d.rng
    kelvin = _lagged(d.kelvin, dt, logger.thermometer_lag) if logger.thermometer_lag else d.kelvin
    kelvin = rounded(kelvin + 0.02 * rng.standard_normal(t.size), logger.kelvin_step)
    angle = rounded(np.interp(t - logger.late, t, d.angle), logger.step)
    rate = np.interp(t - logger.late, t - 0.5 * dt, d.u)
    stamps = np.round(t + logger.jitter * rng.standard_normal(t.size), 6)
    keep = np.ones(t.size, bool)
    for begin in rng.integers(0, t.size, int(logger.lost * t.size / 4)):
        keep[begin : begin + 4] = False
    files, parts = [], np.array_split(np.arange(t.size), logger.runs)
    for k, rows in enumerate(parts):
        rows = rows[keep[rows]]
        files.append(f"run{k + 1}.npz")
        reading = y[rows] + (np.std(y) * 0.1 * rng.standard_normal() if k else 0.0)
        held = {"angle": angle, "rate": rate, "command": wanted}[logger.reference][rows]
        np.savez(folder / files[-1], t=stamps[rows] - stamps[rows[0]], gyro=reading, table=held, kelvin=kelvin[rows])
    channels = ["[channels]", 'time = { column = "t", unit = "s" }']
    channels += ['gyro = { column = "gyro", unit = "rad/s", covers = "interval" }']
    channels += ['temperature = { column = "kelvin", unit = "degC" }']
    if turns:
        name, unit = ("table_angle", "rad") if logger.reference == "angle" else ("table_rate", "rad/s")
        channels += [f'{name} = {{ column = "table", unit = "{unit}" }}']
    text = [f"data = {json.dumps(files)}", *channels, "[model]", 'target = "gyro"', f"declared = {known}"]
    (folder / "case.toml").write_text("\n".join(text) + "\n", encoding="utf-8")
    return folder / "case.toml"


@dataclass(frozen=True)
class Piece:
    """A piece of a measured rest: the gyro's name, the steps' length [s], its readings and times, shape (n,)."""

    name: str
    dt: float
    rest: Floats

    @property
    def t(self) -> Floats:
        """Times of the readings [s], from one step on."""
        return self.dt * np.arange(1.0, self.rest.size + 1.0)


def drawn_piece(recording: Recording, rng: np.random.Generator, length: float) -> Piece:
    """Some ``length`` seconds of one of the recording's gyros."""
    name = str(rng.choice([n for n in recording.channels if n.startswith("gyro")]))
    dt = float(np.median(np.diff(recording.t)))
    rows = min(int(length / dt), recording.t.size)
    begin = int(rng.integers(0, recording.t.size - rows + 1))
    return Piece(name, dt, np.asarray(recording.channels[name].values[begin : begin + rows], dtype=float))


def case(
    law: str, manifest: Path, rng: np.random.Generator, length: float, strength: float, rough: bool, folder: Path
) -> Outcome:
    """Draw a piece of a rest, put the effect in, close the loop."""
    piece = drawn_piece(read_recordings(load_manifest(manifest))[0], rng, length)
    t, rest = piece.t, piece.rest
    turns, effect_of = LAWS[law]
    wanted, u = programme(t, rng) if turns else (0.0 * t, 0.0 * t)
    d = Drivers(t, u, np.cumsum(u) * piece.dt, heat(t, rng), rest, rng)
    declared = [np.ones(t.size), *([u] if turns and law != "scale_factor" else [])]
    effect = effect_of(d)
    block = TABLE_BLOCK if turns else QUICK_BLOCK if law == "tone" else SLOW_BLOCK
    if law not in WHOLE:
        effect = scaled(effect, rest, declared, max(int(block / piece.dt), 1), strength)
    known = '["bias"]' if not turns or law == "scale_factor" else '["bias", "scale_factor"]'
    logger = Logger.drawn(rng) if rough else Logger()
    manifest_of = written(rest + u + effect, d, wanted, turns, logger, known, folder)
    try:
        outcome = word(law, close(manifest_of), logger)
    except InputError as error:
        outcome = "refused", str(error)
    return Outcome(law, f"{manifest.parent.name}/{piece.name}", *outcome, logger.told)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("manifests", nargs="+", type=Path)
    parser.add_argument("--cases", type=int, default=len(LAWS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--strength", type=float, default=15.0)
    parser.add_argument("--length", type=float, default=1500.0, help="length of a piece, seconds")
    parser.add_argument("--laws", help="only these, with commas between")
    parser.add_argument("--out", type=Path, help="JSON of all cases")
    parser.add_argument("--only", type=int, help="this case alone, counted from 0")
    parser.add_argument("--keep", type=Path, help="folder for the files of that case")
    parser.add_argument("--rough", action="store_true", help="loggers with faults, several runs")
    given = parser.parse_args()
    laws = given.laws.split(",") if given.laws else list(LAWS)
    outcomes: list[Outcome] = []
    for k in range(given.cases) if given.only is None else [given.only]:
        rng = np.random.default_rng([given.seed, k])
        law, manifest = laws[k % len(laws)], given.manifests[int(rng.integers(len(given.manifests)))]
        with tempfile.TemporaryDirectory() if given.keep is None else nullcontext(given.keep) as folder:
            outcomes.append(case(law, manifest, rng, given.length, given.strength, given.rough, Path(folder)))
        one = outcomes[-1]
        print(f"{k:3d} {one.word:15s} {one.law:25s} {one.source:28s} {one.said} | {one.logger}", flush=True)
        if given.out:
            given.out.write_text(json.dumps([asdict(o) for o in outcomes], indent=1), encoding="utf-8")
    print(dict(Counter(o.word for o in outcomes)))


if __name__ == "__main__":
    main()
