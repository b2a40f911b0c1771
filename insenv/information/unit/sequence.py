r"""Sequences of positions for a whole unit: what they tell of every parameter, and the search for better ones.

    M(sequence) = sum over visits of M_turn(from, to) + seconds M_rest(at)

is nearly additive, for noise that is white; with that a search tries thousands of sequences in seconds. What is stated
of a sequence is of the full model (`told`): all motion planned, slow noise over all of it. As the model is linear and
Gaussian no datum changes what the next one tells: the best sequence is known before the first measurement, and what
looks ahead (`greedy`) does so beforehand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats
from insenv.core.unit.gimbals import turn_time
from insenv.core.unit.turns import Turns, at_rest, turned
from insenv.information.positions import Angles, right_angles
from insenv.information.unit.calibration import BLOCK, Blocks, Samples, UnitModel
from insenv.information.unit.shares import shared

#: Sampling with which motion is planned [Hz], and rest whose information stands for each of its seconds [s].
_SAMPLING, _REST = 10.0, 20
#: Steps for the rests of an order that is changed, and of one that is new.
_STEPS, _FIRST_STEPS = 10, 300


@dataclass(frozen=True)
class Visit:
    """A position, angles of the axes [rad], and the rest there [s]."""

    angles: Angles
    dwell: float


@dataclass(frozen=True)
class Planner:
    """Information of turns and rests of a unit on its table, in units of the prior deviations.

    Attributes
    ----------
    datasheet : Datasheet
    """

    datasheet: Datasheet
    _turns: dict[tuple[Angles, Angles], tuple[Floats, float]] = field(default_factory=dict, repr=False, compare=False)
    _rests: dict[Angles, Floats] = field(default_factory=dict, repr=False, compare=False)
    _models: list[UnitModel] = field(default_factory=list, repr=False, compare=False)

    @property
    def model(self) -> UnitModel:
        """The model at the sampling with which motion is planned; white noise is per second."""
        if not self._models:
            self._models.append(UnitModel(replace(self.datasheet, sampling=_SAMPLING)))
        return self._models[0]

    def turn(self, a: Angles, b: Angles) -> tuple[Floats, float]:
        """What the turn from one position to another tells, shape (p, p), and its time in whole blocks [s]."""
        if (a, b) not in self._turns:
            limits = self.datasheet.limits
            time = float(turn_time(np.subtract(b, a), limits.rate, limits.acceleration).sum())
            whole = BLOCK * np.ceil(time / BLOCK - 1e-9)
            told = (
                self._information(a, [Visit(b, 0.0)], whole) if whole else np.zeros(2 * (len(self.model.parameters),))
            )
            self._turns[a, b] = told, whole
        return self._turns[a, b]

    def rest(self, at: Angles) -> Floats:
        """What a second of rest tells, shape (p, p)."""
        if at not in self._rests:
            self._rests[at] = self._information(at, [Visit(at, _REST)], _REST) / _REST
        return self._rests[at]

    def quick(self, visits: Sequence[Visit]) -> Floats:
        """Sum over turns and rests, shape (p, p)."""
        p = len(self.model.parameters)
        total, now = np.zeros((p, p)), (0.0,) * len(self.model.gimbals.axes)
        for visit in visits:
            total = total + self.turn(now, visit.angles)[0] + visit.dwell * self.rest(visit.angles)
            now = visit.angles
        return total

    def time(self, visits: Sequence[Visit]) -> float:
        """That a sequence takes [s], turns in whole blocks."""
        now, total = (0.0,) * len(self.model.gimbals.axes), 0.0
        for visit in visits:
            total += self.turn(now, visit.angles)[1] + visit.dwell
            now = visit.angles
        return total

    def deviations(self, visits: Sequence[Visit], time: float | None = None) -> Floats:
        """Deviation of every parameter after a sequence by the full model, as a share of the prior, shape (p,)."""
        length = self.time(visits) if time is None else time
        matrix = self._information((0.0,) * len(self.model.gimbals.axes), visits, float(length))
        return deviations(matrix)

    def _information(self, start: Angles, visits: Sequence[Visit], time: float) -> Floats:
        matrix, _ = self.model.information(self.planned(start, visits, time))
        return matrix[0]

    def planned(self, start: Angles, visits: Sequence[Visit], time: float) -> Blocks:
        """Blocks of planned motion, of ``time`` seconds from rest at ``start``; outputs are zero."""
        dt, limits = 1 / _SAMPLING, self.datasheet.limits
        state, now, parts = at_rest(np.array(start)[None]), 0, []
        total = round(time / BLOCK) * self.model.size
        for visit in visits:
            t = (now + np.arange(2.0)) * dt
            begun = turned(replace(state, free=np.zeros(1)), *_command(visit, limits.rate), limits.acceleration, t)
            end = min(total, int(self.model.size * np.ceil(float(begun.free[0]) / dt / self.model.size - 1e-9)))
            if end > now:
                parts.append(_course(begun, np.arange(now, end + 1.0) * dt))
                now = end
            state = begun
        if now < total:
            parts.append(_course(state, np.arange(now, total + 1.0) * dt))
        angles, turning = (np.concatenate([part[i] for part in parts], axis=-1) for i in (0, 1))
        before = np.repeat(np.array(start)[None, :, None], 3, axis=-1)
        n = angles.shape[-1]
        warmth = np.full((1, n + 1), self.datasheet.reference_temperature)
        flags = np.concatenate([np.zeros((1, 1)), turning], axis=-1)
        readings = np.concatenate([before, angles], axis=-1)
        return self.model.blocks(Samples(np.zeros((1, 6, n)), readings, flags, warmth, 0))


def _command(visit: Visit, rate: float) -> tuple[Floats, Floats, Floats]:
    return np.array(visit.angles)[None], np.array([rate]), np.array([visit.dwell])


def _course(state: Turns, t: Floats) -> tuple[Floats, Floats]:
    """Angles at the ends of samples, shape (1, k, n), and whether an axis turns in them, shape (1, n)."""
    return state.at(t[1:])[0], state.moving(t)


def even(planner: Planner, positions: Sequence[Angles], time: float) -> tuple[Visit, ...]:
    """Positions one after the other, each for the same share of the time, the turn to it included."""
    before = [(0.0,) * len(planner.model.gimbals.axes), *positions[:-1]]
    share = time / len(positions)
    pairs = zip(before, positions, strict=True)
    return tuple(Visit(b, max(share - planner.turn(a, b)[1], 0.0)) for a, b in pairs)


def deviations(matrix: Floats) -> Floats:
    """Standard deviations as shares of the prior, shape (p,), of information in units of it."""
    left: Floats = np.sqrt(np.diag(np.linalg.inv(np.eye(len(matrix)) + matrix)))
    return left


def neighbours(angles: Angles, able: Sequence[Angles]) -> list[Angles]:
    """Positions that differ in one axis."""
    return [b for b in able if sum(abs(x - y) > 1e-9 for x, y in zip(angles, b, strict=True)) == 1]


def greedy(planner: Planner, time: float, dwell: float = 20.0, ahead: int = 1) -> tuple[Visit, ...]:
    """At each position the neighbour that begins what tells most by the second, until time is up.

    Parameters
    ----------
    planner : Planner
    time : float
        [s]
    dwell : float
        Rest at each position [s].
    ahead : int
        Positions, each a neighbour of the one before, whose turns and rests are looked at together.
    """
    able = right_angles(planner.model.gimbals)
    q = sum(not parameter_of_table(p.name) for p in planner.model.parameters)
    now: Angles = (0.0,) * len(planner.model.gimbals.axes)
    found = [Visit(now, dwell)]
    matrix = planner.quick(found)
    while planner.time(found) < time:
        known = np.log(deviations(matrix)[:q]).sum()

        def gain(way: _Way, known: float = known) -> float:
            return float(known - np.log(deviations(way.matrix)[:q]).sum()) / way.time

        now = max(_ways(planner, _Way(now, (), matrix, 0.0), able, dwell, ahead), key=gain).path[0]
        matrix = matrix + planner.turn(found[-1].angles, now)[0] + dwell * planner.rest(now)
        found.append(Visit(now, dwell))
    return tuple(found)


@dataclass(frozen=True)
class _Way:
    """Where a unit is, the positions that led there, what is told then, and the time that it took [s]."""

    now: Angles
    path: tuple[Angles, ...]
    matrix: Floats
    time: float


def _ways(planner: Planner, begun: _Way, able: Sequence[Angles], dwell: float, ahead: int) -> list[_Way]:
    """All ways on through so many positions."""
    if not ahead:
        return [begun]
    found = []
    for b in (begun.now, *neighbours(begun.now, able)):
        told, turning = planner.turn(begun.now, b)
        matrix = begun.matrix + told + dwell * planner.rest(b)
        way = _Way(b, (*begun.path, b), matrix, begun.time + turning + dwell)
        found += _ways(planner, way, able, dwell, ahead - 1)
    return found


def parameter_of_table(name: str) -> bool:
    """Whether a parameter is an error of the table."""
    return not name.startswith(("gyro_", "accel_"))


def designed(
    planner: Planner, time: float, wanted: Floats | None = None, tries: int = 1500, seed: int = 0
) -> tuple[Visit, ...]:
    """A sequence of ``time`` seconds that makes the largest ratio of a deviation to the wanted one small.

    The problem without the order of visits is convex (`insenv.information.unit.shares`). A walk that spends the turns
    of its solution is the first order; changes of it by chance are kept where they are better, and the rests of an
    order are convex again. Slow noise, which a sum of parts does not know, raises the parameters that it touches by
    what it does to the greedy sequence.

    Parameters
    ----------
    planner : Planner
    time : float
        [s]
    wanted : ndarray, shape (q,), optional
        Shares of the prior deviations of the unit's parameters; none: those of the greedy sequence.
    tries : int
    seed : int
    """
    rng, able = np.random.default_rng(seed), right_angles(planner.model.gimbals)
    first = greedy(planner, time)
    q = sum(not parameter_of_table(p.name) for p in planner.model.parameters)
    told = planner.deviations(first)[:q]
    goal = (told if wanted is None else wanted) * deviations(planner.quick(first))[:q] / told
    begun = [
        _rested(planner, path, time, goal) for path in (_walk(planner, able, time, goal), [v.angles for v in first])
    ]
    playable = [one for one in begun if one is not None]
    if not playable:
        return first
    best = min(playable, key=lambda one: one.ratio)
    for _ in range(tries):
        trial = _rested(planner, _changed(best.path, able, rng), time, goal, best)
        if trial is not None and trial.ratio < best.ratio:
            best = trial
    last = _rested(planner, best.path, time, goal)
    assert last is not None
    return min(best, last, key=lambda one: one.ratio).visits


@dataclass(frozen=True)
class _Rested:
    """An order of positions with its rests."""

    path: list[Angles]
    visits: tuple[Visit, ...]
    seconds: dict[Angles, float]
    ratio: float
    weights: Floats


def _rested(
    planner: Planner, path: list[Angles], time: float, wanted: Floats, before: _Rested | None = None
) -> _Rested | None:
    """The best rests for an order of positions, from those ``before`` on; None where its turns alone take longer."""
    moving = [Visit(at, 0.0) for at in path]
    left = time - planner.time(moving)
    if left <= 0:
        return None
    places = list(dict.fromkeys(path))
    rests = np.reshape([planner.rest(at) for at in places], (len(places), -1))
    known = planner.quick(moving)
    begin = None
    if before is not None:
        mean = sum(before.seconds.values()) / len(before.seconds)
        begin = np.array([before.seconds.get(at, mean) for at in places]), before.weights
    found = shared(known + np.eye(len(known)), rests, left, wanted, _FIRST_STEPS if begin is None else _STEPS, begin)
    count = {at: path.count(at) for at in places}
    seconds = dict(zip(places, found.seconds.tolist(), strict=True))
    visits = tuple(Visit(at, seconds[at] / count[at]) for at in path)
    return _Rested(path, visits, seconds, found.ratio, found.weights)


def _walk(planner: Planner, able: Sequence[Angles], time: float, wanted: Floats) -> list[Angles]:
    """An order whose turns are nearly those of the problem without an order: where most of them are left, next."""
    pairs = [(a, b) for a in able for b in neighbours(a, able)]
    told = [planner.rest(a) for a in able] + [planner.turn(a, b)[0] / planner.turn(a, b)[1] for a, b in pairs]
    p = len(planner.model.parameters)
    found = shared(np.eye(p), np.reshape(told, (len(told), -1)), time, wanted, _FIRST_STEPS)
    left = {pair: s / planner.turn(*pair)[1] for pair, s in zip(pairs, found.seconds[len(able) :], strict=True)}
    turning, now = float(found.seconds[len(able) :].sum()), (0.0,) * len(planner.model.gimbals.axes)
    path = [now]
    while turning > 0:
        best = max(
            neighbours(now, able), key=lambda b: left[now, b] + 0.5 * max(left[b, c] for c in neighbours(b, able))
        )
        left[now, best] -= 1.0
        turning -= planner.turn(now, best)[1]
        now = best
        path.append(now)
    return path


def _changed(path: Sequence[Angles], able: Sequence[Angles], rng: np.random.Generator) -> list[Angles]:
    """One or two changes of the order by chance."""
    found = list(path)
    for _ in range(int(rng.integers(1, 3))):
        i, kind = int(rng.integers(len(found))), int(rng.integers(4))
        other = able[int(rng.integers(len(able)))]
        if kind == 0:
            found[i] = other
        elif kind == 1:
            found.insert(i, other)
        elif kind == 2 and len(found) > 2:
            found.pop(i)
        else:
            j = int(rng.integers(len(found)))
            found[min(i, j) : max(i, j) + 1] = found[min(i, j) : max(i, j) + 1][::-1]
    return found
