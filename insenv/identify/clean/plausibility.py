"""Declarations that cannot be: units, quantities, signs and columns, before any search.

    gain = sum u y / sum u^2,        y the reading, u what the axis was exposed to, means over cells

An instrument's gain is one within some per cent. Where it is far from one, and another unit, quantity or time base of
one of the channels would bring it there, the declaration is wrong and the reading is not: that is said in one sentence
instead of being fitted. A gain of minus one is an axis that points the other way, an ordinary finding.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.core.units import STANDARD_GRAVITY, ZERO_CELSIUS, scale_to_si
from insenv.data.exposure import expose, has_table, table_share
from insenv.data.manifest.spec import CHANNELS, INCREMENTS, ChannelSpec, Manifest
from insenv.data.split import split

#: Departure of a gain from one that no instrument has, and a gain of what does not turn with a table that went so far
#: [rad].
INCREDIBLE, UNMOVED, TRAVELLED = 0.4, 0.1, 1.0
#: Share of the readings' square sum from which on they do follow the table, by however little.
FOLLOWS = 0.5
#: Departure from a known ratio within which it is that one: data sheets of cheap gyros grant 3 to 4 per cent.
SAME = 0.05
#: What is so much farther off than the nearest ratio is not said beside it.
FARTHER, CLOSE = 2.0, 0.03
#: The same for the size of gravity, which biases of cheap triads change.
SAME_GRAVITY = 0.08
#: Standard deviation of a gain, as a share of it, from which on nothing is said.
VAGUE = 0.02
#: Cells of a run: they average noise and short delays away.
CELLS = 400
#: Least share of the table's rate for a gain.
LEAST_SHARE = 0.05
#: Least reading [rad/s] that is no bias: where the rate never changes a gain is not told from one.
LARGEST_BIAS = 0.02
#: Least scatter of the rate, as a share of its size, from which a bias is told from the gain.
CHANGING = 0.1
#: Temperatures that laboratories have [K].
COLDEST, HOTTEST = 150.0, 520.0
#: Fewest rows of a mean that tell noise from gravity, and the share of the rows' size that is left of noise.
ROWS_OF_NOISE, SHARE_OF_NOISE = 16, 0.5
#: Ratios that a wrong range setting gives, and a point in the wrong place.
RANGES = (2.0, 4.0, 8.0, 10.0, 16.0, 100.0, 1000.0)
#: Standard deviations by which a gain is beyond what is credible, where it is known to no two per cent.
SURE = 3.0
#: Fewest cells that tell whether a rate has a sign; share of its size that a bias reads the other way, share of the
#: cells in which the other turns either way; squares of correlations with a size and with a rate that has a sign.
FEWEST_CELLS, ONE_WAY, BOTH_WAYS, ALIKE, UNLIKE = 50, 0.1, 0.1, 0.9, 0.5
#: Least rate of turn that stands out of an encoder's noise [rad/s].
TURNING = 0.01

#: Units that laboratories use, by dimension.
UNITS = {
    "time": ("s", "ms", "us", "ns", "min", "h"),
    "rate": ("rad/s", "deg/s", "deg/h", "mrad/s", "mdps", "deg/min", "rpm", "arcsec/s"),
    "angle": ("rad", "deg", "arcmin", "arcsec", "mrad", "turn"),
    "acceleration": ("m/s^2", "g", "mg", "ug", "mGal", "cm/s^2"),
    "velocity": ("m/s", "cm/s", "mm/s"),
}
#: What readings are in that were turned from deg into rad though they were rad, or from rad into deg though deg.
TWICE = {"rate": ("57.29578 rad/s", "0.01745329 deg/s"), "angle": ("57.29578 rad", "0.01745329 deg")}
#: What column names end in, and the unit that it stands for.
ENDINGS = {
    "ms": "ms", "msec": "ms", "millis": "ms", "us": "us", "usec": "us", "micros": "us", "ns": "ns", "nsec": "ns",
    "s": "s", "sec": "s", "seconds": "s",
    "deg": "deg", "rad": "rad", "dps": "deg/s", "mdps": "mdps", "degs": "deg/s", "deg_s": "deg/s", "rads": "rad/s",
    "rad_s": "rad/s", "deg_h": "deg/h", "dph": "deg/h", "rpm": "rpm",
    "mg": "mg", "g": "g", "ug": "ug", "mps2": "m/s^2", "ms2": "m/s^2", "m_s2": "m/s^2",
}  # fmt: skip


@dataclass(frozen=True)
class Gain:
    """Gain of a channel against what it was exposed to, its standard deviation, and the largest rate [rad/s].

    ``explained`` is the share of the readings' square sum that the gain explains.
    """

    value: float
    sd: float
    rate: float
    explained: float


@dataclass(frozen=True)
class Remedy:
    """Another declaration of one key, and the ratio of the gain that it explains."""

    words: str
    ratio: float


def implausible(manifest: Manifest, recordings: Sequence[Recording]) -> dict[str, tuple[str, ...]]:
    """Cautions for each target whose declaration is doubtful.

    Raises
    ------
    InputError
        If a declaration is wrong beyond doubt: a dead channel, a temperature of no laboratory, or a gain that is a
        known ratio of units. The sentence names the key and what it should say.
    """
    _check_temperature(manifest, recordings)
    names = _contradictions(manifest)
    table = _table_disagrees(manifest, recordings)
    found: dict[str, tuple[str, ...]] = {}
    for target in manifest.model.targets:
        _check_alive(manifest, recordings, target)
        said = _gravity(manifest, recordings) if target.startswith("accel_") else _turning(manifest, recordings, target)
        found[target] = (*said, *table, *names)
    return found


def without_dead(manifest: Manifest, recordings: Sequence[Recording]) -> tuple[Manifest, tuple[str, ...]]:
    """The manifest of a unit at rest without targets that read one number in all rows that are fitted; what is said.

    Steps of the readings, or a dead band, may hide all that a channel would show; those beside it are judged.

    Raises
    ------
    InputError
        If no target is left.
    """
    if manifest.procedure != "static":
        return manifest, ()
    uses = [use.fit for use in split(manifest, recordings)]
    said = {}
    for target in manifest.model.targets:
        fitted = [r.channel(target).values[use] for r, use in zip(recordings, uses, strict=True)]
        if all(len(values) and np.ptp(values) == 0 for values in fitted):
            said[target] = (
                f"{target} reads {fitted[0][0]:.6g} {recordings[0].channel(target).unit} in all rows that are fitted: "
                "its steps, or a dead band, hide what is smaller, and it is left out"
            )
    alive = tuple(target for target in manifest.model.targets if target not in said)
    if not alive:
        raise InputError(
            f"{manifest.path}: {', '.join(said)} read{'s' * (len(said) == 1)} the same value in all rows that are "
            "fitted: a dead channel or another column; wanted the instrument's readings"
        )
    return replace(manifest, model=replace(manifest.model, targets=alive)) if said else manifest, tuple(said.values())


def _check_alive(manifest: Manifest, recordings: Sequence[Recording], target: str) -> None:
    for recording in recordings:
        values = recording.channel(target).values
        if len(values) > 1 and np.ptp(values) == 0:
            column = manifest.channels[target].column if target in manifest.channels else target
            raise InputError(
                f"{recording.label}: {target} (column {column!r}) has the same value in all {len(values)} rows: a dead "
                f"channel or another column; wanted the instrument's readings as channels.{target}.column"
            )


def _check_temperature(manifest: Manifest, recordings: Sequence[Recording]) -> None:
    for recording in recordings:
        if "temperature" not in recording.channels:
            continue
        middle = float(np.median(recording.channels["temperature"].values))
        if COLDEST < middle < HOTTEST:
            continue
        other = {
            "K": middle - ZERO_CELSIUS,
            "degC": middle + ZERO_CELSIUS,
            "0.1 degC": ZERO_CELSIUS + 0.1 * (middle - ZERO_CELSIUS),
            "0.01 degC": ZERO_CELSIUS + 0.01 * (middle - ZERO_CELSIUS),
        }
        wanted = [f'"{unit}"' for unit, value in other.items() if 230 < value < 400]
        raise InputError(
            f"{manifest.path}: channels.temperature of {recording.label} is {middle - ZERO_CELSIUS:.4g} degC in the "
            f"median; wanted another unit{', such as ' + ' or '.join(wanted[:2]) if wanted else ' or column'}"
        )


# ------------------------------------------------------------------------------------------------- turning tables


def _turning(manifest: Manifest, recordings: Sequence[Recording], target: str) -> tuple[str, ...]:
    """A gyro against the rate that it was exposed to."""
    if target.startswith("accel"):
        return ()
    cells = [_cells(r, target) for r in recordings if abs(table_share(r, target)) > LEAST_SHARE and has_table(r)]
    _check_signs(manifest, target, cells)
    gain = _gain(cells)
    if gain is None:
        return ()
    size, value = abs(gain.value), gain.value
    if abs(size - 1) > INCREDIBLE and gain.sd < VAGUE * size:
        remedies = _remedies(manifest, recordings[0].dt, target, size, SAME)
        if remedies and not _rather_a_range(size, remedies[0]):
            raise InputError(_wrong(manifest, target, "the rate that it was exposed to", value, remedies))
    # Errors of the reference make a gain smaller, and none larger.
    larger = gain.explained > FOLLOWS and size - SURE * gain.sd > 1 + INCREDIBLE
    if (gain.sd > VAGUE * max(1.0, size) and not larger) or abs(value - 1) <= INCREDIBLE:
        return ()
    # An encoder's noise turns nothing; by however little a table turns, a gyro that follows it tells a gain.
    if gain.rate < TURNING and gain.explained < FOLLOWS:
        return ()
    if size < UNMOVED and gain.explained < FOLLOWS and _travelled(recordings, target) > TRAVELLED:
        return _unmoved(manifest, recordings, target, value)
    return _far_from_one(target, value)


def _check_signs(manifest: Manifest, target: str, cells: Sequence[tuple[Floats, Floats]]) -> None:
    """Raise InputError if the reading, or the reference, has the size of the rate without its sign."""
    if sum(len(u) for u, _ in cells) < FEWEST_CELLS:
        return
    u, y = (np.concatenate([one[k] for one in cells]) for k in (0, 1))
    for size, other, channel, beside in (
        (y, u, f"{target} reads", "the rate that it was exposed to"),
        (u, y, f"the reference of {target} has", "what is read"),
    ):
        turned = float(np.mean(other < 0))
        one_way = size.min() > -ONE_WAY * size.max() or size.max() < -ONE_WAY * size.min()
        if not one_way or not BOTH_WAYS < turned < 1 - BOTH_WAYS or not np.ptp(size) or not np.ptp(other):
            continue
        with_sign, without = (float(np.corrcoef(size, x)[0, 1]) ** 2 for x in (other, np.abs(other)))
        if without > ALIKE and with_sign < UNLIKE:
            raise InputError(
                f"{manifest.path}: {channel} the size of {beside} and not its sign; wanted a column with its sign, or "
                "a reading and a reference that have none"
            )


def _unmoved(manifest: Manifest, recordings: Sequence[Recording], target: str, value: float) -> tuple[str, ...]:
    """A gyro that reads next to nothing of the changes of the rate; raise InputError unless it turns as far."""
    if _turns_along(recordings, target):
        return (
            f"{target} turns as far as the table and reads {value:.2g} of the changes of its rate: those are errors of "
            "the reference, and tell no gain.",
        )
    raise InputError(
        f"{manifest.path}: {target} reads {value:.2g} times the rate that it was exposed to: it does not turn with "
        f"the table; wanted another column or mounting for channels.{target}, or a reference without rows that leap"
    )


def _far_from_one(target: str, value: float) -> tuple[str, ...]:
    """A gain that no gyro has: of an axis that points the other way, of another range, or of one that leans."""
    size = abs(value)
    if value < 0 and abs(size - 1) < INCREDIBLE:
        return (
            f"The input axis of {target} is reversed: it reads {value:.4g} times the rate that it was exposed to. "
            "The scale factor stated here counts from +1, a lag and a held output are relative to that gain; turn the "
            "sign of the column, of the table or of mounting.tilt for a scale factor that counts from it.",
        )
    ranges = next((n for n in RANGES for x in (n, 1 / n) if abs(size / x - 1) < SAME), None)
    why = (
        f"a factor of {ranges:g}: check the unit and the range setting" if ranges else "check column, unit and mounting"
    )
    if size < 1 and not ranges:
        lean = np.rad2deg(np.arccos(size))
        why += f", as an axis that leans by {lean:.3g} deg would read it"
    return (
        f"{target} reads {value:.4g} times the rate that it was exposed to, further from 1 than any gyro is: {why}.",
    )


def _rather_a_range(size: float, remedy: Remedy) -> bool:
    """Whether a gain is nearer to that of a wrong range, or of a point in the wrong place, than to that of a unit."""
    off = min(abs(float(np.log(size / x))) for n in RANGES for x in (n, 1 / n))
    return FARTHER * off < abs(float(np.log(size / remedy.ratio)))


def _table_disagrees(manifest: Manifest, recordings: Sequence[Recording]) -> tuple[str, ...]:
    """The table's rate against the change of its angle, where both were logged."""
    pairs = []
    for recording in recordings:
        if {"table_angle", "table_rate"} <= recording.channels.keys():
            rows = max(1, len(recording) // CELLS)
            angle = recording.channels["table_angle"].values[::rows]
            t = recording.t[::rows]
            rate = recording.channels["table_rate"].values
            mean = np.add.reduceat(rate, np.arange(0, len(rate), rows)) / rows
            pairs.append((mean[: len(angle) - 1], np.diff(angle) / np.diff(t)))
    gain = _gain(pairs)
    if gain is None or abs(gain.value - 1) <= INCREDIBLE or gain.sd > VAGUE * max(1.0, abs(gain.value)):
        return ()
    return (
        f"The angle of the table changes {gain.value:.4g} times as fast as its rate says: check unit and sign of "
        "channels.table_angle and channels.table_rate, and the unit of the time.",
    )


def _cells(recording: Recording, target: str) -> tuple[Floats, Floats]:
    """Exposure and reading, means over cells that are not empty."""
    exposure = expose(recording, target, max(1, len(recording) // CELLS))
    there = exposure.count > 0
    return exposure.motion.rate[there], exposure.y[there]


def _travelled(recordings: Sequence[Recording], target: str) -> float:
    """How far the reference went in a run at most [rad]: the noise of an encoder of a table at rest goes nowhere."""
    motions = (expose(r, target, max(1, len(r) // CELLS)).motion for r in recordings if has_table(r))
    return max(float(np.ptp(np.cumsum(m.rate * m.dt))) for m in motions)


def _turns_along(recordings: Sequence[Recording], target: str) -> bool:
    """Whether in a run the readings go as far as the table, far beyond any bias: what they do not follow is noise."""
    for recording in (r for r in recordings if has_table(r)):
        u, y = (float(values.mean()) for values in _cells(recording, target))
        if min(abs(u), abs(y)) > LARGEST_BIAS and abs(abs(y / u) - 1) < INCREDIBLE:
            return True
    return False


def _gain(runs: Sequence[tuple[Floats, Floats]]) -> Gain | None:
    """Gain of the readings on the exposure; a bias of each run is told from it where the rate changes."""
    if not runs:
        return None
    rates = np.concatenate([u for u, _ in runs])
    if len(rates) < 8:
        return None
    changing = bool(rates.std() > CHANGING * np.sqrt(np.mean(rates**2)))
    if not changing and np.abs(np.concatenate([y for _, y in runs])).mean() < LARGEST_BIAS:
        return None
    # Of runs that are each at one rate, and not at the same, all together tell a gain from one bias.
    biases = any(u.std() > CHANGING * np.sqrt(np.mean(rates**2)) for u, _ in runs)
    both = np.concatenate(runs, axis=1)
    levels = [(np.mean(run, axis=1) if biases else both.mean(axis=1)) * changing for run in runs]
    x, y = np.concatenate([np.array(run) - level[:, None] for run, level in zip(runs, levels, strict=True)], axis=1)
    power = float(x @ x)
    if power <= 0:
        return None
    value = float(x @ y) / power
    scatter = float(np.sqrt(np.mean((y - value * x) ** 2)))
    explained = value**2 * power / max(float(y @ y), 1e-300)
    return Gain(value, scatter / np.sqrt(power), float(np.abs(rates).max()), explained)


def _remedies(manifest: Manifest, dt: float, target: str, size: float, same: float) -> list[Remedy]:
    """Other declarations with which the gain would be one, nearest first."""
    found = [*_other_units(manifest, target, 1.0), *_other_quantity(manifest, target, dt)]
    increment = _quantity(manifest, target) == "increment"
    if "table_rate" in manifest.channels and "table_angle" not in manifest.channels:
        found += _other_units(manifest, "table_rate", -1.0)
        found += _other_units(manifest, "time", -1.0) if increment else []
    if "table_angle" in manifest.channels:
        found += _other_units(manifest, "table_angle", -1.0)
        found += [] if increment else _other_units(manifest, "time", 1.0)
    fits = [r for r in found if abs(size / r.ratio - 1) < same and abs(r.ratio - 1) > INCREDIBLE]
    off = {r: round(abs(float(np.log(size / r.ratio))), 4) for r in fits}
    nearest = min(off.values(), default=0.0)
    return sorted((r for r in fits if off[r] < FARTHER * nearest + CLOSE), key=lambda r: off[r])


def _quantity(manifest: Manifest, channel: str) -> str:
    spec = manifest.channels.get(channel)
    return (spec.quantity if spec else None) or "rate"


def _dimension(manifest: Manifest, channel: str) -> str:
    dimension = CHANNELS[channel]
    return INCREMENTS[dimension] if _quantity(manifest, channel) == "increment" else dimension


def _other_units(manifest: Manifest, channel: str, power: float) -> Iterator[Remedy]:
    """Units that the channel might have instead: the gain would be ``ratio`` times what it is with the right one.

    The gain grows with the size of the declared unit to the ``power``.
    """
    spec = manifest.channels.get(channel)
    if spec is None or spec.unit is None:
        return
    dimension = _dimension(manifest, channel)
    declared, _ = scale_to_si(spec.unit, dimension, "")
    minus = "-" if declared < 0 else ""  # an axis that was declared the other way stays so
    others = [(unit, unit if not minus else f"-1 {unit}", "") for unit in UNITS[dimension]]
    others += [(unit, f"{minus}{unit}", ", and converted twice") for unit in TWICE.get(dimension, ())]
    for unit, shown, why in others:
        size, _ = scale_to_si(unit, dimension, "")
        words = f'channels.{channel}.unit = "{shown}" (declared "{spec.unit}"{why})'
        yield Remedy(words, float((abs(declared) / size) ** power))


def _other_quantity(manifest: Manifest, target: str, dt: float) -> Iterator[Remedy]:
    if _quantity(manifest, target) == "increment":
        yield Remedy(f'channels.{target}.quantity = "rate" (declared "increment")', 1 / dt)
    else:
        yield Remedy(f'channels.{target}.quantity = "increment" (declared a rate)', dt)


def _wrong(manifest: Manifest, target: str, what: str, value: float, remedies: Sequence[Remedy]) -> str:
    words = " or ".join(dict.fromkeys(r.words for r in remedies[:3]))
    return f"{manifest.path}: {target} reads {value:.5g} times {what}, which no instrument does; wanted {words}"


# ------------------------------------------------------------------------------------------------ accelerometers


def _gravity(manifest: Manifest, recordings: Sequence[Recording]) -> tuple[str, ...]:
    """A triad of accelerometers against gravity."""
    names = [f"accel_{axis}" for axis in "xyz"]
    triads = [r for r in recordings if all(n in r.channels for n in names)]
    if not triads:
        return ()
    ratios = []
    for r in triads:
        size = np.sqrt(np.sum([r.channels[n].values ** 2 for n in names], axis=0))
        ratios.append(float(np.median(size)) / (r.site.gravity or STANDARD_GRAVITY))
    ratio = float(np.median(ratios))
    if abs(ratio - 1) <= INCREDIBLE:
        return ()
    if all(_is_noise(r, names) for r in triads):
        return (
            f"accel_x, y, z read {ratio:.2g} times gravity, noise about nothing: a linear acceleration, from which a "
            "program has taken gravity.",
        )
    for name in names:
        remedies = _remedies(manifest, triads[0].dt, name, ratio, SAME_GRAVITY)
        if remedies:
            words = [r.words.replace(name, "accel_x, y, z") for r in remedies]
            found = [Remedy(text, r.ratio) for text, r in zip(words, remedies, strict=True)]
            raise InputError(_wrong(manifest, "the triad accel_x, y, z", "gravity", ratio, found))
    ranges = next((n for n in RANGES for x in (n, 1 / n) if abs(ratio / x - 1) < SAME_GRAVITY), None)
    why = f"a factor of {ranges:g}: check the unit and the range setting" if ranges else "check the unit, or offsets"
    return (f"The specific force of accel_x, y, z is {ratio:.4g} times gravity in the median: {why}.",)


def _is_noise(recording: Recording, names: Sequence[str]) -> bool:
    """Whether a triad's means over some rows are next to nothing beside its rows: no gravity is in them."""
    values = np.stack([recording.channels[n].values for n in names])
    rows = max(ROWS_OF_NOISE, len(recording) // CELLS)
    if len(recording) < 2 * rows:
        return False
    means = np.add.reduceat(values, np.arange(0, len(recording) - rows + 1, rows), axis=1) / rows
    sizes = [float(np.median(np.linalg.norm(one, axis=0))) for one in (means, values)]
    return sizes[0] < SHARE_OF_NOISE * sizes[1]


# ------------------------------------------------------------------------------------------------ column names


def _contradictions(manifest: Manifest) -> tuple[str, ...]:
    """Columns whose own name states another unit than the manifest."""
    return tuple(text for name, spec in manifest.channels.items() if (text := _contradiction(manifest, name, spec)))


def _contradiction(manifest: Manifest, name: str, spec: ChannelSpec) -> str:
    if spec.unit is None or not isinstance(spec.column, str) or re.match(r"\s*[\d.]", spec.unit):
        return ""
    if name not in CHANNELS or (dimension := _dimension(manifest, name)) not in UNITS:
        return ""
    said = _unit_of_name(spec.column, dimension)
    if said is None or _size(said, dimension) == _size(spec.unit, dimension):
        return ""
    return (
        f"The column {spec.column!r} says {said} by its name, channels.{name}.unit says {spec.unit}: "
        "one of them is wrong."
    )


def _size(unit: str, dimension: str) -> float:
    """Size of a unit in SI, rounded so that two spellings of one agree."""
    return float(f"{scale_to_si(unit, dimension, '')[0]:.6g}")


def _unit_of_name(column: str, dimension: str) -> str | None:
    """The unit that a column's name states in brackets or as its ending, if it is one of ``dimension``."""
    bracket = re.search(r"[\[(]([^\])]+)[\])]\s*$", column)
    lower = column.strip().lower()
    endings = [unit for end, unit in ENDINGS.items() if lower.endswith((f"_{end}", f" {end}"))]
    for text in [bracket[1]] if bracket else endings[::-1]:
        try:
            scale_to_si(text, dimension, "")
        except InputError:
            continue
        return text
    return None
