r"""A plant and the instruments that it carries, stepped together.

    scene_k, p_{k+1} = plant(p_k, command_k, z_k)
    y_k,     s_{k+1} = sensor(scene_k, s_k, z_k)

`Rig.advance` is pure: state and unit normals go in, readings and state come out. The generators stand
outside, in `Normals`: run ``seed`` has one `numpy.random.SeedSequence`, which gives every effect of chance its own
SFC64 stream, by the place of its instrument in the rig and of the effect in its chain. So row i of a batch
is the run ``seed + i`` bit for bit, the size of the chunks does not matter, and an effect that is added at
the end of a chain leaves every other noise as it was.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.plants.base import Plant, Reference
from insenv.sensors.chain import Sensor

#: Samples per chunk of a stream: its arrays stay within the processor's cache.
CHUNK = 16384
#: Unit normals that are read ahead of each stream, and of all streams together (2 MiB), at most.
AHEAD, AHEAD_IN_ALL = 1600, 2**18


@dataclass(frozen=True)
class Fitted:
    """A sensor and the parameters with which it is simulated, shape (..., p)."""

    sensor: Sensor
    theta: Floats


@dataclass(frozen=True)
class RigState:
    """Samples passed so far and the states of the plant and of each sensor.

    Before the first sample ``sensors`` holds the unit normals of each sensor's first state, shape
    (..., draws_at_start), or None where noise begins at zero.
    """

    samples: int
    plant: Any
    sensors: tuple[Any, ...]


@dataclass(frozen=True)
class Readings:
    """A chunk of output.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Ends of the intervals [s].
    outputs : mapping of str to ndarray, shape (..., n)
        Mean of each instrument's output over the intervals, in SI units.
    references : mapping of str to Reference
        What the plant's log holds.
    """

    t: Floats
    outputs: Mapping[str, Floats]
    references: Mapping[str, Reference]


class Normals:
    """The unit normals of a run, or of a batch of them.

    ``seeds`` are those of the rows of a batch, or that of one run; with ``batch`` it is the first of so many. Stands at
    the outer edge: it is the one thing here that changes when it is used. It reads ahead, as a generator that is
    called for a few samples takes longer for the call than for the samples.
    """

    def __init__(self, rig: Rig, seeds: int | Sequence[int], batch: int | None = None) -> None:
        self._batched = batch is not None or not isinstance(seeds, int | np.integer)
        if isinstance(seeds, int | np.integer):
            seeds = range(int(seeds), int(seeds) + (1 if batch is None else batch))
        self._seeds = tuple(seeds)
        self._sensors = tuple(fitted.sensor for fitted in rig.instruments)
        places, self._every = [(0, 0, d) for d in range(rig.plant.draws)], [1] * rig.plant.draws
        for i, sensor in enumerate(self._sensors, start=1):
            places += [(i, j, d) for j, effect in enumerate(sensor.driven) for d in range(effect.draws)]
            self._every += [effect.every for effect in sensor.driven for _ in range(effect.draws)]
        self._streams = [[stream(s, place) for place in places] for s in self._seeds]
        self._ahead = np.empty((len(self._seeds), len(places), 0))
        self._read_so_far, self._last = 0, np.zeros((len(self._seeds), len(places)))

    def start(self, power_ups: Sequence[int] | None = None) -> tuple[Floats | None, ...]:
        """Unit normals of each sensor's first state, shape (..., draws_at_start); the same at every call.

        ``power_ups`` are the numbers of the power-up of each run, from 1 (None): each has a first state of its own.
        """
        numbers = [1] * len(self._seeds) if power_ups is None else power_ups
        dealt = []
        for i, sensor in enumerate(self._sensors, start=1):
            rows = [
                [
                    stream(s, (i, j, e.draws, *((int(p),) if p > 1 else ()))).standard_normal(e.draws_at_start)
                    for j, e in enumerate(sensor.driven)
                ]
                for s, p in zip(self._seeds, numbers, strict=True)
            ]
            z = np.array([np.concatenate([*row, []]) for row in rows])
            dealt.append(z if self._batched else z[0])
        return tuple(dealt)

    def draw(self, n: int) -> Floats:
        """The next ``n`` of every stream, shape (draws, n), with a batch (batch, draws, n)."""
        if n > self._ahead.shape[-1]:
            most = min(AHEAD, AHEAD_IN_ALL // max(1, self._ahead.shape[0] * self._ahead.shape[1]))
            # Whole blocks, so that nothing is left to be moved.
            self._read(n * max(1, most // n))
        z, self._ahead = self._ahead[..., :n], self._ahead[..., n:]
        return z if self._batched else z[0]

    def rows(self, index: NDArray[np.int64]) -> Normals:
        """The runs ``index`` of the batch alone, going on from here; this one must not be used any more."""
        kept = copy(self)
        kept._seeds = tuple(self._seeds[i] for i in index)
        kept._streams = [self._streams[i] for i in index]
        kept._ahead = self._ahead[index]
        kept._last = self._last[index]
        return kept

    def _read(self, n: int) -> None:
        """Have ``n`` of every stream at hand, in new memory: what was drawn before stays as it is."""
        left = self._ahead.shape[-1]
        z = np.empty((*self._ahead.shape[:2], n))
        z[..., :left] = self._ahead
        for row, streams, last in zip(z, self._streams, self._last, strict=True):
            for j, (line, stream, every) in enumerate(zip(row, streams, self._every, strict=True)):
                if every == 1:
                    stream.standard_normal(out=line[left:])
                else:
                    last[j] = _repeated(stream, line[left:], -self._read_so_far % every, every, last[j])
        self._ahead, self._read_so_far = z, self._read_so_far + n - left


def _repeated(stream: np.random.Generator, line: Floats, first: int, every: int, last: float) -> float:
    """Fill a line with unit normals that stand for ``every`` samples each, and return the last of them.

    ``last`` stands for ``first`` samples yet.
    """
    line[:first] = last
    rest = line[first:]
    drawn = stream.standard_normal(-(-len(rest) // every))
    rest[:] = np.repeat(drawn, every)[: len(rest)]
    return float(drawn[-1]) if len(drawn) else last


def stream(seed: int, place: tuple[int, ...]) -> np.random.Generator:
    """Generator of run ``seed`` for one draw of one noise of one instrument (0: the plant)."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=place)))


@dataclass(frozen=True)
class Rig:
    """A plant with instruments, sampled evenly.

    Attributes
    ----------
    plant : Plant
    instruments : tuple of Fitted
    rate : float
        Sampling rate [Hz].
    """

    plant: Plant
    instruments: tuple[Fitted, ...]
    rate: float

    @cached_property
    def draws(self) -> tuple[int, ...]:
        """Unit normals per sample of the plant and of each instrument."""
        return (self.plant.draws, *(fitted.sensor.draws for fitted in self.instruments))

    @cached_property
    def _dealt(self) -> tuple[slice, ...]:
        """Places of those of each among all."""
        ends = tuple(accumulate((0, *self.draws)))
        return tuple(slice(*pair) for pair in pairwise(ends))

    def begin(self, z: tuple[Floats | None, ...] | None = None) -> RigState:
        """State at time 0; ``z`` as of `Normals.start`, None: noise begins at zero."""
        return RigState(0, self.plant.begin(), (None,) * len(self.instruments) if z is None else z)

    def advance(self, state: RigState, command: Any, n: int, z: Floats) -> tuple[Readings, RigState]:
        """The next ``n`` samples.

        Parameters
        ----------
        state : RigState
        command : object
            What the plant takes: on a turntable a rate [rad/s], scalar or of shape (batch,); None: as before.
        n : int
        z : ndarray, shape (..., sum(draws), n)
            Unit normals.

        Raises
        ------
        ValueError
            If an effect needs an exposure that the plant does not give.
        """
        t = np.arange(state.samples, state.samples + n + 1, dtype=float)
        t /= self.rate
        own, *others = self._dealt
        scene, plant = self.plant.advance(state.plant, command, t, z[..., own, :])
        outputs, after = {}, []
        for fitted, before, drawn in zip(self.instruments, state.sensors, others, strict=True):
            sensor = fitted.sensor
            motion = replace(scene.motions[sensor.target], step=1 / self.rate)
            if not state.samples:
                before = _first_state(fitted, motion, before)
            reading, carried = sensor.measure(motion, fitted.theta, before, z[..., drawn, :])
            outputs[sensor.target] = _at_least(reading, (*z.shape[:-2], n))
            after.append(carried)
        return Readings(t[1:], outputs, scene.references), RigState(state.samples + n, plant, tuple(after))

    def stream(self, seed: int, samples: int, batch: int | None = None, chunk: int = CHUNK) -> Iterator[Readings]:
        """So many samples of the plant left to itself, in chunks: memory does not grow with their number."""
        normals = Normals(self, seed, batch)
        state = self.begin(normals.start())
        for start in range(0, samples, chunk):
            n = min(chunk, samples - start)
            readings, state = self.advance(state, None, n, normals.draw(n))
            yield readings

    def run(self, seed: int, samples: int, batch: int | None = None) -> Readings:
        """The same in one piece."""
        (readings,) = self.stream(seed, samples, batch, max(samples, 1))
        return readings


def _at_least(values: Floats, shape: tuple[int, ...]) -> Floats:
    """Values with the batch axes of ``shape`` too."""
    return values if values.shape == shape else np.broadcast_to(values, np.broadcast_shapes(values.shape, shape))


def _first_state(fitted: Fitted, motion: Motion, z: Floats | None) -> tuple[Any, ...]:
    """State of an instrument before its first sample."""
    if missing := fitted.sensor.missing(motion):
        raise ValueError(f"{fitted.sensor.target}: this plant does not give {', '.join(missing)}")
    return fitted.sensor.begin(motion, fitted.theta, z)
