"""A case as a recording: columns of a file, its manifest, and what is true of it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from case import DEG, Case
from faults import Exposed
from gyro import filtered, noise, read
from logger import encoder, encoder_rate, instants, rate_lag, stamps, written_time
from motion import Floats, Motion, moved
from scipy.fft import dct

EARTH = 7.292115e-5
#: Share of the time that a manifest without `[held_out]` leaves to the fit.
FITTED = 0.6


@dataclass(frozen=True)
class Recording:
    """What is logged: columns (texts come last), and the row instants; shapes (n,)."""

    at: Floats
    t: Floats
    kept: np.ndarray
    gyro: Floats
    columns: dict[str, Floats] = field(repr=False)
    residual: Floats
    u: Floats
    angle: Floats


def recorded(case: Case, size: float = 0.0, ideal: bool = False) -> Recording:
    """The recording with its fault of a size; ``ideal``: without noise and rounding."""
    step = case.dt / max(4, int(np.ceil(case.dt / 1e-3)))
    motion = moved(case.table, case.duration, step, case.rng(1))
    at = instants(case.clock, case.duration, case.rng(2))
    heat = _temperature(case, motion.t)
    place = motion.angle + 0.7
    u = np.sin(case.tilt) * motion.rate + EARTH * (
        np.sin(case.latitude) * np.sin(case.tilt) + np.cos(case.latitude) * np.cos(case.tilt) * np.cos(place)
    )
    exposed = Exposed(motion.t, u, motion.angle, heat, case.table.top)
    gyro = replace(case.gyro, step=0.0) if ideal else case.gyro
    rate, shown, late, hold = gyro.gain * u + gyro.bias, motion.angle, 0.0, 1
    cause = case.cause
    if cause is not None and size:
        added = cause.law(exposed, size, case.shape, case.rng(3))
        # An axis that is mounted the other way round loses of its own reading what lock-in and dead bands take.
        rate = rate + np.sign(gyro.gain) * added if cause.on == "rate" else rate
        shown = shown + added if cause.on == "angle" else shown
        late = float(added[0]) if cause.on == "late" else 0.0
        hold = int(added[0]) if cause.on == "held" else 1
    if not ideal:
        rate = rate + noise(gyro, len(rate), step, case.rng(4))
    values = read(filtered(rate, gyro, step), motion.t, at - late, gyro, case.rng(5))
    values = values[np.arange(len(values)) // hold * hold]
    rows = at[1:]
    t, kept = stamps(case.clock, rows, case.rng(6))
    columns = _reference(case, motion, shown, rows, ideal)
    if case.temperature != "none":
        seen = np.interp(rows, motion.t, heat) + 0.02 * case.rng(8).standard_normal(len(rows))
        columns["temperature"] = np.round(seen, 2)
    mean = values / np.diff(at) if gyro.reading == "increment" else values
    referred = _referred(case, columns, motion, shown, rows, at)
    seen_angle = np.interp(rows, motion.t, motion.angle)
    residual = mean - gyro.gain * np.sin(case.tilt) * referred
    return Recording(at, t, kept, values, columns, residual, np.interp(rows, motion.t, u), seen_angle)


def _temperature(case: Case, t: Floats) -> Floats:
    rng = case.rng(7)
    start, wide = rng.uniform(18, 30), rng.uniform(8, 25)
    match case.temperature:
        case "chamber":
            return np.asarray(start + wide * np.sin(2 * np.pi * t / t[-1] * rng.uniform(1.3, 3.0)))
        case "warming":
            return np.asarray(start + 0.5 * wide * (1 - np.exp(-t / (t[-1] * rng.uniform(0.1, 0.5)))))
        case _:
            return np.asarray(start + 0.3 * np.sin(2 * np.pi * t / t[-1] * rng.uniform(0.3, 2.0)))


def _reference(case: Case, motion: Motion, shown: Floats, rows: Floats, ideal: bool) -> dict[str, Floats]:
    reference = replace(case.reference, bits=40, noise=0.0) if ideal else case.reference
    kind, rng = reference.kind, case.rng(9)
    out: dict[str, Floats] = {}
    if "angle" in kind and kind != "command angle":
        out["table_angle"] = encoder(motion, shown, rows, reference, rng)
    if kind == "command angle":
        out["table_angle"] = np.interp(rows, motion.t, motion.ramped_angle)
    if kind.endswith("rate"):
        out["table_rate"] = encoder_rate(motion, shown, rows, reference, rng)
    if kind in ("command", "angle + command"):
        told = motion.demanded if reference.jumps else motion.ramped
        out["table_rate"] = np.interp(rows, motion.t, told)
    return out


def _referred(
    case: Case, columns: dict[str, Floats], motion: Motion, shown: Floats, rows: Floats, at: Floats
) -> Floats:
    """Rate of the table as a user would take it from the reference, for the size of the noise [rad/s]."""
    if "table_angle" in columns:
        angle = columns["table_angle"]
        return np.diff(angle, prepend=2 * angle[0] - angle[1]) / np.diff(at)
    if case.reference.kind == "encoder rate":
        return columns["table_rate"]
    return np.interp(rows, motion.t, np.gradient(shown, motion.t))


def skew(case: Case) -> float:
    """How much later the gyro is than its reference, by what is drawn and as the manifest reads it [s]."""
    reference, gyro = case.reference, case.gyro
    late = gyro.lag
    if gyro.reading == "mean" and not said_mean(case):
        late += 0.5 * case.dt
    if reference.kind in ("angle", "angle + command", "angle + rate"):
        return late - reference.late
    if reference.kind == "encoder rate":
        return late - rate_lag(reference, case.dt) + (0.5 * case.dt if reference.covers else 0.0)
    return late + case.table.damping / (np.pi * case.table.bandwidth)


def said_mean(case: Case) -> bool:
    """Whether the user says that the gyro's rate is a mean."""
    return case.gyro.reading == "mean" and bool(case.rng(10).random() < 0.6)


def may(case: Case) -> set[str]:
    """What there is beside the fault, by what was drawn: it may be named and need not.

    The gyro's own noise that wanders is there and undeclared where the manifest states none: a set that has it in it is
    right so far.
    """
    out = {"timing_skew"} if abs(skew(case)) > 1e-6 else set()
    measured = case.reference.measured
    if case.gyro.corner or not measured or case.reference.filter or case.reference.window > 1:
        out.add("output_bandwidth")
        out.add("timing_skew")
    if not case.maker:
        out |= {"bias_instability", "rate_random_walk"}
    if not measured and case.table.cogging:
        out |= {"tone", "encoder_harmonic", "angle_locked_rate"}
    return out


def strength(case: Case, size: float, known: Recording | None = None) -> float:
    """Norm of what the fault adds beside the declared model, over the noise, on the rows of the fit that are kept."""
    base = known or recorded(case)
    clean, faulty = recorded(case, 0.0, True), recorded(case, size, True)
    rows = np.flatnonzero(base.kept)
    rows = rows[: int(FITTED * len(rows))]
    merge = max(len(rows) // 2000, 1)

    def means(x: Floats) -> Floats:
        return np.asarray(x[rows[: len(rows) // merge * merge]].reshape(-1, merge).mean(axis=1))

    u = means(base.u)
    declared = [np.ones_like(u)]
    if "scale_factor" in case.declared:
        declared.append(u)
    if "earth_rate" in case.declared:
        declared += [means(np.cos(base.angle)), means(np.sin(base.angle))]
    k, late = len(declared), [np.gradient(u), np.gradient(np.gradient(u))]
    added, noisy = means(faulty.residual - clean.residual), means(base.residual)
    columns = dct(np.column_stack([*declared, *late, added, noisy]), axis=0, norm="ortho")
    # What is late is no noise.
    left = columns[:, -1] - columns[:, :-2] @ np.linalg.lstsq(columns[:, :-2], columns[:, -1], rcond=None)[0]
    sd = _scatter(left)
    own, white = columns[:, :k] / sd[:, None], columns[:, -2] / sd
    beside = white - own @ np.linalg.lstsq(own, white, rcond=None)[0]
    return float(np.linalg.norm(beside))


def _scatter(modes: Floats) -> Floats:
    """Standard deviation of the modes, from the medians of bands that widen."""
    edges = np.unique(np.concatenate([[0], np.round(np.geomspace(12, len(modes), 14)).astype(int)]))
    out = np.empty_like(modes)
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        out[low:high] = np.median(np.abs(modes[low:high])) / 0.6745
    return np.maximum(out, 1e-12)


def sized(case: Case) -> tuple[float, float]:
    """Size of the fault at the wanted strength, and the strength that it has."""
    cause = case.cause
    if cause is None:
        return 0.0, 0.0
    if cause.on in ("held", "world"):
        return 1.0, strength(case, 1.0) if cause.on == "held" else case.strength
    size, noisy, reached = cause.size, recorded(case), 0.0
    for _ in range(7):
        reached = strength(case, size, noisy)
        if reached and abs(np.log(reached / case.strength)) < 0.1:
            break
        size *= float(np.clip(case.strength / max(reached, 1e-6), 1e-5, 1e5))
    return size, reached


def write(case: Case, size: float, folder: Path) -> Path:
    """Data file and manifest of a case, as a user would have them."""
    made = recorded(case, size)
    keep = made.kept
    unit, factor = ("deg", DEG) if case.reference.unit == "deg" else ("rad", 1.0)
    lines, columns = [], {}
    if case.clock.form == "rate":
        lines.append(f'time = {{ rate = "{case.clock.rate:g} Hz" }}')
    else:
        columns["time"], said = written_time(case.clock, made.t[keep])
        lines.append(f'time = {{ column = "time", unit = "{said}" }}')
    lines.append(_gyro_line(case))
    weight = {"increment": DEG / 3600, "instant": DEG, "mean": DEG}[case.gyro.reading]
    columns["gyro"] = [f"{x:.9g}" for x in made.gyro[keep] / weight]
    for name, values in made.columns.items():
        shown = values[keep]
        said = f', source = "{case.reference.source}"' if case.reference.source and name != "temperature" else ""
        if name == "table_angle":
            shown = np.mod(shown, 2 * np.pi) if case.reference.wrapped else shown
            said += ", wrapped = true" if case.reference.wrapped else ""
            lines.append(f'table_angle = {{ column = "table_angle", unit = "{unit}"{said} }}')
        elif name == "table_rate":
            said += ', covers = "interval"' if case.reference.covers and case.reference.kind.endswith("rate") else ""
            lines.append(f'table_rate = {{ column = "table_rate", unit = "{unit}/s"{said} }}')
        else:
            lines.append('temperature = { column = "temperature", unit = "degC" }')
        columns[name] = [f"{x:.8g}" for x in (shown if name == "temperature" else shown / factor)]
    text = ",".join(columns) + "\n" + "\n".join(",".join(row) for row in zip(*columns.values(), strict=True)) + "\n"
    (folder / "run.csv").write_text(text)
    path = folder / "run.toml"
    path.write_text("\n".join(['data = "run.csv"', "", "[channels]", *lines, *_rest(case)]) + "\n")
    return path


def _gyro_line(case: Case) -> str:
    if case.gyro.reading == "increment":
        return 'gyro = { column = "gyro", unit = "arcsec", quantity = "increment" }'
    said = ', covers = "interval"' if said_mean(case) else ""
    return f'gyro = {{ column = "gyro", unit = "deg/s"{said} }}'


def _rest(case: Case) -> list[str]:
    lines = ["", "[model]", 'target = "gyro"', f"declared = {json.dumps(list(case.declared))}"]
    if "earth_rate" in case.declared or case.tilt < 89 * DEG:
        lines += ["", "[site]", f'latitude = "{case.latitude / DEG:.4f} deg"']
        lines += ["", "[mounting]", f'tilt = "{case.tilt / DEG:g} deg"']
    if case.maker:
        lines += ["", "[noise]", f'angle_random_walk = "{case.gyro.white / DEG * 60:.4g} deg/sqrt(h)"']
        lines += [f'bias_instability = "{case.gyro.flicker / DEG * 3600:.4g} deg/h"']
    if case.averaging:
        lines += ["", "[held_out]", f'averaging = "{case.averaging}"']
    return lines
