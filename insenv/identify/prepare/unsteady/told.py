"""What is said of rows that are not steady: when, at which frequencies, and how many times the noise.

Means over many rows know little of it, and their fit nothing. It is there, no effect has it, and it is no noise of one
level either: a doubt of "only noise is left".
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from insenv.identify.prepare.unsteady.flips import flips
from insenv.identify.prepare.unsteady.loud import Loud, loud, quiet
from insenv.identify.prepare.unsteady.motion import of_steps, with_motion, without_motion
from insenv.identify.prepare.unsteady.moving import ridges
from insenv.identify.prepare.unsteady.pulses import pulses
from insenv.identify.prepare.unsteady.spectrogram import RowsLeft, Spectrogram, lengths, spectrogram, white

#: Probability from which on it is said, in any rows of a target.
SAID = 1e-5
#: Ways to look at the cells of one length: for what is louder, for what is quieter, for lines.
LOOKS = 3
#: Lowest frequency that is looked at, in judged means: what is slower is theirs.
SLOWEST = 0.125
#: Events that are said of one run; share of a run from which on noise has two levels, and no event.
MOST, LONG = 3, 0.125
#: How many times as much the logarithm of a line's probability counts as that of a band; frequencies by which two parts
#: of a line may be apart; share of both by which two parts of a disturbance are; probability below which none is told.
LINE, APART, BETWEEN, LEAST = 2.0, 3.0, 0.25, 1e-100
#: The same of noise that goes with the rate, which dwells make one of some stretches of time.
MOVED = 2.0


@dataclass(frozen=True)
class Event:
    """What is louder, or quieter, than the rest of a run.

    Attributes
    ----------
    log_p : float
    start, stop : float
        Time from the start of the run [s].
    first, last : float
        Of a band its edges, of a line its frequency at the start and at the end [Hz].
    power : float
        Ratio of its power to that of the noise there.
    line : bool
    step : float
        Width of a cell [Hz].
    """

    log_p: float
    start: float
    stop: float
    first: float
    last: float
    power: float
    line: bool
    step: float


def unsteady(runs: Sequence[RowsLeft], width: float) -> tuple[str, ...]:
    """Sentences on what changes in the rows of one target whose means over ``width`` seconds are judged."""
    said: list[str] = []
    for left in runs:
        where = f" of run {left.run + 1}" if len(runs) > 1 else ""
        said += (f"the rows{where} hold {text}" for text in _of_run(left, width))
    return tuple(said)


def _of_run(left: RowsLeft, width: float) -> Iterable[str]:
    if (two := flips(left, width)) is not None:
        likelier, times = two.log_odds / math.log(10), two.apart / two.spread
        yield (
            f"two levels, {times:.2g} times the noise of means over {two.seconds:.2g} s apart, and go from one to the "
            f"other {two.rate:.2g} times a second (1e{likelier:.0f} times as likely as Gaussian noise)"
        )
    made = white(left)
    if made is None:
        return
    again = pulses(made)
    if again is not None and again.log_p < math.log(SAID):
        yield (
            f"pulses that come every {again.interval:.6g} s, {again.times:.2g} times the noise of a row and "
            f"{again.length:.2g} s long ({_chance(again.log_p)})"
        )
    left = made.left
    seen = [one for rows in lengths(len(made.rows)) if (one := spectrogram(made, rows, SLOWEST / width)) is not None]
    if not seen:
        return
    level = SAID / (LOOKS * len(seen))
    found, moved = _found(seen, left, level), with_motion(seen[0], left)
    surest = min((one.log_p for one in found if not one.line), default=0.0)
    if moved is not None and moved.log_p < math.log(level) and MOVED * moved.log_p < surest:
        if not of_steps(moved, left):
            where = "while the table turns" if moved.rests else "where the table turns faster"
            whose = "" if left.commanded else ", of the reading or of the reference"
            yield f"{math.sqrt(moved.times):.2g} times as much noise {where}{whose} ({_chance(moved.log_p)})"
        found = _found([without_motion(one, left) for one in seen], left, level)
    length = left.dt * len(left.values)
    yield from (_text(event, length) for event in found[:MOST])
    if len(found) > MOST:
        yield f"{len(found) - MOST} more such stretches"


def _found(seen: Sequence[Spectrogram], left: RowsLeft, level: float) -> list[Event]:
    """What is louder than the rest of a run; of a unit at rest that is loud most of the time what is quieter."""
    found = [event for one in seen for event in (*_bands(one, left, loud(one, level)), *_lines(one, left, level))]
    if not found and left.rate is None:
        found = [event for one in seen for event in _bands(one, left, quiet(one, level))]
    return events(found)


def _bands(one: Spectrogram, left: RowsLeft, windows: Iterable[Loud]) -> Iterable[Event]:
    step = 1 / (one.rows * left.dt)
    for window in windows:
        start, stop = one.seconds(window.segment, window.count, left)
        low, high = one.hertz(window.low - 0.5, left), one.hertz(window.high - 0.5, left)
        yield Event(window.log_p, start, stop, low, high, window.times, False, step)


def _lines(one: Spectrogram, left: RowsLeft, level: float) -> Iterable[Event]:
    step = 1 / (one.rows * left.dt)
    for track in ridges(one, level):
        start, stop = one.seconds(track.segment, track.count, left)
        first, last = one.hertz(track.column, left), one.hertz(track.column + track.change, left)
        yield Event(track.log_p, start, stop, first, last, track.times, True, step)


def events(found: Sequence[Event]) -> list[Event]:
    """The likeliest of what was found at each time, with its parts joined, in order of time."""
    left, kept = sorted(found, key=_rank), list[Event]()
    while left:
        best = left[0]
        if best.line:
            best = _joined(best, [one for one in left if one.line])
        kept.append(best)
        left = [one for one in left if one.stop <= best.start or one.start >= best.stop]
    kept.sort(key=lambda one: one.start)
    together = kept[:1]
    for one in kept[1:]:
        if _goes_on(together[-1], one):
            surest = min(together[-1], one, key=_rank)
            together[-1] = replace(surest, start=together[-1].start, stop=one.stop)
        else:
            together.append(one)
    return together


def _rank(one: Event) -> float:
    """Surest first; a line, which is one of many frequencies, where it has a good part of the evidence of a band."""
    return one.log_p * (LINE if one.line else 1.0)


def _goes_on(before: Event, after: Event) -> bool:
    """Whether two bands are one disturbance: one begins where the other ends, and they share frequencies."""
    near = after.start - before.stop < BETWEEN * (after.stop - before.start)
    return near and not (before.line or after.line) and before.first < after.last and after.first < before.last


def _joined(line: Event, parts: Sequence[Event]) -> Event:
    """A line with other parts of it, which go on where it begins or ends."""
    grown = True
    while grown:
        grown = False
        for one in parts:
            near = APART * max(line.step, one.step)
            reach = 0.5 * min(line.stop - line.start, one.stop - one.start)
            surest = min(line.log_p, one.log_p)
            if one.stop > line.stop and abs(one.start - line.stop) < reach and abs(one.first - line.last) < near:
                line, grown = replace(line, stop=one.stop, last=one.last, log_p=surest), True
            elif one.start < line.start and abs(one.stop - line.start) < reach and abs(one.last - line.first) < near:
                line, grown = replace(line, start=one.start, first=one.first, log_p=surest), True
    return line


def _text(one: Event, length: float) -> str:
    at, chance = f"at {one.start:.1f} to {one.stop:.1f} s", _chance(one.log_p)
    if one.line and abs(one.last - one.first) > 2 * one.step:
        return f"a line that moves from {one.first:.3g} to {one.last:.3g} Hz {at} ({chance})"
    if one.line:
        return f"a line at {one.first:.3g} Hz that comes and goes, {at} ({chance})"
    band, times = f"{one.first:.2g} to {one.last:.2g} Hz", f"{math.sqrt(one.power):.2g} times"
    if one.power < 1:
        return f"{math.sqrt(1 / one.power):.2g} times less noise {at} than at other times, {band} ({chance})"
    if one.stop - one.start > LONG * length:
        return f"{times} as much noise {at} as at other times, {band} ({chance})"
    return f"a disturbance {at}, {band}, {times} the noise ({chance})"


def _chance(log_p: float) -> str:
    return f"p = {math.exp(log_p):.1g}" if log_p > math.log(LEAST) else f"p < {LEAST:g}"
