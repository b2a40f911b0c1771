"""What a data logger writes: rows with stamps, a reference of the table, a thermometer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from motion import Floats, Motion
from scipy.signal import lfilter

#: Rows before the first one that is logged.
AHEAD = 12


@dataclass(frozen=True)
class Clock:
    """Rows and their stamps."""

    rate: float
    #: Scatter of the instants at which a row is read, and of its stamp alone, in rows.
    wander: float
    jitter: float
    #: Share of rows that are lost, and of stamps that come late.
    lost: float
    late: float
    #: "seconds", "milliseconds", "microseconds", "unix" or "rate" (no column).
    form: str
    digits: int


@dataclass(frozen=True)
class Reference:
    """What is logged of the table."""

    #: "angle", "encoder rate", "command", "command angle", "angle + command", "angle + rate".
    kind: str
    bits: int
    wrapped: bool
    #: Noise of the encoder [counts].
    noise: float
    #: How late it is read [s].
    late: float
    #: Of an encoder's rate: rows that are differenced, and time constant of the drive's own filter [s].
    window: int
    filter: float
    #: Whether the command that is logged jumps.
    jumps: bool
    #: "", or what the user writes as `source`.
    source: str
    #: Whether the user says that the rate is a mean.
    covers: bool
    unit: str

    @property
    def measured(self) -> bool:
        """Whether what the reading is compared with was measured."""
        return not self.kind.startswith("command")


def instants(clock: Clock, duration: float, rng: np.random.Generator) -> Floats:
    """When rows are read [s]; one more at the start than there are rows. The logger has run for a while before."""
    dt = 1 / clock.rate
    t: Floats = np.arange(float(int(duration / dt) - AHEAD - 1)) * dt + AHEAD * dt
    return t + np.clip(clock.wander * rng.standard_normal(len(t)), -0.4, 0.4) * dt


def stamps(clock: Clock, at: Floats, rng: np.random.Generator) -> tuple[Floats, np.ndarray]:
    """Stamps of the rows [s] before rounding, and which rows are kept."""
    dt = 1 / clock.rate
    t = at + np.clip(clock.jitter * rng.standard_normal(len(at)), -0.45, 0.45) * dt
    late = np.flatnonzero(rng.random(len(at)) < clock.late)
    for row in late:
        delay = rng.uniform(1, 6) * dt
        held = slice(row, min(row + int(delay / dt) + 1, len(t)))
        t[held] = np.maximum(t[held], t[row] + delay + 0.02 * dt * np.arange(len(t[held])))
    least = 0.03 * dt * np.arange(len(t))  # stamps that come together are still apart
    keep = rng.random(len(at)) >= clock.lost
    keep[:5] = True
    return np.maximum.accumulate(t - least) + least, keep


def written_time(clock: Clock, t: Floats) -> tuple[list[str], str]:
    """Texts of the time column and its unit."""
    match clock.form:
        case "milliseconds":
            return [f"{x * 1e3:.{max(clock.digits - 3, 0)}f}" for x in t], "ms"
        case "microseconds":
            return [f"{x * 1e6:.0f}" for x in t], "us"
        case "unix":
            return [f"{x:.{clock.digits}f}" for x in 1.7e9 + 4321.25 + t], "s"
        case _:
            return [f"{x:.{clock.digits}f}" for x in t], "s"


def encoder(motion: Motion, angle: Floats, at: Floats, reference: Reference, rng: np.random.Generator) -> Floats:
    """The encoder's angle at the instants, cumulative, in whole counts [rad]."""
    count = 2 * np.pi / 2**reference.bits
    seen = np.interp(at - reference.late, motion.t, angle) / count
    return count * np.floor(seen + reference.noise * rng.standard_normal(len(at)))


def encoder_rate(motion: Motion, angle: Floats, at: Floats, reference: Reference, rng: np.random.Generator) -> Floats:
    """A rate made from the encoder's counts: over so many rows, or by the drive at its own clock through a filter."""
    if not reference.filter:
        w = reference.window
        earlier = at[0] - (at[1] - at[0]) * np.arange(w, 0, -1)
        when = np.concatenate([earlier, at])
        seen = encoder(motion, angle, when, reference, rng)
        return (seen[w:] - seen[:-w]) / (when[w:] - when[:-w])
    every = max(round(5e-4 / motion.step), 1)
    fine = motion.t[::every]
    seen = encoder(motion, angle, fine, reference, rng)
    rate = np.diff(seen, prepend=seen[0]) / (fine[1] - fine[0])
    e = np.exp(-(fine[1] - fine[0]) / reference.filter)
    smooth = np.asarray(lfilter([1 - e], [1.0, -e], rate - rate[1])) + rate[1]
    return np.asarray(smooth[np.clip(np.searchsorted(fine, at, side="right") - 1, 0, len(fine) - 1)])


def rate_lag(reference: Reference, dt: float) -> float:
    """How late a rate of the encoder is as a value at the row's time [s]."""
    return reference.late + (reference.filter or 0.5 * reference.window * dt)
