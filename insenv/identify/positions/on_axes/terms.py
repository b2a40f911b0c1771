"""What a unit on a table may have and do: terms of the instruments, of the table, and of the unit's seat on it.

A term is one cause on the three axes of a triad, with coefficients of each axis its own or tied (`triad_term`), or an
error of the table that all six channels see. Errors of a table are written once, in `insenv.core.unit.gimbals`; here
they get their names. A unit that slips on its mount is the mounting from a turn on; a thermal lag has time constants
that are tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.estimate import Datasheet, Declared
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.core.unit.gimbals import Gimbals
from insenv.core.unit.motion import ACCELEROMETERS, GYROS, UNIT
from insenv.effects.base import Instrument, LinearEffect, Param
from insenv.effects.bias import Bias
from insenv.effects.catalogue import ALL, by_key
from insenv.effects.cross import CrossAxis
from insenv.effects.thermal import BiasThermalLag
from insenv.effects.triad import AccelBias, Misalignment, NonOrthogonality
from insenv.identify.positions.model import triad_term
from insenv.identify.positions.on_axes.problem import Cause, Share, UnitTerm

#: Instruments by the kind of their channels.
INSTRUMENTS: Mapping[str, Instrument] = {"gyro": "gyro", "accel": "accelerometer"}


def effects_of(kind: str, warm: bool = True) -> tuple[LinearEffect, ...]:
    """Effects of a kind of channel that rests and turns tell; of the temperature those alone that are ``warm``."""
    return tuple(
        effect
        for effect in ALL
        if isinstance(effect, LinearEffect)
        and INSTRUMENTS[kind] in effect.on_axes
        and getattr(effect, "order", 1) == 1
        and (warm or "temperature" not in effect.needs)
    )


def able() -> set[str]:
    """Ids of all that may be declared."""
    return {effect.id for kind in INSTRUMENTS for effect in effects_of(kind)}


#: Time constants of a thermal lag that are tried [s], and the least change of temperature by which one is told [K].
LAGS, _CHANGES = (30.0, 100.0, 300.0, 1000.0), 0.1
#: What a unit that moves on the table is.
SLIP = "mounting_shift"
#: Errors of a table by name: what their names in `Gimbals.names` begin with.
_TABLE: Mapping[str, tuple[str, ...]] = {
    "unit_mounting": ("mounting.",),
    "base_level": ("base.tilt",),
    "base_heading": ("base.heading",),
    "axis_non_orthogonality": ("axes_",),
    "encoder_eccentricity": ("encoder_",),
}
_ANGLE = Param("c", "rad", sd=1e-3, bound=0.1)


@dataclass(frozen=True)
class Candidates:
    """All terms of a unit, and how their columns come from those of its linear model.

    Attributes
    ----------
    declared, tried : tuple of UnitTerm
    made : tuple of callable
        Of each column: from the cells of a channel, its values.
    """

    declared: tuple[UnitTerm, ...]
    tried: tuple[UnitTerm, ...]
    made: tuple[Callable[[Raw], Floats], ...]


@dataclass(frozen=True)
class Raw:
    """A channel of a run before terms are made of it.

    Attributes
    ----------
    channel : str
    columns : mapping of str to ndarray, shape (m,)
        By the names of the linear model's parameters.
    time : ndarray, shape (m,)
        From the start of the first run [s].
    lagged : mapping of float to ndarray, shape (m,)
        Mean excess of the temperature over one with that lag [K].
    """

    channel: str
    columns: Mapping[str, Floats]
    time: Floats
    lagged: Mapping[float, Floats]

    @property
    def zero(self) -> Floats:
        """No addition."""
        return np.zeros(len(self.time))


def whole_sheet(sheet: Datasheet, warm: bool) -> Datasheet:
    """The datasheet with everything that may be found declared, each coefficient with a deviation of one."""
    declared = []
    for target in UNIT:
        for effect in effects_of(target.partition("_")[0], warm):
            p = len(effect.linear)
            declared.append(Declared(effect.key, target, (0.0,) * p, (1.0,) * p))
    gimbals = sheet.mounting.gimbals
    assert gimbals is not None
    open_table = replace(gimbals, sd=(1.0,) * len(gimbals.names))
    return replace(sheet, declared=tuple(declared), mounting=replace(sheet.mounting, gimbals=open_table))


def candidates(
    declared: Sequence[str], gimbals: Gimbals, slips: Sequence[float], keys: Sequence[str] | None, warm: bool
) -> Candidates:
    """Terms of effects that are ``declared``, and of all others (of ``keys``, if given); ``slips`` are times [s]."""
    there = {by_key(key).id for key in declared}
    if Bias.id in there:
        there.add(AccelBias.id)
    parts, whole = {NonOrthogonality.id, Misalignment.id}, CrossAxis.id
    # All that a gyro sees of the other axes, or its parts: where neither is declared the whole is tried.
    without = {whole} if there & parts else parts
    without = without | parts if whole in there else without
    made: list[Callable[[Raw], Floats]] = []
    stated, tried = list[UnitTerm](), list[UnitTerm]()
    for term, columns in [*_of_instruments(warm), *_of_table(gimbals), *_slips(slips), *_lags(warm)]:
        own = term.effect.kind != "table" and term.effect.id in there
        if term.effect.kind == "gyro" and not own and term.effect.id in without:
            continue
        if not own and keys is not None and term.effect.id not in keys:
            continue
        at = tuple(range(len(made), len(made) + len(columns)))
        made += columns
        (stated if own else tried).append(UnitTerm(term.effect, at, term.shares, term.shape))
    return Candidates(tuple(stated), tuple(tried), tuple(made))


_Made = tuple[UnitTerm, list[Callable[[Raw], Floats]]]


def _of_instruments(warm: bool) -> Iterator[_Made]:
    for kind, targets in (("gyro", GYROS), ("accel", ACCELEROMETERS)):
        unit = "rad/s" if kind == "gyro" else "m/s^2"
        for effect in effects_of(kind, warm):
            shares, columns = [], []
            for coefficient in triad_term(effect).coefficients:
                places = [(targets[axis], effect.linear[k], factor) for axis, k, factor in coefficient.shares]
                shares.append(tuple(Share(c, p.name, p.unit_on(unit), factor) for c, p, factor in places))
                columns.append(_sum([(f"{c}.{effect.key}.{p.name}", factor) for c, p, factor in places]))
            yield UnitTerm(Cause(kind, effect.id, effect.linear), (), tuple(shares)), columns


def _of_table(gimbals: Gimbals) -> Iterator[_Made]:
    for name, heads in _TABLE.items():
        own = [n for n in gimbals.names if n.startswith(heads)]
        shares = tuple((Share("", n, "rad"),) for n in own)
        yield UnitTerm(Cause("table", name, (_ANGLE,)), (), shares), [_sum([(n, 1.0)]) for n in own]


def _slips(times: Sequence[float]) -> Iterator[_Made]:
    for t in times:
        shares = tuple((Share("", f"mounting.{a}", "rad"),) for a in "xyz")
        columns = [_after(f"mounting.{a}", t) for a in "xyz"]
        yield UnitTerm(Cause("table", SLIP, (_ANGLE,)), (), shares, t), columns


def _lags(warm: bool) -> Iterator[_Made]:
    effect = BiasThermalLag()
    for tau in LAGS if warm else ():
        for kind, targets in (("gyro", GYROS), ("accel", ACCELEROMETERS)):
            unit = effect.linear[0].unit_on("rad/s" if kind == "gyro" else "m/s^2")
            shares = tuple((Share(c, "c", unit),) for c in targets)
            yield UnitTerm(Cause(kind, effect.id, effect.linear), (), shares, tau), [_lagged(c, tau) for c in targets]


def _sum(names: Sequence[tuple[str, float]]) -> Callable[[Raw], Floats]:
    def column(raw: Raw) -> Floats:
        return np.asarray(sum((f * raw.columns[n] for n, f in names if n in raw.columns), raw.zero), float)

    return column


def _after(name: str, t: float) -> Callable[[Raw], Floats]:
    return lambda raw: np.where(raw.time >= t, raw.columns[name], 0.0)


def _lagged(channel: str, tau: float) -> Callable[[Raw], Floats]:
    return lambda raw: raw.lagged[tau] if raw.channel == channel else raw.zero


def excess(t: Floats, temperature: Floats, reference: float) -> dict[float, Floats]:
    """Mean excess of the temperature over one with each of `LAGS` on n intervals, edges of shape (n + 1,)."""
    motion = Motion(t=t, rate=np.zeros(len(t) - 1), temperature=temperature, reference_temperature=reference)
    effect = BiasThermalLag()
    return {tau: effect.curve(motion.rate, motion, np.array([1.0, tau])) for tau in LAGS}


def changes(temperature: Floats) -> bool:
    """Whether a temperature changes by so much that effects of it are told."""
    return bool(np.ptp(temperature) > _CHANGES)
