r"""What a recording of a unit on a table of several axes tells of all its parameters: cells, linear model, posterior.

    m_ci = u_ci(0) + X_ci theta + D_ci eta + e_ci,      M = sum_c [X D]_c' C_c^-1 [X D]_c + diag(1 / sd^2)

with m the mean of channel c (three gyros, three accelerometers) over cell i, u(0) what a unit on a table without errors
would be exposed to at the readings of the axes, X the declared effects' regressors, theta their parameters less what is
told of them, D the derivatives to the errors eta of the table (`insenv.core.unit.gimbals`), and C the covariance of all
noises that the datasheet tells of the channel: noises of different channels are independent. A rest has cells of up to
`REST` blocks, a turn one for a gyro, whose integral is what counts, and one a block for an accelerometer, which feels
there where it stands. The readings' white noise is that of a gyro's integral at the ends of a turn.

All is linear in what is sought, so that one solution is the maximum of the posterior and M^-1 its covariance and the
bound. Left out are products of two errors: of table and unit below the square of an error, 1e-7 for 0.3 mrad. Where
they show beside the noise (`insenv.information.unit.anew`), u(0), X and D are those about a point of both, again and
again as the recording grows: Gauss-Newton.
Source: S. M. Kay, Fundamentals of Statistical Signal Processing 1 (1993), sections 4.5, 10.6 and 11.5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Floats, Mounting, Recording
from insenv.core.unit.gimbals import Gimbals, exposed
from insenv.core.unit.motion import GYROS, UNIT, AxesCourse, motions
from insenv.effects.base import CurveEffect, Effect, LinearEffect, MemoryEffect
from insenv.effects.catalogue import by_key
from insenv.information.means import stated_noises
from insenv.sensors.chain import Sensor

#: Length of a block of samples, and of the intervals over which derivatives are taken [s].
BLOCK, INTERVAL = 1.0, 0.1
#: Most blocks of a rest that make one cell.
REST = 20
#: Step of differences [rad].
_STEP = 1e-6
#: Noise of an axis' reading from which on it is no reference: a hand, watched by eye [rad].
_BY_EYE = np.radians(1.0)
#: An axis has turned where its angle changed by more [rad].
_TURNED = 1e-4
#: Covariances that are kept: runs under one policy mostly have the same cells.
_KEPT = 12


def is_by_eye(mounting: Mounting) -> bool:
    """Whether the axes of a table are read too badly to be a reference."""
    return mounting.gimbals is not None and mounting.gimbals.noise >= _BY_EYE


@dataclass(frozen=True)
class Parameter:
    """One that is not known: its name, SI unit, and what is told of it."""

    name: str
    unit: str
    mean: float
    sd: float


def sought(sheet: Datasheet) -> tuple[Parameter, ...]:
    """Parameters of the unit of which a deviation is told: "gyro_x.bias.c"; those of shapes are taken as told."""
    return tuple(
        Parameter(f"{d.target}.{d.effect}.{param.name}", param.unit_on(Sensor(d.target).unit), mean, sd)
        for target in UNIT
        for d in sheet.declared
        if d.target == target
        for param, mean, sd in zip(by_key(d.effect).params, d.mean, d.sd, strict=True)
        if sd > 0
    )


def nuisance(gimbals: Gimbals) -> tuple[Parameter, ...]:
    """Errors of the table of which a deviation is told."""
    return tuple(Parameter(n, "rad", 0.0, sd) for n, sd in zip(gimbals.names, gimbals.sd, strict=True) if sd > 0)


def declared_sensors(sheet: Datasheet) -> tuple[tuple[Sensor, Floats, NDArray[np.bool_]], ...]:
    """Of each of `UNIT`: its declared effects, their means, and which of them are sought."""
    found = []
    for target in UNIT:
        own = [d for d in sheet.declared if d.target == target]
        effects = tuple(_effect(d.effect, target) for d in own)
        mean = np.array([m for d in own for m in d.mean])
        free = np.array([s > 0 for d in own for s in d.sd], bool)
        found.append((Sensor(target, effects), mean, free))
    return tuple(found)


@dataclass(frozen=True)
class Blocks:
    """Whole blocks of samples of R runs, b of them.

    Attributes
    ----------
    left : ndarray, shape (R, 6, b)
        Mean output less what is expected.
    columns : ndarray, shape (R, 6, w, b)
        Derivatives: of a channel's own parameters, then of the table's errors; zero where it has fewer.
    turning : ndarray of bool, shape (R, b)
    along : ndarray, shape (R, 3, b)
        Squares of the gyros' shares of the axes that turned, summed over these.
    """

    left: Floats
    columns: Floats
    turning: NDArray[np.bool_]
    along: Floats


@dataclass(frozen=True)
class Samples:
    """What blocks are made of: n samples of R runs.

    Attributes
    ----------
    outputs : ndarray, shape (R, 6, n)
        SI.
    readings : ndarray, shape (R, k, n + 3)
        Of the axes: at the ends of the samples, and the three before the first end.
    turning : ndarray, shape (R, n + 1)
        Whether an axis turns in a sample, and in the one before the first.
    warmth : ndarray, shape (R, n + 1)
        Temperature at the edges [K].
    first : int
        Samples before these.
    """

    outputs: Floats
    readings: Floats
    turning: Floats
    warmth: Floats
    first: int

    @classmethod
    def of(cls, parts: Sequence[Samples]) -> Samples:
        """Parts that follow each other as one."""
        one, more = parts[0], parts[1:]
        return cls(
            np.concatenate([part.outputs for part in parts], axis=-1),
            np.concatenate([one.readings, *(part.readings[..., 3:] for part in more)], axis=-1),
            np.concatenate([one.turning, *(part.turning[..., 1:] for part in more)], axis=-1),
            np.concatenate([one.warmth, *(part.warmth[..., 1:] for part in more)], axis=-1),
            one.first,
        )


@dataclass(frozen=True)
class _Point:
    """About what is linearised: errors of the table, shape (..., q), and parameters of each channel, (..., p_c)."""

    errors: Floats
    values: tuple[Floats, ...]


@dataclass(frozen=True)
class UnitModel:
    """The linear model of a datasheet.

    Attributes
    ----------
    sheet : Datasheet
    in_turns : bool
        Whether a gyro has a cell for each block of a turn as well: what an error of the table does within one shows.

    Raises
    ------
    InputError
        If it tells of no table's axes or of readings by eye, of no gravity, or of no noise of a channel.
    """

    sheet: Datasheet
    in_turns: bool = False
    _roots: dict[bytes, Floats] = field(default_factory=dict, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.sheet.mounting.gimbals is None:
            raise InputError("the datasheet tells of no table with several axes; wanted mounting.gimbals")
        if is_by_eye(self.sheet.mounting):
            raise InputError(
                f"the axes are read to {np.degrees(self.gimbals.noise):.3g} deg; wanted better than 1 deg, or an "
                "estimator that needs no table, such as multi_position"
            )
        if self.sheet.site.gravity is None:
            raise InputError("the datasheet tells of no gravity; wanted site.gravity, which accelerometers are set to")
        for target in UNIT:
            if not stated_noises(self.sheet, target):
                raise InputError(f"the datasheet tells of no noise of {target}; wanted it, for it weighs the data")

    @cached_property
    def gimbals(self) -> Gimbals:
        """The table's axes."""
        assert self.sheet.mounting.gimbals is not None
        return self.sheet.mounting.gimbals

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All that is solved for: the unit's first."""
        return (*sought(self.sheet), *nuisance(self.gimbals))

    @cached_property
    def size(self) -> int:
        """Samples of a block: an even number."""
        return 2 * max(1, round(0.5 * BLOCK * self.sheet.sampling))

    @cached_property
    def stride(self) -> int:
        """Samples of an interval of derivatives: an even divisor of a block."""
        most = max(2, int(INTERVAL * self.sheet.sampling + 1e-9))
        return max(s for s in range(2, most + 1, 2) if self.size % s == 0)

    @cached_property
    def sensors(self) -> tuple[tuple[Sensor, Floats, NDArray[np.bool_]], ...]:
        """Of each channel: its declared effects, their means, and which of them are sought."""
        return declared_sensors(self.sheet)

    @cached_property
    def places(self) -> tuple[NDArray[np.int64], ...]:
        """Of each channel: the places of its columns among all parameters."""
        names = [p.name for p in self.parameters]
        table = [names.index(p.name) for p in nuisance(self.gimbals)]
        return tuple(
            np.array([*(j for j, name in enumerate(names) if name.startswith(f"{target}.")), *table], np.int64)
            for target in UNIT
        )

    @cached_property
    def width(self) -> int:
        """Most columns of a channel."""
        return max(len(place) for place in self.places)

    def blocks(self, samples: Samples, point: Floats | None = None) -> Blocks:
        """Whole blocks, linear about what is told or about a ``point`` of all parameters, shape (R, p)."""
        at = self._told if point is None else self._at(point)
        n, turning = samples.outputs.shape[-1], samples.turning
        edges = samples.readings[..., 2:]
        moved = np.diff(edges, axis=-1) * (turning[:, None, 1:] > 0)
        expected = self._expected(edges, moved, at.errors)
        course = self._course(samples, moved)
        felt = self._motions(course, samples.warmth, at.errors)
        width, b = self.width, n // self.size
        left = np.empty((len(turning), 6, b))
        columns = np.zeros((len(turning), 6, width, b))
        for c, ((sensor, _, free), values) in enumerate(zip(self.sensors, at.values, strict=True)):
            motion = felt[sensor.target]
            told = sensor.measure(motion, values)[0] - sensor.true_input(motion)
            left[:, c] = self._means(samples.outputs[:, c], self.size) - self._means(expected[c], self.size // 2)
            left[:, c] -= self._means(told, self.size // self.stride)
            own = sensor.regressors(motion, values)[..., free]
            for j in range(own.shape[-1]):
                columns[:, c, j] = self._means(own[..., j], self.size // self.stride)
        sensed = self._inputs if point is None else self._outputs
        for j, derivative in enumerate(self._of_the_table(lambda e: sensed(course, samples.warmth, e, at), at.errors)):
            for c in range(6):
                own_count = len(self.places[c]) - len(nuisance(self.gimbals))
                columns[:, c, own_count + j] = self._means(derivative[c], self.size // self.stride)
        by_block = np.add.reduceat(moved, np.arange(0, n, self.size), axis=-1)
        flags: NDArray[np.bool_] = np.any(turning[:, 1:].reshape(len(turning), b, self.size) > 0, axis=-1)
        return Blocks(left, columns, flags, self._along(samples.readings[..., 3 :: self.size][..., :b], by_block))

    @staticmethod
    def _means(values: Floats, per: int) -> Floats:
        """Means over so many intervals each, shape (R, b)."""
        means: Floats = values.reshape(len(values), -1, per).mean(axis=-1)
        return means

    @property
    def _place(self) -> tuple[float | None, float]:
        site = self.sheet.site
        assert site.gravity is not None
        return site.latitude, site.gravity

    @cached_property
    def _no_error(self) -> Floats:
        return np.zeros(len(self.gimbals.names))

    @cached_property
    def _told(self) -> _Point:
        return _Point(self._no_error, tuple(mean for _, mean, _ in self.sensors))

    def _at(self, point: Floats) -> _Point:
        """Of values of all parameters, shape (R, p)."""
        errors, values, names = np.zeros((len(point), len(self.gimbals.names))), [], [q.name for q in self.parameters]
        for j, name in enumerate(self.gimbals.names):
            if name in names:
                errors[:, j] = point[:, names.index(name)]
        for (_, mean, free), place in zip(self.sensors, self.places, strict=True):
            own = np.tile(mean, (len(point), 1))
            own[:, free] = point[:, place[: int(free.sum())]]
            values.append(own)
        return _Point(errors, tuple(values))

    def _true(self, angles: Floats, rates: Floats, errors: Floats, dt: float) -> tuple[Floats, Floats]:
        """True angles (R, k, 2 m + 1) and mean rates (R, k, m) over intervals of ``dt`` of what the encoders say."""
        if not errors[..., 5 + len(self.gimbals.axes) :].any():
            return angles, rates
        true = self.gimbals.true_angles(angles, errors)
        return true, rates + np.diff((true - angles)[..., ::2], axis=-1) / dt

    def _expected(self, edges: Floats, moved: Floats, errors: Floats) -> tuple[Floats, ...]:
        """Means over pairs of samples of what a unit without errors senses, each of shape (R, n / 2)."""
        dt = 2 * self.sheet.dt
        true, rates = self._true(edges, (moved[..., ::2] + moved[..., 1::2]) / dt, errors, dt)
        felt = exposed(self.gimbals, errors, true, rates, self._place)
        return (*felt.rate, *felt.force)

    def _course(self, samples: Samples, moved: Floats) -> AxesCourse:
        """Of the readings, on the intervals of derivatives."""
        s, dt = self.stride, self.sheet.dt
        means = np.add.reduceat(moved, np.arange(0, moved.shape[-1], s), axis=-1) / (s * dt)
        # Backward differences, exact where the acceleration is even: what comes after the last sample is not known yet.
        readings = samples.readings
        now, before, earlier = (readings[..., 2 - j : readings.shape[-1] - j : s] for j in range(3))
        rates = (3 * now - 4 * before + earlier) / (2 * dt) * (samples.turning[:, None, ::s] > 0)
        t = (samples.first + np.arange(0, moved.shape[-1] + 1, s)) * dt
        return AxesCourse(t, readings[..., 2 :: s // 2], means, rates)

    def _motions(self, course: AxesCourse, warmth: Floats, errors: Floats) -> dict[str, Motion]:
        s = self.stride
        angles, means = self._true(course.angles, course.means, errors, s * self.sheet.dt)
        true = AxesCourse(course.t, angles, means, course.rates)
        return motions(self.gimbals, errors, true, self._place, warmth[:, ::s], self.sheet.reference_temperature)

    def _inputs(self, course: AxesCourse, _: Floats, errors: Floats, __: _Point) -> tuple[Floats, ...]:
        """What a unit without errors senses on the intervals of derivatives, each of shape (R, m)."""
        angles, rates = self._true(course.angles, course.means, errors, self.stride * self.sheet.dt)
        felt = exposed(self.gimbals, errors, angles, rates, self._place)
        return (*felt.rate, *felt.force)

    def _outputs(self, course: AxesCourse, warmth: Floats, errors: Floats, at: _Point) -> tuple[Floats, ...]:
        """What the unit says there, with the errors of its point."""
        felt = self._motions(course, warmth, errors)
        return tuple(
            sensor.measure(felt[sensor.target], values)[0]
            for (sensor, _, _), values in zip(self.sensors, at.values, strict=True)
        )

    def _of_the_table(
        self, sensed: Callable[[Floats], tuple[Floats, ...]], errors: Floats
    ) -> Iterator[tuple[Floats, ...]]:
        """Derivatives of what is sensed to each error of the table that is not known, each of shape (R, m)."""
        nominal = sensed(errors)
        for j, sd in enumerate(self.gimbals.sd):
            if not sd > 0:
                continue
            off = errors.copy()
            off[..., j] += _STEP
            yield tuple((a - b) / _STEP for a, b in zip(sensed(off), nominal, strict=True))

    def _along(self, angles: Floats, moved: Floats) -> Floats:
        """Squares of the shares that the gyros have of the axes that turned, shape (R, 3, b)."""
        total = np.zeros((len(moved), 3, moved.shape[-1]))
        for m in range(moved.shape[1]):
            unit = np.zeros_like(moved)
            unit[:, m] = np.abs(moved[:, m]) > _TURNED
            total += np.stack(self.gimbals.turning(unit, angles, self._no_error), axis=1) ** 2
        return total

    def information(self, blocks: Blocks) -> tuple[Floats, Floats]:
        """What the blocks tell, in units of the prior deviations.

        Returns
        -------
        matrix : ndarray, shape (R, p, p)
            Of theta / sd, without the prior.
        vector : ndarray, shape (R, p)
        """
        p, runs = len(self.parameters), len(blocks.left)
        matrix, vector = np.zeros((runs, p, p)), np.zeros((runs, p))
        for row in range(runs):
            for c, place in enumerate(self.places):
                means, root = self._cells(blocks, row, c)
                white = solve_triangular(root, means, lower=True, check_finite=False)
                product = white.T @ white
                matrix[row][np.ix_(place, place)] += product[:-1, :-1]
                vector[row, place] += product[:-1, -1]
        return matrix, vector

    def cells(self, blocks: Blocks, row: int, c: int) -> tuple[Floats, Floats, Floats]:
        """Of a run and a channel: columns per prior deviation, means and their covariance, m cells."""
        means, root = self._cells(blocks, row, c)
        return means[:, :-1], means[:, -1], root @ root.T

    def edges(self, blocks: Blocks, row: int, c: int) -> NDArray[np.int64]:
        """Edges of these cells in blocks, shape (m + 1,)."""
        return _edges(blocks.turning[row].tobytes(), c < len(GYROS) and not self.in_turns)

    def turns(self, blocks: Blocks, row: int, c: int) -> NDArray[np.bool_]:
        """Which of these cells are turns."""
        return blocks.turning[row][self.edges(blocks, row, c)[:-1]]

    def _cells(self, blocks: Blocks, row: int, c: int) -> tuple[Floats, Floats]:
        """Columns and, last, the mean of each cell; the lower root of their covariance."""
        turning, place = blocks.turning[row], self.places[c]
        edges = self.edges(blocks, row, c)
        sd = np.array([self.parameters[j].sd for j in place])
        data = np.concatenate([blocks.columns[row, c, : len(place)] * sd[:, None], blocks.left[row, c, None]])
        means = np.add.reduceat(data, edges[:-1], axis=-1) / np.diff(edges)
        return means.T, self._root(c, edges, turning, blocks.along[row])

    def posterior(self, blocks: Blocks, point: Floats | None = None) -> tuple[Floats, Floats]:
        """Mean and covariance of all parameters, (R, p) and (R, p, p), of blocks that are linear about a point."""
        matrix, vector = self.information(blocks)
        mean, sd = (np.array([getattr(q, name) for q in self.parameters]) for name in ("mean", "sd"))
        cov: Floats = np.asarray(np.linalg.inv(np.eye(len(sd)) + matrix), float)
        about = np.tile(mean, (len(vector), 1)) if point is None else point
        found = about + sd * (cov @ (vector + (mean - about) / sd)[..., None])[..., 0]
        return found, 0.5 * (cov + np.swapaxes(cov, -1, -2)) * np.outer(sd, sd)

    def _root(self, c: int, edges: NDArray[np.int64], turning: NDArray[np.bool_], along: Floats) -> Floats:
        """Lower root of the covariance of a channel's cells."""
        cells = edges[:-1]
        dt, noise = self.sheet.dt, self.gimbals.noise
        time = np.diff(edges) * self.size * dt
        if c < len(GYROS):
            share = np.maximum.reduceat(along[c], cells) if len(cells) else np.zeros(0)
            own = (noise / time) * np.sqrt(np.round(share, 3)) * turning[cells]
            # Two cells of one turn have the reading between them in common.
            extra = np.diag(2 * own**2) - sum(np.diag(own[1:] * own[:-1], k) for k in (-1, 1))
        else:
            extra = np.diag((self._place[1] * noise) ** 2 * dt / time)
        key = bytes([c]) + edges.tobytes() + extra.tobytes()
        if key not in self._roots:
            if len(self._roots) >= _KEPT:
                self._roots.clear()
            noises = stated_noises(self.sheet, UNIT[c])
            total = sum(n.coefficient**2 * n.effect.covariance(edges * self.size, dt) for n in noises)
            self._roots[key] = np.asarray(cholesky(np.asarray(total) + extra, lower=True))
        return self._roots[key]


def _effect(key: str, target: str) -> Effect:
    effect = by_key(key)
    if isinstance(effect, MemoryEffect) or not isinstance(effect, LinearEffect | CurveEffect):
        raise InputError(f"{key} on {target}: an effect with a memory, or by chance; wanted one that cells tell")
    return effect


@lru_cache(maxsize=_KEPT)
def _edges(flags: bytes, whole: bool) -> NDArray[np.int64]:
    """Edges of cells in blocks, for whether each turns: rests in pieces, turns block by block or (``whole``) in one."""
    turning, found = np.frombuffer(flags, bool), [0]
    for i in range(1, len(turning)):
        same = turning[i] == turning[i - 1]
        joined = same and (whole if turning[i] else i - found[-1] < REST)
        if not joined:
            found.append(i)
    edges = np.array([*found, len(turning)], np.int64)
    edges.flags.writeable = False
    return edges


@dataclass(frozen=True)
class GatheredBlocks:
    """A recording so far, in blocks and what fills none yet.

    Attributes
    ----------
    blocks : tuple of Blocks
    past : ndarray, shape (R, k, 3)
        Readings at the last three ends before the rest; NaN: no row yet.
    last : ndarray, shape (R, 2)
        Whether an axis turned in the sample before the rest, and the temperature at its end [K].
    rest : ndarray, shape (R, 6 + k + 2, r)
        Rows that fill no block.
    point : ndarray, shape (R, p), optional
        About which the blocks are linear; None: about what is told, once and for all.
    samples : tuple of Samples
        Of the blocks, where there is a point.
    """

    blocks: tuple[Blocks, ...]
    past: Floats
    last: Floats
    rest: Floats
    point: Floats | None = None
    samples: tuple[Samples, ...] = ()

    @property
    def passed(self) -> int:
        """Blocks so far."""
        return sum(part.turning.shape[-1] for part in self.blocks)


def nothing(model: UnitModel, batch: int, anew: bool = False) -> GatheredBlocks:
    """Before any data; ``anew``: blocks may be linearised again (`linearised`)."""
    k = len(model.gimbals.axes)
    point = np.tile([q.mean for q in model.parameters], (batch, 1)) if anew else None
    return GatheredBlocks((), np.full((batch, k, 3), np.nan), np.zeros((batch, 2)), np.zeros((batch, 8 + k, 0)), point)


def gathered(model: UnitModel, state: GatheredBlocks, chunk: Recording) -> GatheredBlocks:
    """After a chunk of R runs. How a record is cut makes no difference."""
    batch, k, n = len(state.past), len(model.gimbals.axes), len(chunk)
    rows = np.empty((batch, 8 + k, n))
    for c, name in enumerate(UNIT):
        rows[:, c] = chunk.values(name, "rad/s" if name in GYROS else "m/s^2")
    for m in range(k):
        rows[:, 6 + m] = chunk.values(f"axis_{m + 1}", "rad")
    rows[:, 6 + k] = chunk.values("turning", "1")
    warm = "temperature" in chunk.channels
    rows[:, 7 + k] = chunk.values("temperature", "K") if warm else model.sheet.reference_temperature
    rows = np.concatenate([state.rest, rows], axis=-1)
    whole = rows.shape[-1] // model.size
    if not whole:
        return replace(state, rest=rows)
    end, past, last = whole * model.size, state.past, state.last
    if np.isnan(past).any():
        past = _from_rest(rows[:, 6 : 6 + k], rows[:, 6 + k])
        last = np.stack([np.zeros(batch), rows[:, 7 + k, 0]], axis=-1)
    readings = np.concatenate([past, rows[:, 6 : 6 + k, :end]], axis=-1)
    beside = np.concatenate([last[..., None], rows[:, 6 + k :, :end]], axis=-1)
    samples = Samples(rows[:, :6, :end], readings, beside[:, 0], beside[:, 1], state.passed * model.size)
    return replace(
        state,
        blocks=(*state.blocks, model.blocks(samples, state.point)),
        past=readings[..., -3:].copy(),
        last=beside[..., -1].copy(),
        rest=rows[..., end:].copy(),
        samples=() if state.point is None else (*state.samples, samples),
    )


def linearised(model: UnitModel, state: GatheredBlocks, point: Floats) -> GatheredBlocks:
    """The same about another point, shape (R, p)."""
    samples = Samples.of(state.samples)
    return replace(state, blocks=(model.blocks(samples, point),), point=point, samples=(samples,))


def _from_rest(readings: Floats, turning: Floats) -> Floats:
    """Readings before the first row: a table begins at rest, and turns with even acceleration if it does, (R, k, 3)."""
    started = readings[..., 0] - np.diff(readings[..., :2], axis=-1)[..., 0] / 3 * (turning[:, None, 0] > 0)
    return np.repeat(started[..., None], 3, axis=-1)


def joined(state: GatheredBlocks) -> Blocks | None:
    """All blocks in one; None before there is any."""
    if not state.blocks:
        return None
    parts = state.blocks
    return Blocks(*(np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in _FIELDS))


def begun(blocks: Blocks, count: int) -> Blocks:
    """The first ``count`` of them."""
    return Blocks(*(getattr(blocks, name)[..., :count] for name in _FIELDS))


_FIELDS = ("left", "columns", "turning", "along")


def run_information(model: UnitModel, run: Recording) -> Floats:
    """Of one run, in units of the prior deviations and without the prior, shape (p, p)."""
    blocks = joined(gathered(model, nothing(model, 1), run))
    p = len(model.parameters)
    return np.zeros((p, p)) if blocks is None else model.information(blocks)[0][0]
