"""Procedures that a further run may follow, for a recording as it is: what is said of each, what a plant would play.

Rates stay within those that the table has shown, unless its limits are told; a run is as long as the one before, but
where longer dwells are the point. A repeat is the control: it tells what more data of the same kind would do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from insenv.core.estimate import Limits
from insenv.core.recording import Floats, Recording
from insenv.data.reference import is_set
from insenv.identify.next.simulated import FurtherRun
from insenv.plants.profile import Piece, Profile, reversal, staircase
from insenv.plants.thermal import Constant, cycle

#: A table that moved by less in all is at rest [rad].
LEAST_TURN = 0.1
#: Rates at which less than this changes are one [rad/s], and dwells that are told of one run, at most.
_SAME_RATE, _MOST_DWELLS = 2e-3, 60
#: Thermal cycle: the least rise [K], and the fastest ramp of an ordinary chamber, 5 K/min [K/s].
_LEAST_RISE, _FASTEST_RAMP = 10.0, 5.0 / 60.0
#: Lean of the table's axis, turn of the base, and how much longer a longer run is.
_LEAN, _HALF_TURN, _PARK, _LONGER = np.deg2rad(1.0), np.pi, np.pi / 2, 3.0

Texts = Mapping[str, Any]


@dataclass(frozen=True)
class Procedure:
    """A procedure; `told` is what a scenario's other tables would say of it.

    Attributes
    ----------
    words : str
    plan : FurtherRun
        What a plant would do; nothing, of points, whose rows are there.
    profile : mapping, optional
        Keys of a scenario's ``[profile]``, quantities as texts.
    changes : mapping
        What else of a scenario would be another: ``{"temperature": {...}, "base_turned": "180 deg"}``.
    control : bool
        Whether it is the plain repeat.
    """

    words: str
    plan: FurtherRun
    profile: Texts | None = None
    changes: Texts = field(default_factory=dict)
    control: bool = False

    @property
    def told(self) -> Texts:
        """``changes`` with how long it takes."""
        return {"duration": seconds(self.plan.duration), **self.changes} if self.plan.pieces else {}


@dataclass(frozen=True)
class TableTurning:
    """What the table did: its usual rate while it moved, its largest one [rad/s], and how long the first run was [s].

    ``pieces`` are its dwells, or nothing where there are too many to tell. ``rests`` has the angles [rad] and the
    times [s] of the rests of a triad that rests and turns.
    """

    rate: float
    fastest: float
    duration: float
    pieces: Profile
    rests: tuple[tuple[float, float], ...] = ()

    @classmethod
    def of(cls, recordings: tuple[Recording, ...]) -> TableTurning | None:
        """From the commanded rate, else from the angle; None where no table turned."""
        rates = [np.abs(_table_rates(r)) for r in recordings]
        moving = np.concatenate([r[r > 0.5 * r.max(initial=0.0)] for r in rates])
        first = recordings[0]
        duration = _length(first)
        rate = float(np.median(moving)) if len(moving) else 0.0
        rests = _rests(first) if first.mounting.table_axis else ()
        if not rate * duration > LEAST_TURN:
            return None
        fastest = max(float(np.quantile(r, 0.99)) for r in rates if len(r))
        return cls(rate, max(fastest, rate), duration, _dwells(first), rests)


def procedures(recordings: tuple[Recording, ...], limits: Limits | None = None) -> tuple[Procedure, ...]:
    """What may be done next."""
    turning = TableTurning.of(recordings)
    if turning is None:
        return _still(recordings)
    if len(turning.rests) > 1:
        return _vehicle(recordings[0], turning)
    return _table(recordings[0], turning, limits)


def _table(recording: Recording, turning: TableTurning, limits: Limits | None) -> tuple[Procedure, ...]:
    """For an instrument on a rate table."""
    d, r = turning.duration, turning.rate
    most = limits.rate if limits is not None and np.isfinite(limits.rate) else turning.fastest
    other = 2 * r if 2 * r <= most * (1 + 1e-9) else most if most > 1.2 * r else 0.5 * r
    top = min(most, max(2 * r, turning.fastest))
    levels = [share * top for share in (1, 0.75, 0.5, 0.25)]
    steps = [sign * level for sign in (1, -1) for level in levels]
    back, dwell = reversal(r, d / 2), d / len(steps)
    same = turning.pieces or (Piece(d, r),)
    again = _steps(same)

    def slower(share: float) -> tuple[Profile, Texts | None]:
        pieces = tuple(Piece(share * p.duration, p.rate) for p in same)
        return pieces, _steps(pieces)

    both = {"kind": "reversal", "rate": deg_s(r), "dwell": seconds(d / 2)}
    found = [
        Procedure(
            f"turn the table both ways, half of the time at {deg_s(r)} in each direction ({seconds(d / 2)} each)",
            FurtherRun(back),
            both,
        ),
        Procedure(
            f"another rate: {deg_s(other)} for {seconds(d)}",
            FurtherRun((Piece(d, other),)),
            {"kind": "staircase", "rates": [deg_s(other)], "dwell": seconds(d)},
        ),
        Procedure(
            f"a staircase of rates: {', '.join(deg_s(x)[:-6] for x in levels)} deg/s, both ways, {seconds(dwell)} each",
            FurtherRun(staircase(steps, dwell)),
            {"kind": "staircase", "rates": [deg_s(x) for x in steps], "dwell": seconds(dwell)},
        ),
        *_base(same, again),
        *_thermal(recording, slower, d),
    ]
    if any(name.startswith("accel") for name in recording.channels):
        words = f"lean the table's axis by {deg(_LEAN)} deg, and repeat"
        lean = {"table.level_error": [f"{deg(_LEAN)} deg", "0 deg"]}
        found.append(Procedure(words, FurtherRun(same, lean=_LEAN), again, lean))
    longer, texts = slower(_LONGER)
    found.append(Procedure(f"longer dwells: the same rates, {_LONGER:g} times as long", FurtherRun(longer), texts))
    return (*found, Procedure("repeat the run as it was", FurtherRun(same), again, control=True))


def _base(same: Profile, again: Texts | None) -> tuple[Procedure, ...]:
    return (
        Procedure(
            "turn the base by 180 deg and repeat: what follows the Earth stays, what follows the table turns",
            FurtherRun(same, base_turned=_HALF_TURN),
            again,
            {"base_turned": "180 deg"},
        ),
    )


def _thermal(
    recording: Recording, slower: Callable[[float], tuple[Profile, Texts | None]], d: float
) -> tuple[Procedure, ...]:
    """A cycle and a soak of the temperature, where it is recorded; no ramp is faster than a chamber's.

    ``slower(share)`` is what the table or the vehicle did in ``d`` [s], with all that takes time ``share`` as long.
    """
    if "temperature" not in recording.channels:
        return ()
    values = recording.channels["temperature"].values
    low, high = float(np.min(values)), float(np.max(values))
    rise, end = max(high - low, _LEAST_RISE), float(np.mean(values[-max(1, len(values) // 50) :]))
    soak = max(d / 5, rise / _FASTEST_RAMP)
    slope = rise / soak
    levels = [low, low + rise, low]
    told = {
        "kind": "cycle",
        "levels": [celsius(x) for x in levels],
        "slope": f"{slope:.6g} K/s",
        "soak": seconds(soak),
    }
    (pieces, texts), (same, again) = slower(5 * soak / d), slower(1.0)
    return (
        Procedure(
            f"a thermal cycle: {celsius(low)}, {celsius(low + rise)} and back, {seconds(soak)} for each soak and ramp",
            FurtherRun(pieces, temperature=cycle(levels, slope, soak)),
            texts,
            {"temperature": told},
        ),
        Procedure(
            f"a soak: power-up at {celsius(end)}, and that temperature kept; what goes on changing follows time",
            FurtherRun(same, temperature=Constant(end)),
            again,
            {"temperature": {"kind": "constant", "value": celsius(end)}},
        ),
    )


def _vehicle(recording: Recording, turning: TableTurning) -> tuple[Procedure, ...]:
    """For a triad that rests and turns: the last rest takes what is left of the duration."""
    (start, _), (after, _) = turning.rests[:2]
    turn, rest = after - start, min(time for _, time in turning.rests)
    rests = [time for _, time in turning.rests]
    angles = [b[0] - a[0] for a, b in zip(turning.rests[:-1], turning.rests[1:], strict=True)]
    half = turn / 2

    def made(words: str, by: list[float], times: list[float], **other: Any) -> Procedure:
        plan, texts = _turned(turning.rate, by, times, other.get("base_turned", 0.0))
        changes = {"base_turned": f"{deg(plan.base_turned)} deg"} if plan.base_turned else {}
        return Procedure(words, plan, texts, changes, other.get("control", False))

    def slower(share: float) -> tuple[Profile, Texts | None]:
        plan, texts = _turned(turning.rate, angles, [share * time for time in rests])
        return plan.pieces, texts

    each, same = seconds(rest), 3 * [rest]
    return (
        made(f"turn back by the same angle and rest again (0, {deg(turn)}, 0 deg, {each} each)", [turn, -turn], same),
        made(f"a further turn (0, {deg(turn)}, {deg(turn + half)} deg, {each} each)", [turn, half], same),
        made(
            f"park at another heading, {deg(_PARK)} deg off, and repeat: what follows the Earth stays, what follows "
            "the turn angle turns",
            angles,
            rests,
            base_turned=_PARK,
        ),
        *_thermal(recording, slower, turning.duration),
        made(
            f"longer rests, {_LONGER:g} times as long: a warm-up ends, a drift goes on, noise wanders",
            angles,
            [_LONGER * time for time in rests],
        ),
        made("repeat the run as it was, after another power-up", angles, rests, control=True),
    )


def _turned(rate: float, by: list[float], rests: list[float], base: float = 0.0) -> tuple[FurtherRun, Texts]:
    """Turns by angles [rad] between rests [s]: what a table would do, and a vehicle's profile."""
    pieces: list[Piece] = []
    texts = []
    for rest, angle in zip(rests[:-1], by, strict=True):
        pieces += [Piece(rest), Piece(abs(angle) / rate, float(np.copysign(rate, angle)))]
        texts.append([seconds(rest), f"{deg(angle)} deg"])
    return FurtherRun((*pieces, Piece(rests[-1])), base_turned=base), {"kind": "turns", "turns": texts}


def _still(recordings: tuple[Recording, ...]) -> tuple[Procedure, ...]:
    """For what stands at rest, in one position or in several."""
    first = recordings[0]
    d = _length(first)
    same = (Piece(d),)
    rest = {"kind": "rest"}
    found = list(_thermal(first, lambda share: ((Piece(share * d),), rest), d))
    tilts = {r.mounting.tilt for r in recordings}
    if len(tilts) > 1:
        other = 0.0 if all(abs(t) > 0.1 for t in tilts) else float(np.pi / 2)
        names = {f"{deg(t)} deg" for t in tilts}
        words = (
            f"a third position: the input axis at {deg(other)} deg of elevation, beside {' and '.join(sorted(names))}"
        )
        found.append(Procedure(words, FurtherRun(same, tilt=other), rest, {"table.tilt": f"{deg(other)} deg"}))
        back = recordings[0].mounting.tilt
        words = f"go back to the first position, {deg(back)} deg, and rest again: what changed since is no tilt"
        found.append(Procedure(words, FurtherRun(same, tilt=back), rest, {"table.tilt": f"{deg(back)} deg"}))
    longer = f"a longer recording at rest, {_LONGER:g} times as long: {seconds(_LONGER * d)}"
    found.append(Procedure(longer, FurtherRun((Piece(_LONGER * d),)), rest))
    return (*found, Procedure("repeat the run as it was", FurtherRun(same), rest, control=True))


def _table_rates(recording: Recording) -> Floats:
    """The commanded rate, else slopes of the angle over stretches long enough not to show the encoder's noise."""
    if "table_rate" in recording.channels:
        return recording.channels["table_rate"].values
    if "table_angle" in recording.channels and not is_set(recording):
        rows = slice(None, None, max(1, len(recording) // 1000))
        return np.asarray(np.diff(recording.channels["table_angle"].values[rows]) / np.diff(recording.t[rows]))
    return np.zeros(0)


def _dwells(recording: Recording) -> Profile:
    """Stretches of one rate, shorter ones of changing rate left to those before; nothing where they are too many."""
    rates = _table_rates(recording)
    if not len(rates):
        return ()
    step = _length(recording) / len(rates)
    size = max(_SAME_RATE, 0.02 * float(np.abs(rates).max()))
    edges = np.flatnonzero(np.abs(np.diff(rates)) > size) + 1
    parts = np.split(np.arange(len(rates)), edges)
    least = max(3, len(rates) // 500)
    pieces: list[Piece] = []
    for part in parts:
        rate, time = float(np.median(rates[part])), len(part) * step
        if pieces and (len(part) < least or abs(rate - pieces[-1].rate) < size):
            pieces[-1] = Piece(pieces[-1].duration + time, pieces[-1].rate)
        else:
            pieces.append(Piece(time, rate if abs(rate) > _SAME_RATE else 0.0))
    return tuple(pieces) if len(pieces) <= _MOST_DWELLS else ()


def _rests(recording: Recording) -> tuple[tuple[float, float], ...]:
    """Angle [rad] and duration [s] of each stretch in which the table stands still."""
    if "table_angle" not in recording.channels:
        return ()
    angle = recording.channels["table_angle"].values
    still = np.abs(np.diff(angle)) < 1e-9
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    spans = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return tuple((float(angle[a]), (b - a) * recording.dt) for a, b in spans if (b - a) * recording.dt > 1.0)


def _length(recording: Recording) -> float:
    return float(len(recording) * recording.dt)


def _steps(pieces: Profile) -> Texts:
    return {"kind": "steps", "steps": [[seconds(p.duration), deg_s(p.rate)] for p in pieces]}


def deg(angle: float) -> str:
    """An angle or a rate in degrees."""
    return f"{np.rad2deg(angle):.4g}"


def deg_s(rate: float) -> str:
    """A rate in degrees per second, with its unit; ripple makes more digits than three worthless."""
    return f"{np.rad2deg(rate):.3g} deg/s"


def seconds(time: float) -> str:
    """A time with its unit."""
    return f"{time:.4g} s"


def celsius(temperature: float) -> str:
    """A temperature with its unit."""
    return f"{temperature - 273.15:.4g} degC"
