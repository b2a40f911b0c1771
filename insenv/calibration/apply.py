"""Taking what a calibration explains out of a recording.

    x = y - sum_i e_i(u, motion; theta_i)        u: input rate of the references; without them u = x, iterated:
    x <- y - sum_i e_i(x, motion(x); theta_i)    from x = y until nothing moves

An error of the reference is added to the reference instead: with y = p r + e and the share p of the table's rate r that
the axis sees, r is wrong by e / p, and the table's angle by the integral of that.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.calibration.contents import Contents, Target, Term
from insenv.calibration.rules import why_kept
from insenv.calibration.triads import whole_triads
from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Recording
from insenv.data.exposure import Exposure, expose
from insenv.data.fingerprint import fingerprint
from insenv.effects.base import Effect
from insenv.effects.timing import SampleHold
from insenv.identify.clean.holds import held_addition

#: Corrections at the output itself: passes at most, and the share of the largest reading at which they have settled.
PASSES, SETTLED = 100, 1e-12
_TABLE = ("table_angle", "table_rate")


@dataclass(frozen=True)
class Said:
    """A term of a target and, where it was left, why; ``channel`` is the one that was corrected."""

    target: str
    effect: str
    channel: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Applied:
    """A corrected recording, what was taken out, and what was left.

    ``run`` is the run of the calibration that this recording is, counted from 1; None: another recording.
    """

    recording: Recording
    run: int | None
    taken: tuple[Said, ...]
    left: tuple[Said, ...]


@dataclass(frozen=True)
class _Held:
    """A term that holds for the recording: its effect and parameters."""

    term: Term
    effect: Effect
    theta: Floats
    phase: float = 0.0

    def addition(self, u: Floats, motion: Motion) -> Floats:
        if self.effect.id == SampleHold.id:
            return held_addition(u, motion, self.theta, self.phase)
        return self.effect.apply(u, motion, self.theta, self.effect.begin(motion, self.theta))[0]


def apply(calibration: Contents, recording: Recording) -> Applied:
    """Take the terms that hold out of every target that the recording has."""
    run = _run(calibration, recording)
    targets = [t for t in calibration.targets if t.target in recording.channels]
    if not targets:
        wanted = " or ".join(repr(t.target) for t in calibration.targets)
        raise InputError(f"{recording.label}: no channel that the calibration is of; wanted {wanted}")
    if calibration.with_earth and recording.site.latitude is None:
        raise InputError(f"{recording.label}: the calibration declares the Earth's rate; wanted site.latitude")
    channels = dict(recording.channels)
    taken: list[Said] = []
    left: list[Said] = []
    triads: dict[str, tuple[Sequence[_Held], Exposure]] = {}
    for target in targets:
        exposure = _exposed(calibration, recording, target)
        held, refused = _sorted(target, run, exposure)
        left += refused
        readings = [h for h in held if h.effect.belongs != "reference"]
        triads[target.target] = readings, exposure
        channels[target.target] = _corrected(recording, target, exposure, readings, run)
        taken += [Said(target.target, h.term.effect, target.target) for h in readings]
        for h in held:
            if h not in readings:
                _reference(recording, channels, target, exposure, h, taken, left)
    channels |= whole_triads(recording, triads)
    return Applied(replace(recording, channels=channels), run, tuple(taken), tuple(left))


def is_determined(term: Term) -> bool:
    """Whether the parameters say what a term adds: not of a line without a phase."""
    return bool(term.parameters) and not (term.is_line and all(p.name != "phase" for p in term.parameters))


def rows_of(term: Term, recording: Recording, exposure: Exposure, run: int) -> Floats:
    """What a term adds to the rows of a target in run ``run``, counted from 1, whatever its cause: shape (rows,).

    Zero where it is not `told`, or of other runs.
    """
    if not is_determined(term) or (term.runs and run not in term.runs):
        return np.zeros(len(recording))
    if term.is_line:
        return _line(recording, term)
    effect, theta = term.made(), term.theta(run)
    held = _Held(term, effect.near(theta), theta, term.phase(run))
    return of_rows(held.addition(exposure.u, exposure.motion), exposure)


def slopes_of(term: Term, recording: Recording, exposure: Exposure, run: int) -> Floats:
    """Derivative of `rows_of` to each parameter of the effect, shape (rows, p); p = 0 where it is not `told`."""
    if not is_determined(term) or term.is_line:
        return np.zeros((len(recording), 0))
    effect, theta = term.made(), term.theta(run)
    jacobian = effect.near(theta).jacobian(exposure.u, exposure.motion, theta)
    return np.stack([of_rows(column, exposure) for column in np.moveaxis(jacobian, -1, 0)], axis=-1)


def _run(calibration: Contents, recording: Recording) -> int | None:
    mark = fingerprint(recording)
    return next((i for i, run in enumerate(calibration.runs, start=1) if run.sha256 == mark), None)


def _exposed(calibration: Contents, recording: Recording, target: Target) -> Exposure:
    recording.values(target.target, target.unit)
    reference = calibration.reference_temperature
    return expose(recording, target.target, 1, reference, calibration.with_earth)


def _sorted(target: Target, run: int | None, exposure: Exposure) -> tuple[list[_Held], list[Said]]:
    """Terms that hold, and those that are left with the reason."""
    held: list[_Held] = []
    left: list[Said] = []
    for term in target.terms:
        effect = term.made()
        reason = why_kept(term, effect, run, exposure)
        if reason:
            left.append(Said(target.target, term.effect, reason=reason))
        else:
            held.append(_Held(term, effect.near(term.theta(run)), term.theta(run), term.phase(run)))
    return held, left


def _corrected(
    recording: Recording, target: Target, exposure: Exposure, held: Sequence[_Held], run: int | None
) -> Channel:
    """The target's channel without what ``held`` adds to it."""
    channel = recording.channels[target.target]
    curves = [h for h in held if not h.term.is_line]
    told = run is not None or any(name in recording.channels for name in _TABLE)
    if told or not any(h.effect.of_rate for h in curves):
        total = _sum(curves, exposure.u, exposure.motion)
    else:
        total = exposure.y - _settled(exposure, curves, f"{recording.label}: {target.target}")
    values = channel.values - of_rows(total, exposure)
    for h in held:
        if h.term.is_line:
            values = values - _line(recording, h.term)
    return replace(channel, values=values)


def _sum(held: Iterable[_Held], u: Floats, motion: Motion) -> Floats:
    return sum((h.addition(u, motion) for h in held), np.zeros(motion.n))


def _settled(exposure: Exposure, held: Sequence[_Held], where: str) -> Floats:
    """The input at which the model gives the output: a fixed point."""
    y, x = exposure.y, exposure.y
    enough = SETTLED * float(np.abs(y).max(initial=0.0))
    moved = np.inf
    for _ in range(PASSES):
        edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
        new = y - _sum(held, x, replace(exposure.motion, rate=x, rate_edges=edges))
        moved = float(np.abs(new - x).max(initial=0.0))
        x = new
        if not np.isfinite(moved) or moved <= enough:
            break
    if not moved <= enough:
        keys = ", ".join(h.term.effect for h in held if h.effect.of_rate)
        raise InputError(
            f"{where}: {keys} cannot be taken out at the output itself (after {PASSES} passes it still moves by "
            f"{moved:.3g} rad/s); wanted a recording with table_angle or table_rate, or rates at which the errors are "
            "small"
        )
    return x


def of_rows(cells: Floats, exposure: Exposure) -> Floats:
    """Values of the rows, shape (rows,), of those of the cells; a row of no cell lies between its neighbours."""
    cell = exposure.cell_of_row
    whole = np.flatnonzero(cell >= 0)
    return np.interp(np.arange(len(cell)), whole, cells[cell[whole]])


def _line(recording: Recording, term: Term) -> Floats:
    """A steady line above the bin rate, at the times of the rows."""
    value = {p.name: p.value for p in term.parameters}
    t = recording.t - recording.t[0]
    return value["amplitude"] * np.cos(2 * np.pi * value["f"] * t + value["phase"])


def _reference(
    recording: Recording,
    channels: dict[str, Channel],
    target: Target,
    exposure: Exposure,
    held: _Held,
    taken: list[Said],
    left: list[Said],
) -> None:
    """Correct the table's angle, or its rate where no angle is logged; once, whatever number of targets shows it."""
    effect, motion = held.term.effect, exposure.motion
    name = next((n for n in _TABLE if n in recording.channels), "")
    reason = ""
    if any(said.effect == effect and said.channel == name for said in taken):
        reason = "the reference is corrected already"
    elif not name or not motion.projection:
        reason = "there is no reference to correct"
    if reason:
        left.append(Said(target.target, effect, reason=reason))
        return
    rate = held.addition(exposure.u, motion) / motion.projection
    own, channel = recording.channels[target.target], channels[name]
    late = own.delay + (0.5 * recording.dt if own.covers == "interval" else 0.0)
    inside = exposure.cell_of_row >= 0
    start = float(np.median((recording.t - late)[inside] - motion.middle[exposure.cell_of_row[inside]]))
    times = recording.t - channel.delay
    if name == "table_angle":
        angle = np.concatenate([[0.0], np.cumsum(rate) * motion.dt])
        change = np.interp(times, start + motion.t, angle)
    else:
        change = np.interp(
            times - (0.5 * recording.dt if channel.covers == "interval" else 0.0), start + motion.middle, rate
        )
    channels[name] = replace(channel, values=channel.values + change)
    taken.append(Said(target.target, effect, name))
