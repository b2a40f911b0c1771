r"""Sequences of positions for a whole unit: what they tell of every parameter, and the search for better ones.

    M(sequence) = sum over visits of M_turn(from, to) + seconds M_rest(at)

is nearly additive, for noise that is white; with that a search tries thousands of sequences in seconds. What is stated
of a sequence is of the full model (`told`): all motion planned, slow noise over all of it. As the model is linear and
Gaussian no datum changes what the next one tells: the best sequence is known before the first measurement, and a policy
that looks ahead on line has nothing to add.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from insenv.core.estimate import Datasheet
from insenv.core.unit.gimbals import Floats, turn_time
from insenv.core.unit.turns import Turns, at_rest, turned
from insenv.information.positions import Angles, right_angles
from insenv.information.unit_calibration import BLOCK, Blocks, UnitModel

#: Sampling with which motion is planned [Hz], and rest whose information stands for each of its seconds [s].
_SAMPLING, _REST = 10.0, 20
#: Power of the mean of ratios that stands for their largest.
_POWER = 8.0


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

    def told(self, visits: Sequence[Visit], time: float | None = None) -> Floats:
        """Deviation of every parameter after a sequence by the full model, as a share of the prior, shape (p,)."""
        length = self.time(visits) if time is None else time
        matrix = self._information((0.0,) * len(self.model.gimbals.axes), visits, float(length))
        return deviations(matrix)

    def _information(self, start: Angles, visits: Sequence[Visit], time: float) -> Floats:
        matrix, _ = self.model.information(self._planned(start, visits, time))
        return matrix[0]

    def _planned(self, start: Angles, visits: Sequence[Visit], time: float) -> Blocks:
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
        return self.model.blocks(np.zeros((1, 6, n)), np.concatenate([before, angles], axis=-1), flags, warmth, 0)


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


def greedy(planner: Planner, time: float, dwell: float = 20.0) -> tuple[Visit, ...]:
    """At each position the neighbour whose turn and rest of ``dwell`` tell most by the second, until time is up."""
    able = right_angles(planner.model.gimbals)
    q = sum(not parameter_of_table(p.name) for p in planner.model.parameters)
    now: Angles = (0.0,) * len(planner.model.gimbals.axes)
    found = [Visit(now, dwell)]
    matrix = planner.quick(found)
    while planner.time(found) < time:
        known = np.log(deviations(matrix)[:q]).sum()
        best: tuple[float, Visit, Floats] | None = None
        for b in (now, *neighbours(now, able)):
            told, turning = planner.turn(now, b)
            after = matrix + told + dwell * planner.rest(b)
            gain = (known - np.log(deviations(after)[:q]).sum()) / (turning + dwell)
            if best is None or gain > best[0]:
                best = (float(gain), Visit(b, dwell), after)
        assert best is not None
        found.append(best[1])
        now, matrix = best[1].angles, best[2]
    return tuple(found)


def parameter_of_table(name: str) -> bool:
    """Whether a parameter is an error of the table."""
    return not name.startswith(("gyro_", "accel_"))


def designed(
    planner: Planner, time: float, wanted: Floats | None = None, tries: int = 1500, seed: int = 0
) -> tuple[Visit, ...]:
    """A sequence of ``time`` seconds that leaves least of what is not known.

    From the greedy sequence on, changes by chance are kept where they are better: another position or dwell, a visit
    more or less, rests in other ratios.

    Parameters
    ----------
    planner : Planner
    time : float
        [s]
    wanted : ndarray, shape (q,), optional
        Shares of the prior deviations of the unit's parameters: then the largest ratio to them is made small; else the
        sum of the logarithms.
    tries : int
    seed : int
    """
    rng, able = np.random.default_rng(seed), right_angles(planner.model.gimbals)
    q = sum(not parameter_of_table(p.name) for p in planner.model.parameters)

    def price(visits: Sequence[Visit]) -> float:
        left = deviations(planner.quick(visits))[:q]
        if wanted is None:
            return float(np.log(left).sum())
        return float(np.mean((left / wanted) ** _POWER) ** (1 / _POWER))

    best = _fitted(planner, list(greedy(planner, time)), time)
    least = price(best)
    for _ in range(tries):
        trial = _fitted(planner, _changed(best, able, rng), time)
        if trial and (now := price(trial)) < least:
            best, least = trial, now
    return tuple(best)


def _changed(visits: list[Visit], able: Sequence[Angles], rng: np.random.Generator) -> list[Visit]:
    """One or two changes by chance."""
    found = list(visits)
    for _ in range(int(rng.integers(1, 3))):
        i, kind = int(rng.integers(len(found))), int(rng.integers(5))
        other = able[int(rng.integers(len(able)))]
        if kind == 0:
            found[i] = replace(found[i], angles=other)
        elif kind == 1:
            found[i] = replace(found[i], dwell=found[i].dwell * float(rng.choice([0.25, 0.5, 2.0, 4.0])))
        elif kind == 2:
            found.insert(i, Visit(other, float(rng.choice([1.0, 5.0, 20.0]))))
        elif kind == 3 and len(found) > 2:
            found.pop(i)
        else:
            j = int(rng.integers(len(found)))
            found[i], found[j] = found[j], found[i]
    return found


def _fitted(planner: Planner, visits: list[Visit], time: float) -> list[Visit]:
    """The sequence with its rests scaled to the time; empty where its turns alone take longer."""
    resting = sum(visit.dwell for visit in visits)
    turning = planner.time(visits) - resting
    if turning >= time or not resting > 0:
        return []
    return [replace(visit, dwell=visit.dwell * (time - turning) / resting) for visit in visits]
