"""From a plan and what is wrong to the columns of a file, and to the noise that is really in them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from blind import climate, noise
from blind.curves import held
from blind.files import UNITS, Column, decimals, rounded_up
from blind.noise import Noise
from blind.parts import Part
from blind.plan import Plan
from blind.strength import Ruler
from blind.table import Floats
from blind.world import EARTH

#: Of the mounting: where the gyro's axis points when the table is at zero [rad].
AZIMUTH = 0.7
HELD_OUT = 0.4
#: Spread of a counter's or an encoder's reading beside its rounding, in units of its step: it wipes out the pattern
#: that rounding alone would leave at a steady rate (a laser gyro's dither, an interpolator's noise).
JITTER = {"pulse": 0.6, "encoder": 0.8}


def true_noise(plan: Plan) -> Noise:
    """The plan's noise with what reading the angles adds."""
    w = plan.world
    parts = [(JITTER["pulse"] ** 2 + 1 / 12) * plan.pulse**2 if plan.output == "pulses" else 0.0]
    if plan.reference in ("angle", "both"):
        parts.append((JITTER["encoder"] ** 2 + 1 / 12) * (plan.encoder_step * np.sin(w.tilt)) ** 2)
    angle, n = float(np.sqrt(sum(parts))), plan.noise.n
    # A count that is lost leaves the errors of the two angles about it for good.
    n = float(np.sqrt(n**2 + 2 * angle**2 * plan.scattered / w.dt))
    return replace(plan.noise, n=n, angle=angle, held=plan.hold * w.dt if plan.hold > 1 else 0.0)


def kept(plan: Plan) -> NDArray[np.bool_]:
    """Rows that the logger wrote, shape (n,); the first and the last of a run are among them."""
    w = plan.world
    share = (w.rows - w.dt) / (w.duration - w.dt)
    there = np.random.default_rng(plan.words).uniform(size=w.n) >= plan.scattered
    for first, last in plan.gaps:
        there &= (share < first) | (share > last)
    return there | (share <= 0) | (share >= 1)


def fitted_rows(plan: Plan) -> list[NDArray[np.int64]]:
    """Of each run, rows of the first 60 % of the time: what is fitted where a manifest says nothing else."""
    w = plan.world
    t = w.rows
    fitted = (kept(plan) & (t - w.dt <= (1 - HELD_OUT) * (w.duration - w.dt))).reshape(w.runs, -1)
    return [np.flatnonzero(row) + index * w.each for index, row in enumerate(fitted)]


def declared_columns(plan: Plan, declared: tuple[str, ...]) -> Floats:
    """Regressors of the declared model beside the bias, shape (n, k)."""
    w = plan.world
    columns = [w.mean(w.u)] if "scale_factor" in declared else []
    if "earth_rate" in declared and w.tilt < 1.5:
        columns += [w.mean(np.cos(w.a)), w.mean(np.sin(w.a))]
    return np.column_stack(columns) if columns else np.zeros((w.n, 0))


def ruler(plan: Plan, declared: tuple[str, ...]) -> Ruler:
    return Ruler(true_noise(plan), plan.world.dt, fitted_rows(plan), declared_columns(plan, declared))


def scaled(part: Part, demanded: float, measure: Ruler, *beside: Floats) -> float:
    """Size at which ``part`` has the demanded strength (a threshold is not proportional to its size)."""
    size = part.size
    for _ in range(5):
        now = measure.beside(part.addition(size), *beside)
        size *= demanded / max(now, 1e-30)
    return float(size)


@dataclass(frozen=True)
class Recorded:
    """Columns for the files, of all runs and rows; ``noise`` is measured minus reference minus all that is systematic.

    Both arrays have shape (n,): rows that the logger lost are among them.
    """

    columns: list[Column]
    noise: Floats
    systematic: Floats


def clean_rate(plan: Plan) -> Floats:
    """What a gyro without the undeclared would say, noise apart, shape (n,) [rad/s]."""
    w = plan.world
    bias = plan.bias + np.repeat(plan.biases, w.each)
    if not w.turning:
        return bias
    level = w.horizontal_earth(AZIMUTH) if w.tilt < 1.5 and plan.level_earth else 0.0
    upright = EARTH * np.sin(w.latitude) * np.sin(w.tilt)
    # The scale factor acts on the exact mean rate: a quadrature of it would miss the corners of a ramp.
    seen = w.turned * np.sin(w.tilt) + upright
    return seen + level + plan.scale_error * seen + bias


def record(plan: Plan, parts: list[tuple[Part, float]], rng: np.random.Generator) -> Recorded:
    """The recording with ``parts`` at their sizes."""
    w, hold = plan.world, plan.hold
    clean = clean_rate(plan)
    inside = [part.addition(c) for part, c in parts if part.reading is None and part.key != "sample_hold"]
    outside = [part.reading(c) for part, c in parts if part.reading is not None]
    shown = clean + np.sum(inside, axis=0) if inside else clean
    noisy = shown + np.concatenate([noise.rates(plan.noise, w.each, w.dt, rng) for _ in range(w.runs)])
    column, read = gyro_column(plan, held(noisy, hold), rng)
    columns = [column]
    error = np.zeros(w.n)
    if plan.reference in ("angle", "both"):
        true = w.trajectory.angle(w.rows)
        step = plan.encoder_step
        jitter = JITTER["encoder"] * step * rng.standard_normal(w.n)
        angle = np.round((true + sum(outside) + jitter) / step) * step
        error = w.encoder_shift(angle - true - sum(outside))
        columns.append(angle_column(plan, angle))
    if plan.reference in ("rate", "both"):
        columns.append(rate_column(plan))
    if plan.thermometer:
        columns.append(temperature_column(plan, rng))
    columns += plan.extra
    systematic = held(shown, hold) - clean + sum(w.encoder_shift(e) for e in outside)
    return Recorded(columns, read - held(shown, hold) + error, systematic)


def _words(plan: Plan, what: str) -> np.random.Generator:
    """Draws of how a channel is written: the same for each run of a plan."""
    return np.random.default_rng([plan.words, *what.encode()])


def gyro_column(plan: Plan, rates: Floats, rng: np.random.Generator) -> tuple[Column, Floats]:
    """The gyro's column, and the rates that it says [rad/s]."""
    dt = plan.world.dt
    heading = str(_words(plan, "heading").choice(["gyro", "omega", "rlg_out", "Gyro Z", "w_z", "ch3"]))
    if plan.output == "pulses":
        angle = np.cumsum(rates) * dt + JITTER["pulse"] * plan.pulse * rng.standard_normal(len(rates))
        counts = np.diff(np.concatenate([[0.0], np.round(angle / plan.pulse)]))
        weight = f"{np.rad2deg(plan.pulse) * 3600:.8g} arcsec"
        return Column(plan.target, heading, counts, 0, weight, {"quantity": '"increment"'}), counts * plan.pulse / dt
    words = _words(plan, "gyro")
    lsb = plan.noise.n / np.sqrt(dt) * words.uniform(0.05, 0.6)
    unit = str(words.choice(["deg/s", "deg/h", "rad/s"] if plan.output == "rate" else ["arcsec", "rad", "deg"]))
    per = dt if plan.output == "increment" else 1.0
    step = rounded_up(lsb * per / UNITS[unit] / 2)
    values = np.round(rates * per / UNITS[unit] / step) * step
    more = {"quantity": '"increment"'} if plan.output == "increment" else {}
    if plan.output == "rate" and not plan.world.instant:
        more = {"covers": '"interval"'}
    return Column(plan.target, heading, values, decimals(step), unit, more), values * UNITS[unit] / per


def angle_column(plan: Plan, angle: Floats) -> Column:
    rng = _words(plan, "angle")
    unit = str(rng.choice(["deg", "deg", "rad"]))
    value = angle / UNITS[unit]
    more = {}
    if plan.wrapped:
        value = np.mod(value, 2 * np.pi / UNITS[unit])
        more = {"wrapped": "true"}
    places = decimals(plan.encoder_step / UNITS[unit]) + (unit != "deg") * 2
    return Column("table_angle", str(rng.choice(["table", "encoder", "phi", "Angle"])), value, places, unit, more)


def rate_column(plan: Plan) -> Column:
    """What the table was told: the mean over each sample."""
    rng = _words(plan, "rate")
    w, unit = plan.world, str(rng.choice(["deg/s", "rad/s"]))
    told = np.tile(np.diff(w.trajectory.angle(w.dt * np.arange(w.each + 1.0))) / w.dt, w.runs)
    return Column("table_rate", str(rng.choice(["cmd", "rate_cmd", "table rate"])), told / UNITS[unit], 9, unit,
                  {"covers": '"interval"'})  # fmt: skip


def temperature_column(plan: Plan, rng: np.random.Generator) -> Column:
    celsius = climate.thermometer(plan.world.climate, plan.world.rows, rng)
    rng = _words(plan, "temperature")
    unit = str(rng.choice(["degC", "degC", "K", "degF"]))
    values = {"degC": celsius, "K": celsius + 273.15, "degF": celsius * 1.8 + 32}[unit]
    return Column("temperature", str(rng.choice(["temp", "T1", "Temperature"])), values, 4, unit)
