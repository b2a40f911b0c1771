"""Positions: the rests of a triad that is held still in many attitudes.

A rest is a stretch of still windows (`insenv.identify.positions.stillness`) that is long enough, less half a window at
either end, for there the hand is still near, and whose means do not wander. Of what a knock parts, the longest stretch
is the rest: the others are the same attitude, set down once.

That is still enough for the magnitude of gravity, whatever a hand's tremor. What gyros are judged by, the direction
of gravity and the bias, wants more: the longest stretch of each rest in which s(t) stays below a few times the noise of
the quietest windows themselves (`CALM`). Of those few levels the one is taken whose rests tell most: m turns between
rests with a scatter of c quiet levels tell the nine figures of a triad by (m - 4.5) / c^2.

Rests are counted from 1, through all runs. Where the recording has labels (`segment`), each labelled stretch is a rest.

Where the manifest holds nothing out, each rest is held out in turn; where there are hardly more of them
than unknowns, as in the six positions of an ordinary test, each rest is cut into parts, and every second part is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.core.series.robust import robust_deviation
from insenv.core.series.rounding import rounding
from insenv.data.manifest import Manifest
from insenv.data.split import split
from insenv.identify.positions.stillness import (
    WINDOW,
    quiet_levels,
    scatter,
    scatters,
    sizes,
    steady,
    threshold,
    window_rows,
)

#: Least length of what is left of a rest, in windows.
SHORTEST = 2
#: Share of the quiet time of a run in which the means must stay for there to be a rest.
STEADY_SHARE = 0.5
#: Longest time between two stretches that only a knock parts [s], and how far the triad is turned by one [rad].
KNOCK, TURNED = 5.0, 0.05
#: Of a labelled stretch this share may move: a knock does not make it a turn.
MOVING_SHARE = 0.5
#: Scatter, in quiet levels, below which a part of a rest may serve the gyros; white noise reaches 1.5 of them.
CALM = (2.0, 4.0, 8.0, 16.0)
#: Rests below which the manifest's silence means that each is held out in turn; from here on it means the last 40 %.
MANY = 100
#: Parts of a rest where rests are too few to be held out themselves, the fewest of a short one, and fewest rows of one.
PARTS, FEWEST_PARTS, ROWS_OF_PART = 8, 4, 4
#: Robust deviations off a labelled stretch of rows of another label, and the share of it that they may be at an end.
OF_ANOTHER, ENDS = 10.0, 0.1
#: Share of rests too short to be cut from which on none is; below it they are fitted as they are.
MOST_WHOLE = 0.5


@dataclass(frozen=True)
class Rest:
    """Rows ``[start, stop)`` of run ``run`` (from 0) in which the triad stands still; ``held_out`` from every fit."""

    number: int
    run: int
    start: int
    stop: int
    held_out: bool = False

    @property
    def rows(self) -> slice:
        """The rows as a slice."""
        return slice(self.start, self.stop)


@dataclass(frozen=True)
class Rests:
    """The rests that were found, in order, and in sentences what is to be said of them.

    Attributes
    ----------
    rests : tuple of Rest
        Of several with one number each is a part of that rest.
    calm : tuple of Rest
        What of them is calm enough for gyros, one stretch at most of each number.
    in_turn : bool
        Whether each is fitted, and held out in its turn.
    """

    rests: tuple[Rest, ...]
    remarks: tuple[str, ...] = ()
    calm: tuple[Rest, ...] = ()
    in_turn: bool = False

    @property
    def in_parts(self) -> bool:
        """Whether the rests were cut into parts."""
        return len({rest.number for rest in self.rests}) < len(self.rests)


def find_rests(manifest: Manifest, recordings: Sequence[Recording], channels: Sequence[str], least: int = 2) -> Rests:
    """Rests of all runs by the scatter of ``channels``, or by the labels where there are some.

    ``least`` is the number of rests that a fit of the declared model wants: fewer are cut into parts where the manifest
    does not say what is held out.

    Raises
    ------
    InputError
        If there are fewer than two, or what is held out leaves none to fit or none to score.
    """
    found: list[tuple[int, int, int]] = []
    remarks: list[str] = []
    quiet = quiet_levels(recordings, channels)
    scatters = [scatter(recording, channels, quiet) for recording in recordings]
    for run, (recording, s) in enumerate(zip(recordings, scatters, strict=True)):
        stretches, said = _labelled(recording, channels, s) if recording.segments else _still(recording, channels, s)
        found += [(run, start, stop) for start, stop in stretches]
        remarks += said
    if len(found) < 2:
        count = "no rest" if not found else "one rest"
        longest = max((SHORTEST + 2) * window_rows(recording) * recording.dt for recording in recordings)
        wanted = f"wanted several attitudes, each held still for {longest:.2g} s or longer"
        where = f"{count} found in {', '.join(r.label for r in recordings)}"
        why = f" ({'; '.join(remarks)})" if remarks else ""
        raise InputError(f"{manifest.path}: {where}{why}; {wanted}")
    rests = tuple(Rest(number, *where) for number, where in enumerate(found, start=1))
    if _in_turn(manifest, rests):
        calm = _calm(recordings, rests, scatters)
        in_turn = Rests(rests, (_counted(recordings, rests, "each held out in its turn"), *remarks), calm, True)
        if len(rests) >= least:
            return in_turn
        parts = [_parts(recordings[rest.run], rest) for rest in rests]
        whole = sum(len(each) == 1 for each in parts)
        if whole < MOST_WHOLE * len(rests) and manifest.held_out.positions is None:
            short = f", but for {whole} too short for that" if whole else ""
            counts = sorted({len(each) for each in parts if len(each) > 1})
            many = f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else str(counts[0])
            how = f"each cut into {many} parts, every second one held out{short}"
            cut = tuple(chain.from_iterable(parts))
            return replace(in_turn, rests=cut, remarks=(_counted(recordings, rests, how), *remarks))
        return in_turn
    held_out = _held_out(manifest, recordings, rests)
    if held_out.all() or not held_out.any():
        which = "every one" if held_out.all() else "none"
        raise InputError(
            f"{manifest.path}: of {len(rests)} rests {which} is held out; wanted some to fit, some to score"
        )
    used = tuple(replace(r, held_out=bool(h)) for r, h in zip(rests, held_out, strict=True))
    calm = _calm(recordings, used, scatters)
    fitted = sum(not r.held_out for r in used)
    return Rests(used, (_counted(recordings, used, f"{fitted} fitted, {len(used) - fitted} held out"), *remarks), calm)


def _in_turn(manifest: Manifest, rests: Sequence[Rest]) -> bool:
    """Whether each rest is held out in its turn: as the manifest says, or where it says nothing and rests are few."""
    told = manifest.held_out
    if told.positions is not None or told.runs or told.rows or told.start is not None:
        return told.positions == "leave-one-out"
    return len(rests) < MANY and not manifest.fit_rows


def rows_of_parts(recording: Recording) -> int:
    """Rows from which on a rest is long enough to be cut into parts."""
    return FEWEST_PARTS * _rows_of_part(recording)


def _rows_of_part(recording: Recording) -> int:
    """Fewest rows of a part: those of a window, but of slow ones a few tell a scatter too."""
    return max(ROWS_OF_PART, round(WINDOW / recording.dt))


def _parts(recording: Recording, rest: Rest) -> list[Rest]:
    """The rest in parts of equal length, every second one held out; as a whole where it is too short."""
    rows = rest.stop - rest.start
    # As many are fitted as are held out.
    count = min(PARTS, rows // _rows_of_part(recording) // 2 * 2)
    if count < FEWEST_PARTS:
        return [rest]
    length = rows // count
    starts = [rest.start + k * length for k in range(count)]
    return [replace(rest, start=a, stop=a + length, held_out=bool(k % 2)) for k, a in enumerate(starts)]


def _calm(recordings: Sequence[Recording], rests: Sequence[Rest], scatters: Sequence[Floats]) -> tuple[Rest, ...]:
    """The longest calm stretch of each rest, at the level of calm that tells most."""
    best, most = tuple(rests), -np.inf
    for level in CALM:
        found = [_calmest(rest, scatters[rest.run], window_rows(recordings[rest.run]), level) for rest in rests]
        kept = tuple(rest for rest in found if rest is not None)
        if len({rest.held_out for rest in kept}) < len({rest.held_out for rest in rests}):
            continue
        told = (len(kept) - 1 - 4.5) / level**2
        if told > max(most, 0.0):
            best, most = kept, told
    return best


def _calmest(rest: Rest, s: Floats, width: int, level: float) -> Rest | None:
    """The longest stretch of a rest in which the scatter stays below ``level``, less half a window where it ends."""
    stretches = []
    for a, b in _runs(s[rest.rows] < level):
        start = a + (width // 2 if a else 0)
        stop = b - (width // 2 if b < rest.stop - rest.start else 0)
        if stop - start >= SHORTEST * width:
            stretches.append((stop - start, rest.start + start, rest.start + stop))
    if not stretches:
        return None
    _, start, stop = max(stretches)
    return replace(rest, start=start, stop=stop)


def _still(recording: Recording, channels: Sequence[str], s: Floats) -> tuple[list[tuple[int, int]], list[str]]:
    """Stretches that stand still, and what is said of those that are too short or wander."""
    width = window_rows(recording)
    still = s < threshold(s)
    quiet: list[tuple[int, int]] = []
    short = 0
    for piece in recording.pieces():
        for start, stop in _runs(still[piece]):
            # At the ends of a piece nothing moved before or after: only where motion borders half a window goes.
            a = piece.start + start + (width // 2 if start else 0)
            b = piece.start + stop - (width // 2 if stop < piece.stop - piece.start else 0)
            if b - a >= SHORTEST * width:
                quiet.append((a, b))
            elif stop - start >= width:
                short += 1
    said = []
    if short:
        # Half a window is lost at either end twice: as scatter, and as margin.
        least = (SHORTEST + 2) * width * recording.dt
        said.append(f"{short} still {_stretches(short)} left out, shorter than {least:.3g} s")
    kept = [[part for part in steady(recording, channels, a, b) if np.ptp(part) >= SHORTEST * width] for a, b in quiet]
    if sum(np.ptp(part) for parts in kept for part in parts) < STEADY_SHARE * sum(np.ptp(part) for part in quiet):
        said.append("the means wander where it is quietest: there the triad moves")
        kept = []
    elif moving := sum(not parts for parts in kept):
        said.append(f"{moving} {_stretches(moving)} left out in which the means wander: there the triad moves")
    found, again = _set_down(recording, channels, [part for parts in kept for part in parts])
    if again:
        said.append(
            f"{again} {_stretches(again)} left out beside longer ones of the same rest, parted from them by a knock"
        )
    return found, [f"{recording.label}: {text}" for text in said]


def _set_down(
    recording: Recording, channels: Sequence[str], parts: Sequence[tuple[int, int]]
) -> tuple[list[tuple[int, int]], int]:
    """The longest of the stretches between which the triad was only knocked, and how many others there are."""
    groups: list[list[tuple[int, int]]] = []
    for part in parts:
        if groups and _only_knocked(recording, channels, groups[-1][-1], part):
            groups[-1].append(part)
        else:
            groups.append([part])
    return [max(group, key=np.ptp) for group in groups], len(parts) - len(groups)


def _only_knocked(
    recording: Recording, channels: Sequence[str], before: tuple[int, int], after: tuple[int, int]
) -> bool:
    """Whether little time lies between two stretches, and in it neither gravity nor the triad turned."""
    if recording.t[after[0]] - recording.t[before[1] - 1] > KNOCK:
        return False
    x = np.stack([recording.channels[name].values for name in channels])
    level, later = (x[:, slice(*rows)].mean(axis=1) for rows in (before, after))
    accels = np.array([name.startswith("accel") for name in channels])
    turned = (x[~accels, before[1] : after[0]] - level[~accels, None]).sum(axis=1) * recording.dt
    moved = np.abs(later - level) > sizes(channels, level[:, None])
    return not (moved & accels).any() and not (np.abs(turned) > TURNED).any()


def _stretches(count: int) -> str:
    return "stretch" if count == 1 else "stretches"


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches ``[start, stop)`` in which ``mask`` is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _labelled(recording: Recording, channels: Sequence[str], s: Floats) -> tuple[list[tuple[int, int]], list[str]]:
    """Labelled stretches that stand still, and what is said of the others.

    A window that is longer than a stretch tells of its neighbours: a stretch so short is a rest by its label. So is one
    that is louder than the quietest, where readings stand at one coarse step, and by no more than a unit that lies.
    """
    width, limit = window_rows(recording), threshold(s)
    kept, moving, beyond = [], [], 0
    for segment in recording.segments:
        inner = s[segment.start + width // 2 : segment.stop - width // 2 + 1]
        loud = segment.stop - segment.start >= width and float(np.mean(inner >= limit)) > MOVING_SHARE
        if loud and scatters(recording, channels, segment.start, segment.stop):
            moving.append(segment.label)
        else:
            start, stop = _of_label(recording, channels, segment.start, segment.stop)
            beyond += segment.stop - segment.start - (stop - start)
            kept.append((start, stop))
    noun = "segment" if len(moving) == 1 else "segments"
    said = [f"{recording.label}: {noun} {', '.join(moving)} left out: there the triad moves"] if moving else []
    if beyond:
        rows = f"{beyond} row{'s' * (beyond > 1)} at the ends of labelled stretches"
        said.append(f"{recording.label}: {rows} left out: far off the rest of them, as of another label")
    return kept, said


def _of_label(recording: Recording, channels: Sequence[str], start: int, stop: int) -> tuple[int, int]:
    """A labelled stretch without rows at its ends that are far off it: labels come a row early or late."""
    far = np.zeros(stop - start, bool)
    for name in channels:
        values = recording.channels[name].values[start:stop]
        off = np.abs(values - np.median(values))
        far |= off > OF_ANOTHER * max(robust_deviation(off), rounding(values))
    ends = int(ENDS * len(far))
    first, last = np.flatnonzero(far[:ends]), np.flatnonzero(far[len(far) - ends :])
    return start + (int(first[-1]) + 1 if len(first) else 0), stop - (ends - int(last[0]) if len(last) else 0)


def _held_out(manifest: Manifest, recordings: Sequence[Recording], rests: Sequence[Rest]) -> NDArray[np.bool_]:
    """Which rests no fit may see, shape (rests,): by number, else where the row in the middle is held out."""
    named = manifest.held_out.positions
    numbers = np.array([rest.number for rest in rests])
    if isinstance(named, str):
        return numbers % 2 == (named == "odd")
    if named is not None:
        if beyond := [number for number in named if number > len(rests)]:
            where = f"{manifest.path}: held_out.positions has {beyond[0]}"
            raise InputError(f"{where}; there are {len(rests)} rests, counted from 1")
        return np.isin(numbers, named)
    uses = split(manifest, recordings)
    return np.array([bool(uses[r.run].held_out[(r.start + r.stop) // 2]) for r in rests])


def _counted(recordings: Sequence[Recording], rests: Sequence[Rest], used: str) -> str:
    if all(r.stop - r.start == 1 for r in rests):
        return f"{len(rests)} rests of one row each: {used}"
    lengths = [(r.stop - r.start) * recordings[r.run].dt for r in rests]
    span = f"{min(lengths):.3g} to {max(lengths):.3g} s long"
    return f"{len(rests)} rests, {span}: {used}"


def means(recordings: Sequence[Recording], rests: Sequence[Rest], prefix: str) -> Floats:
    """Means of the triad ``prefix`` ("accel", "gyro") over each rest, shape (rests, 3)."""
    triads = [np.stack([r.channels[f"{prefix}_{axis}"].values for axis in "xyz"], axis=1) for r in recordings]
    return np.array([triads[rest.run][rest.rows].mean(axis=0) for rest in rests])


def middle_times(recordings: Sequence[Recording], rests: Sequence[Rest]) -> Floats:
    """Time of the middle of each rest from the start of its run [s], shape (rests,)."""
    return np.array([recordings[r.run].t[r.rows].mean() - recordings[r.run].t[0] for r in rests])
