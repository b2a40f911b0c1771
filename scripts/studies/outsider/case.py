"""A case drawn by its seed: an instrument on a table, how it is logged, what is declared, and at most one fault."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from faults import FAULTS, UNKNOWN, Fault
from gyro import Gyro
from logger import Clock, Reference
from motion import PROGRAMMES, Table

DEG = np.pi / 180
FAMILIES = ("null", "effect", "unknown")
RATES = (10, 20, 25, 50, 100, 100, 125, 200, 250, 400, 500, 1000)
MOST_ROWS = 24_000


@dataclass(frozen=True)
class Case:
    """All that makes a recording; ``fault`` is empty for a null."""

    seed: int
    family: str
    gyro: Gyro
    table: Table
    clock: Clock
    reference: Reference
    duration: float
    tilt: float
    latitude: float
    temperature: str
    declared: tuple[str, ...]
    maker: bool
    averaging: str
    fault: str = ""
    strength: float = 0.0
    shape: float = 0.0

    @property
    def cause(self) -> Fault | None:
        """The fault itself."""
        return {**FAULTS, **UNKNOWN}[self.fault] if self.fault else None

    @property
    def dt(self) -> float:
        """From row to row [s]."""
        return 1 / self.clock.rate

    def rng(self, what: int) -> np.random.Generator:
        """A generator for one ingredient, so that the others stay when one is changed."""
        return np.random.default_rng([self.seed, FAMILIES.index(self.family), what])


def drawn(seed: int, family: str) -> Case:
    """The case of a seed."""
    rng = np.random.default_rng([seed, FAMILIES.index(family), 0])
    grade = str(rng.choice(["MEMS", "MEMS", "FOG", "RLG"]))
    rate = float(rng.choice(RATES))
    duration = float(min(np.exp(rng.uniform(np.log(60), np.log(900))), MOST_ROWS / rate))
    clock = _clock(rate, rng)
    tilted = grade != "MEMS" and rng.random() < 0.35
    case = Case(
        seed=seed,
        family=family,
        gyro=_gyro(grade, rate, rng),
        table=_table(grade, duration, rng),
        clock=clock,
        reference=_reference(rate, rng),
        duration=duration,
        tilt=float(rng.choice([30, 45, 60, 75])) * DEG if tilted else 90 * DEG,
        latitude=float(rng.uniform(-60, 70)) * DEG,
        temperature=str(rng.choice(["none", "room", "warming", "chamber"])),
        declared=("bias", "scale_factor", "earth_rate") if tilted else ("bias", "scale_factor"),
        maker=bool(grade != "MEMS" and rng.random() < 0.4),
        averaging="1 s" if rng.random() < 0.05 else "",
    )
    if not tilted and rng.random() < 0.08:
        case = replace(case, declared=("bias",), gyro=replace(case.gyro, gain=1.0))
    if family == "null":
        return case
    faults = FAULTS if family == "effect" else UNKNOWN
    name = list(faults)[seed % len(faults)]
    case = replace(case, fault=name, strength=float(rng.uniform(8, 30)), shape=float(rng.random()))
    return _fitting(case, faults[name].needs, rng)


def _gyro(grade: str, rate: float, rng: np.random.Generator) -> Gyro:
    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    sign = -1.0 if rng.random() < 0.05 else 1.0
    if grade == "MEMS":
        reading = str(rng.choice(["instant", "instant", "mean"]))
        corner = float(rate * rng.uniform(0.1, 0.45)) if reading == "instant" and rng.random() < 0.7 else 0.0
        return Gyro(
            grade,
            between(0.003, 0.03) * DEG,
            between(2, 40) * DEG / 3600,
            between(0.1, 5) * DEG / 3600 / 60,
            float(rng.normal(0, 0.5)) * DEG,
            sign * (1 + 0.01 * float(rng.standard_normal())),
            reading,
            float(rng.choice([0.0, 1 / 131, 1 / 65.5, 0.01, 0.0175e-3 / DEG, 0.001])) * DEG,
            corner,
            int(rng.integers(1, 3)),
        )
    if grade == "FOG":
        return Gyro(
            grade,
            between(0.002, 0.2) * DEG / 60,
            between(0.01, 2) * DEG / 3600,
            between(0.001, 0.1) * DEG / 3600 / 60,
            float(rng.normal(0, 3)) * DEG / 3600,
            1 + 3e-4 * float(rng.standard_normal()),
            str(rng.choice(["mean", "increment", "instant"])),
            0.0,
            0.0,
            1,
        )
    return Gyro(
        grade,
        between(3e-4, 5e-3) * DEG / 60,
        between(0.001, 0.02) * DEG / 3600,
        between(1e-4, 3e-3) * DEG / 3600 / 60,
        float(rng.normal(0, 0.5)) * DEG / 3600,
        1 + 5e-5 * float(rng.standard_normal()),
        "increment",
        float(rng.choice([0.3, 0.5, 1.0, 1.5, 2.0])) * DEG / 3600,
        0.0,
        1,
    )


def _table(grade: str, duration: float, rng: np.random.Generator) -> Table:
    top = float(rng.choice([20, 50, 100, 200, 300] if grade == "MEMS" else [5, 10, 30, 60, 100])) * DEG
    return Table(
        programme=str(rng.choice(PROGRAMMES)),
        top=top,
        cycles=int(rng.integers(1, 1 + max(2, int(min(duration / 40, 6))))),
        levels=int(rng.integers(2, 7)),
        order=str(rng.choice(["alternating", "up and down", "with rests"])),
        acceleration=float(rng.choice([10, 30, 50, 100, 400])) * DEG,
        bandwidth=float(rng.uniform(2, 25)),
        damping=float(rng.uniform(0.6, 1.1)),
        cogging=float(rng.choice([0.0, 1e-4, 5e-4, 2e-3])) * top,
        teeth=int(rng.choice([6, 8, 11, 24, 36, 48])),
        start=float(rng.uniform(-np.pi, np.pi)),
        rest=float(min(rng.choice([0.0, 2.0, 5.0, 15.0]), 0.1 * duration)),
    )


def _clock(rate: float, rng: np.random.Generator) -> Clock:
    form = str(rng.choice(["seconds", "seconds", "milliseconds", "microseconds", "unix", "rate"]))
    if form == "rate":
        return Clock(rate, 0.0, 0.0, 0.0, 0.0, form, 6)
    fine = max(3, int(np.ceil(np.log10(rate))) + 2)
    return Clock(
        rate,
        wander=float(rng.choice([0.0, 0.0, 0.01, 0.05])),
        jitter=float(rng.choice([0.0, 0.0, 0.002, 0.02])),
        lost=float(rng.choice([0.0, 0.0, 0.001, 0.01])),
        late=float(rng.choice([0.0, 0.0, 0.0005, 0.003])),
        form=form,
        digits=int(rng.choice([fine, 6])),
    )


def _reference(rate: float, rng: np.random.Generator) -> Reference:
    kind = str(
        rng.choice(
            ["angle", "encoder rate", "command", "command angle", "angle + command", "angle + rate"],
            p=[0.34, 0.18, 0.16, 0.04, 0.18, 0.10],
        )
    )
    window = int(rng.choice([1, 1, 2, 5, 10]))
    filtered = rng.random() < 0.5
    said = {"angle": "encoder", "command": "command", "encoder rate": "encoder"}.get(kind, "")
    return Reference(
        kind=kind,
        bits=int(rng.integers(12, 21) if rng.random() < 0.4 else rng.integers(12, 17)),
        wrapped=bool(rng.random() < 0.4),
        noise=float(rng.choice([0.0, 0.1, 0.4])),
        late=float(rng.choice([0.0, 0.0, 0.002, 0.01])),
        window=window,
        filter=float(np.exp(rng.uniform(np.log(0.004), np.log(0.06)))) if filtered else 0.0,
        jumps=bool(rng.random() < 0.5),
        source=said if rng.random() < 0.3 else "",
        covers=bool(not filtered and window == 1 and rng.random() < 0.5),
        unit=str(rng.choice(["deg", "deg", "rad"])),
    )


def _fitting(case: Case, needs: str, rng: np.random.Generator) -> Case:
    """The case changed so that its fault can show."""
    table, reference = case.table, case.reference
    if needs == "warm":
        case = replace(
            case, temperature="chamber", duration=min(max(case.duration, 300.0), 4 * MOST_ROWS / case.clock.rate)
        )
    if needs == "bias alone":
        case = replace(case, declared=("bias",), tilt=90 * DEG, gyro=replace(case.gyro, gain=1.0))
    if needs in ("rates", "both signs"):
        table = replace(
            table, programme=str(rng.choice(["staircase", "ramp", "staircase", "sine"])), levels=max(4, table.levels)
        )
    if needs == "turns":
        table = replace(
            table,
            programme=str(rng.choice(["staircase", "constant", "two_rates", "reversals"])),
            top=max(table.top, 30 * DEG),
        )
        if case.fault == "earth_rate":
            gyro = _gyro("FOG", case.clock.rate, rng)
            case = replace(case, gyro=gyro, tilt=30 * DEG, declared=("bias", "scale_factor"))
        if not reference.kind.startswith("angle"):
            reference = replace(reference, kind="angle")
    if needs == "reverses":
        table = replace(table, programme=str(rng.choice(["reversals", "swing", "sine"])), cycles=max(3, table.cycles))
        if case.fault == "encoder_backlash":
            reference = replace(reference, kind="angle")
    if needs == "rests":
        table = replace(table, programme="staircase", order="with rests")
    return replace(case, table=table, reference=reference)
