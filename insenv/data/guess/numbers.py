"""What the numbers of a recording say of their units.

gravity     |f| = 9.8 or 1 at rest                    -> m/s^2, g; a power of two near it -> counts
turning     df/dt = -s (w x f), f gravity in the triad -> s: rad/s per unit of the gyros, and that the axes agree
table       gyro = gain * table                       -> which pair of units makes the gain 1
clock       the step of the stamps, and their epoch   -> s, ms, us, ns
positions   neighbouring rows read gravity from elsewhere -> each row is one
wraps       an angle that jumps by a full turn        -> deg, rad, turns
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats
from insenv.core.units import DEG, STANDARD_GRAVITY

#: Gravity at rest may be off by so much, of an accelerometer that was never calibrated.
GRAVITY_TOLERANCE = 0.10
#: Steps of a clock that count: least and most in each unit, of 10 kHz or 5 kHz down to rows as slow as loggers write.
CLOCKS: Mapping[str, tuple[float, float]] = {"s": (1e-4, 600), "ms": (0.2, 2e3), "us": (100, 1e6), "ns": (1e5, 1e9)}
SECONDS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
#: Seconds since 1970 of the years 2001 to 2100.
EPOCH = (1e9, 4.1e9)
#: rad/s of the units that gyros and tables have.
RATES: Mapping[str, float] = {"deg/s": DEG, "rad/s": 1.0, "rpm": 2 * np.pi / 60, "mdps": 1e-3 * DEG, "mrad/s": 1e-3}
#: Counts of one g of accelerometers of 10 to 16 bits; counts of one deg/s of gyros.
COUNTS_PER_G = (16384, 8192, 4096, 2048, 1024, 512, 256)
GYRO_COUNTS = ("1/131 deg/s", "1/65.5 deg/s", "1/32.8 deg/s", "1/16.4 deg/s", "8.75 mdps", "17.5 mdps", "35 mdps") + (
    "70 mdps",
)
#: Correlation above which turning tells a unit (rad/s and deg/s are a factor of 57 apart), and a table does.
TURNED, FOLLOWS = 0.8, 0.9
#: Jumps of a command that must be there.
JUMPS = 3
#: Rows of a table of positions.
FEWEST_POSITIONS, MOST_POSITIONS = 4, 5000
#: Rows of a block, blocks that must turn, and how far a gain may be from a unit's.
BLOCK, TURNING_BLOCKS, UNIT_TOLERANCE = 10, 20, 0.12


def whole(values: Floats) -> bool:
    """Whether numbers are whole, as raw counts are, and more than a few."""
    return bool(np.all(values == np.rint(values))) and float(np.ptp(values)) > 4


def blocks(values: Floats, size: int) -> Floats:
    """Means of blocks of ``size`` rows, shape (n // size, ...)."""
    count = len(values) // size
    return values[: count * size].reshape(count, size, *values.shape[1:]).mean(axis=1)


def gravity(force: Floats) -> float:
    """Median magnitude of a triad's reading, shape (n, 3); of blocks, so that noise does not add to it."""
    return float(np.median(np.linalg.norm(blocks(force, min(BLOCK, max(1, len(force) // 20))), axis=1)))


def force_unit(magnitude: float, counts: bool) -> tuple[str, bool]:
    """The unit in which gravity reads so much, "" for none, and whether no other would do."""
    for unit, one in (("m/s^2", STANDARD_GRAVITY), ("g", 1.0)):
        if abs(magnitude / one - 1) < GRAVITY_TOLERANCE and not counts:
            return unit, True
    if abs(magnitude / 1000 - 1) < 0.015:
        return "mg", False
    nearest = min(COUNTS_PER_G, key=lambda n: abs(np.log(max(magnitude, 1e-300) / n)))
    if abs(magnitude / nearest - 1) < 2 * GRAVITY_TOLERANCE and counts:
        return f"1/{nearest} g", False
    return "", False


def force_fits(magnitude: float, factor: float) -> bool:
    """Whether ``magnitude`` in a unit of ``factor`` m/s^2 may be gravity: a stated unit is doubted beyond 25 %."""
    return abs(magnitude * factor / STANDARD_GRAVITY - 1) < 0.25


@dataclass(frozen=True)
class Clock:
    """Stamps: the unit, "" where several would do, those that would, the median step, and whether they run forwards."""

    unit: str
    others: tuple[str, ...]
    step: float
    forwards: bool


def clock(stamps: Floats) -> Clock:
    """What stamps tell of their unit."""
    steps = np.diff(stamps)
    positive = steps[steps > 0]
    if len(positive) < 0.5 * len(steps) or not len(positive):
        return Clock("", (), 0.0, False)
    step = float(np.median(positive))
    middle = float(np.median(stamps))
    dated = [u for u, size in SECONDS.items() if EPOCH[0] < middle * size < EPOCH[1] and step * size < CLOCKS["s"][1]]
    if len(dated) == 1:
        return Clock(dated[0], (), step, True)
    fine = step != np.rint(step) and step < CLOCKS["ms"][0]
    units = ["s"] if fine else [u for u, (least, most) in CLOCKS.items() if least <= step <= most]
    return Clock(units[0] if len(units) == 1 else "", tuple(units), step, bool(np.mean(steps > 0) > 0.9))


@dataclass(frozen=True)
class Turning:
    """How gravity turned in the triad as the gyros say: ``scale`` [rad/s per unit of the gyros]."""

    scale: float
    correlation: float


def turning(rate: Floats, force: Floats, period: float) -> Turning | None:
    """Scale of the gyros, shape (n, 3), by gravity in the accelerometers, shape (n, 3); None where little turned.

    Blocks in which the force is not of gravity's size, and those that hardly turn, are left out.
    """
    size = max(1, min(BLOCK, round(0.1 / period)))
    f, w = blocks(force, size) / gravity(force), blocks(rate, size)
    if len(f) < 3 * TURNING_BLOCKS:
        return None
    w = w - np.median(w, axis=0)  # most of a recording by hand is rest
    middle, w = (f[1:] + f[:-1]) / 2, (w[1:] + w[:-1]) / 2
    change = np.diff(f, axis=0)
    still = np.abs(np.linalg.norm(f, axis=1) - 1) < 0.1
    speed = np.linalg.norm(w, axis=1)
    used = still[1:] & still[:-1] & (speed > 0.3 * np.quantile(speed, 0.98))
    if used.sum() < TURNING_BLOCKS:
        return None
    expected = -np.cross(w[used], middle[used]) * (size * period)
    found = change[used]
    # Median of what a block moves: some tenths of a degree are more than noise and less than any hand does.
    if np.median(np.linalg.norm(found, axis=1)) < 0.003:
        return None
    power = float(np.sum(expected**2))
    along = float(np.sum(expected * found))
    return Turning(along / power, along / float(np.sqrt(power * float(np.sum(found**2)))))


def rate_unit(scale: float) -> str:
    """The unit that is so many rad/s, "" for none of those that gyros have."""
    for unit in ("rad/s", "deg/s", "mdps", "mrad/s"):
        if abs(scale / RATES[unit] - 1) < UNIT_TOLERANCE:
            return unit
    return ""


def counts_unit(scale: float) -> str:
    """The count of a gyro that is nearest to so many rad/s, "" where none is near."""
    sizes = {text: _size(text) for text in GYRO_COUNTS}
    nearest = min(sizes, key=lambda text: abs(np.log(scale / sizes[text]))) if scale > 0 else GYRO_COUNTS[0]
    return nearest if scale > 0 and abs(scale / sizes[nearest] - 1) < UNIT_TOLERANCE else ""


def _size(text: str) -> float:
    number, unit = text.split()
    above, _, below = number.partition("/")
    return float(above) / float(below or 1) * RATES[unit]


@dataclass(frozen=True)
class Gain:
    """A gyro against a table: ``gain`` in the numbers of both, and their correlation."""

    gain: float
    correlation: float


def gain(gyro: Floats, table: Floats) -> Gain:
    """Slope of a gyro over a table's rate, shape (n,) each, on means of a few rows (either may be late)."""
    size = max(1, min(BLOCK, len(gyro) // 50))
    y, x = blocks(gyro, size), blocks(table, size)
    y, x = y - y.mean(), x - x.mean()
    power = float(x @ x)
    if power == 0 or not float(y @ y) > 0:
        return Gain(0.0, 0.0)
    return Gain(float(x @ y) / power, float(x @ y) / float(np.sqrt(power * float(y @ y))))


def pairs(size: float, gyros: Sequence[str], tables: Sequence[str], tolerance: float) -> list[tuple[str, str]]:
    """Units of a gyro and of a table that make a gain of ``size`` (in their numbers) one."""
    return [(g, t) for g in gyros for t in tables if abs(size * RATES[g] / RATES[t] - 1) < tolerance]


def jumps_at_once(gyro: Floats, command: Floats, gain: float) -> bool:
    """Whether a command jumps, and the gyro with it within the row: shape (n,) each, ``gain`` of the gyro over it.

    Then both are means over the interval that ends at their row: a command between two rows is one of the two values,
    not their mean.
    """
    steps = np.diff(command)
    span = float(np.ptp(command))
    still = np.abs(steps) < 1e-3 * span
    jumps = np.flatnonzero(np.abs(steps) > 0.1 * span)
    if span == 0 or gain == 0 or np.mean(still) < 0.9 or len(jumps) < JUMPS:
        return False
    reached = (gyro[jumps + 1] - gyro[jumps]) / (gain * steps[jumps])
    return bool(np.median(np.abs(reached - 1)) < 0.1)


def turn_unit(angle: Floats) -> tuple[str, bool]:
    """Unit of an angle that jumps by a full turn, and whether it does."""
    steps = np.abs(np.diff(angle))
    for unit, turn in (("deg", 360.0), ("rad", 2 * np.pi), ("turn", 1.0), ("arcsec", 1296000.0)):
        jumps = np.abs(steps - turn) < 0.05 * turn
        if jumps.any() and np.median(steps) < 0.05 * turn and float(np.ptp(angle)) < 1.05 * turn:
            return unit, True
    return "", False


def attitudes(force: Floats) -> int:
    """Number of attitudes, at least 20 deg apart, in which a triad rested; ``force``, shape (n, 3), in any unit."""
    size = max(2, min(50, len(force) // 40))
    f = force / gravity(force)
    count = len(f) // size
    parts = f[: count * size].reshape(count, size, 3)
    quiet = np.linalg.norm(parts.std(axis=1), axis=1) < 0.03
    means = parts.mean(axis=1)
    still = quiet & (np.abs(np.linalg.norm(means, axis=1) - 1) < 0.25)
    found: list[Floats] = []
    for one in means[still] / np.linalg.norm(means[still], axis=1)[:, None]:
        if all(float(one @ other) < np.cos(20 * DEG) for other in found):
            found.append(one)
    return len(found)


def are_positions(force: Floats) -> bool:
    """Whether each row is a position of its own, and no row of a series: neighbours read gravity from elsewhere."""
    if not FEWEST_POSITIONS <= len(force) <= MOST_POSITIONS:
        return False
    size = np.linalg.norm(force, axis=1)
    f = force / np.maximum(size, 1e-300)[:, None]
    apart = np.sum(f[1:] * f[:-1], axis=1) < np.cos(20 * DEG)
    return float(np.mean(np.abs(size / np.median(size) - 1) < 0.25)) > 0.9 and float(apart.mean()) > 0.5


def up(force: Floats) -> str:
    """The axis that gravity's reaction lies along within 20 deg, all the time: "+x", "-z"; "" for none."""
    mean = force.mean(axis=0)
    mean = mean / max(float(np.linalg.norm(mean)), 1e-300)
    i = int(np.argmax(np.abs(mean)))
    return f"{'+' if mean[i] > 0 else '-'}{'xyz'[i]}" if abs(mean[i]) > np.cos(20 * DEG) else ""
