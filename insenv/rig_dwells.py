r"""Means of an instrument over dwells, drawn from their joint law instead of sample by sample.

Between edges k_0 < k_1 < ... (counted in samples) a run has the means

    m_i = U_i + X_i theta + sum_n c_n e_ni,      cov(e_ni, e_nj) = Q_n(i, j)

with U and X the means of the true input and of the effects' regressors over the samples of each interval, and Q_n what
`insenv.effects.base.NoiseEffect.covariance` gives. These are the same effects as sample by sample, and the means have
the same distribution; only their draws differ. Of dwells with gaps, the gaps are intervals too.

What it takes: a plant that moves in all runs alike; effects that are linear in what differs from run to run; noise that
tells the law of its integral. Anything else is refused. All sums are elementwise, so that a row of a batch is the run
alone, bit for bit, in any process.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import DrivenEffect, Effect, LinearEffect, NoiseEffect
from insenv.rig import CHUNK, Fitted, Rig, stream

#: First number of the place of every generator here: none of them is one of the path sample by sample.
PLACE = 10**6 + 1000
#: Most intervals of noise whose means are not independent: its covariance has their square.
MOST = 4000

#: A command of the plant and the samples for which it holds.
Command = tuple[Any, int]


@dataclass(frozen=True)
class _Noise:
    """A noise: place of its coefficient in theta, and a root of its covariance: its diagonal where it has no more."""

    place: int
    root: Floats


@dataclass(frozen=True)
class _Instrument:
    """Means of one output over the m intervals: what no run changes, and k regressors with their places in theta."""

    target: str
    mean: Floats
    regressors: Floats
    places: tuple[int, ...]
    held: tuple[tuple[str, slice, Floats], ...]
    noises: tuple[_Noise, ...]


@dataclass(frozen=True)
class DwellLaw:
    """Joint law of the means of a rig's instruments between ``edges``; made by `dwell_law`.

    Attributes
    ----------
    edges : ndarray of int, shape (m + 1,)
        In samples from the start.
    rate : float
        Sampling rate [Hz].
    """

    edges: NDArray[np.int64]
    rate: float
    _instruments: tuple[_Instrument, ...]

    def draw(self, rig: Rig, seeds: Sequence[int]) -> dict[str, Floats]:
        """Means over the intervals, shape (R, m), by target.

        Parameters
        ----------
        rig : Rig
            Of the R runs ``seeds``, with their random truths.
        seeds : sequence of int

        Raises
        ------
        InputError
            If a parameter differs from run to run that may not.
        """
        found = {}
        normals = iter(self._normals(seeds))
        for own, fitted in zip(self._instruments, rig.instruments, strict=True):
            theta = np.broadcast_to(fitted.theta, (len(seeds), fitted.theta.shape[-1]))
            for key, part, values in own.held:
                if not np.array_equal(theta[:, part], np.broadcast_to(values, theta[:, part].shape)):
                    raise InputError(
                        f"effect {key!r} of {own.target} differs from run to run and is not linear in what differs; "
                        f"wanted it exact, or the path sample by sample"
                    )
            total = np.repeat(own.mean[None], len(seeds), axis=0)
            for place, column in zip(own.places, own.regressors.T, strict=True):
                total += theta[:, place, None] * column
            for noise, z in zip(own.noises, normals, strict=False):
                total += theta[:, noise.place, None] * _times(noise.root, z)
            found[own.target] = total
        return found

    def _normals(self, seeds: Sequence[int]) -> list[Floats]:
        """Unit normals of each noise, shape (R, m); one generator for each run, the noises one after the other."""
        count = sum(len(own.noises) for own in self._instruments)
        z = np.empty((len(seeds), count, len(self.edges) - 1))
        for row, seed in zip(z, seeds, strict=True):
            stream(seed, (PLACE,)).standard_normal(out=row)
        return [z[:, j] for j in range(count)]

    def covariance(self, target: str, theta: Floats) -> Floats:
        """Covariance of the noise of the means of one output, shape (m, m), for parameters of shape (p,)."""
        (own,) = (o for o in self._instruments if o.target == target)
        m = len(own.mean)
        total = np.zeros((m, m))
        for noise in own.noises:
            root = np.diag(noise.root) if noise.root.ndim == 1 else noise.root
            total += theta[noise.place] ** 2 * (root @ root.T)
        return total


def dwell_law(rig: Rig, commands: Iterable[Command], edges: Sequence[int] | NDArray[np.int64]) -> DwellLaw:
    """The law of the means between ``edges`` of runs that are commanded so.

    Parameters
    ----------
    rig : Rig
        Of two runs or more, so that what differs from run to run shows.
    commands : iterable of (command, samples)
        What the plant is told, one after the other: as of `insenv.rig.Rig.advance`.
    edges : sequence of int, shape (m + 1,)
        In samples from the start, rising, within the commands.

    Raises
    ------
    InputError
        If the plant or an effect is not as wanted.
    """
    listed, edges = list(commands), np.asarray(edges, np.int64)
    last = sum(n for _, n in listed)
    if len(edges) < 2 or edges[0] < 0 or np.any(np.diff(edges) < 1) or edges[-1] > last:
        raise InputError(f"edges of dwells {_shown(edges)} given; wanted two or more, rising, from 0 to {last} samples")
    if rig.plant.by_chance:
        raise InputError("this plant moves by chance; wanted one that moves as it is commanded")
    sums = [_Sums(fitted, edges, rig.rate) for fitted in rig.instruments]
    state, start = rig.plant.begin(), 0
    for command, length in listed:
        for first in range(start, start + length, CHUNK):
            n = min(CHUNK, start + length - first)
            t = np.arange(first, first + n + 1) / rig.rate
            told = command if first == start else None
            scene, state = rig.plant.advance(state, told, t, np.zeros((rig.plant.draws, n)))
            for own in sums:
                own.add(first, scene.motions[own.fitted.sensor.target])
        start += length
    return DwellLaw(edges, rig.rate, tuple(own.closed() for own in sums))


class _Sums:
    """Sums over the intervals of what one instrument is exposed to."""

    def __init__(self, fitted: Fitted, edges: NDArray[np.int64], rate: float) -> None:
        self.fitted, self._edges, self._rate = fitted, edges, rate
        theta = np.atleast_2d(fitted.theta)[0]
        self._linear: list[tuple[LinearEffect, slice]] = []
        self._held: list[tuple[Effect, slice, Floats]] = []
        self._noises: list[tuple[NoiseEffect, int]] = []
        place = 0
        for effect in fitted.sensor.effects:
            own = slice(place, place + len(effect.params))
            place = own.stop
            if isinstance(effect, NoiseEffect):
                self._noises.append((effect, own.start))
            elif isinstance(effect, DrivenEffect):
                raise InputError(
                    f"effect {effect.key!r} of {fitted.sensor.target} is driven by chance and not Gaussian; "
                    f"wanted the path sample by sample"
                )
            elif isinstance(effect, LinearEffect):
                self._linear.append((effect, own))
            else:
                self._held.append((effect, own, theta[own]))
        self._mean = np.zeros(len(edges) - 1)
        self._regressors = np.zeros((len(edges) - 1, sum(len(e.params) for e, _ in self._linear)))
        self._states: list[Any] = [None] * len(self._held)

    def add(self, first: int, motion: Motion) -> None:
        """The samples from ``first`` on."""
        motion = _alone(replace(motion, step=1 / self._rate), self.fitted.sensor.target)
        if missing := self.fitted.sensor.missing(motion):
            raise InputError(f"{self.fitted.sensor.target}: this plant does not give {', '.join(missing)}")
        u = self.fitted.sensor.true_input(motion)
        mean = u.copy()
        for j, (effect, _, theta) in enumerate(self._held):
            state = effect.begin(motion, theta) if first == 0 else self._states[j]
            addition, self._states[j] = effect.apply(u, motion, theta, state)
            mean += addition
        starts, into = self._pieces(first, len(u))
        self._mean[into] += np.add.reduceat(mean, starts)[: len(into)]
        column = 0
        for effect, own in self._linear:
            basis = effect.basis(u, motion)
            k = own.stop - own.start
            pieces = np.add.reduceat(np.broadcast_to(basis, (*u.shape, k)), starts, axis=0)
            self._regressors[into, column : column + k] += pieces[: len(into)]
            column += k

    def closed(self) -> _Instrument:
        """Means, and roots of the covariances of the noise."""
        count = np.diff(self._edges).astype(float)
        noises = []
        for effect, place in self._noises:
            noises.append(_Noise(place, _root(effect.covariance(self._edges, 1 / self._rate), effect.key)))
        return _Instrument(
            self.fitted.sensor.target,
            self._mean / count,
            self._regressors / count[:, None],
            tuple(place for _, own in self._linear for place in range(own.start, own.stop)),
            tuple((effect.key, own, theta) for effect, own, theta in self._held),
            tuple(noises),
        )

    def _pieces(self, first: int, n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Where the pieces of a chunk begin that lie in one interval each, and in which; the last may lie in none."""
        low, high = max(int(self._edges[0]), first), min(int(self._edges[-1]), first + n)
        if low >= high:
            return np.zeros(1, np.int64), np.zeros(0, np.int64)
        inside = self._edges[(self._edges > low) & (self._edges < high)]
        starts = np.concatenate([[low], inside])
        into = np.searchsorted(self._edges, starts, side="right") - 1
        return np.append(starts, high)[: None if high < first + n else -1] - first, into


def _alone(motion: Motion, target: str) -> Motion:
    """The motion without a batch axis, which all runs share.

    Raises
    ------
    InputError
        If it differs from run to run.
    """

    def shared(name: str, values: Floats) -> Floats:
        first: Floats = values.reshape(-1, values.shape[-1])[0]
        if values.ndim > 1 and not np.array_equal(np.broadcast_to(first, values.shape), values):
            raise InputError(
                f"{target}: its {name} differs from run to run, as by a level error; wanted the path sample by sample"
            )
        return first

    changed: dict[str, Any] = {}
    for f in fields(motion):
        value = getattr(motion, f.name)
        if isinstance(value, np.ndarray):
            changed[f.name] = shared(f.name, value)
        elif isinstance(value, Mapping):
            changed[f.name] = {key: shared(f"{f.name}.{key}", part) for key, part in value.items()}
    return replace(motion, **changed)


def _root(covariance: Floats, key: str) -> Floats:
    """Root of the covariance of a noise: deviations alone where its means are independent, else lower triangular.

    Column by column in elementwise operations: a library's may round by its number of threads.
    """
    m = len(covariance)
    diagonal = np.diag(covariance)
    off = covariance - np.diag(diagonal)
    if np.abs(off).max(initial=0.0) <= 1e-12 * diagonal.min():
        return np.sqrt(diagonal)
    if m > MOST:
        raise InputError(f"{m} dwells of noise {key!r}, whose means are not independent; wanted {MOST} at most")
    rest, root = covariance.copy(), np.zeros((m, m))
    for j in range(m):
        # What rounding leaves of a mean that the others determine is no variance.
        pivot = rest[j, j] if rest[j, j] > 1e-13 * diagonal[j] else 0.0
        if pivot:
            root[j:, j] = rest[j:, j] / np.sqrt(pivot)
            rest[j + 1 :, j + 1 :] -= root[j + 1 :, j, None] * root[j + 1 :, j]
    return root


def _times(root: Floats, z: Floats) -> Floats:
    """Noise of unit coefficient, shape (R, m)."""
    if root.ndim == 1:
        return z * root
    e = np.zeros_like(z)
    for k in range(len(root)):
        e[:, k:] += z[:, k, None] * root[k:, k]
    return e


def _shown(edges: NDArray[np.int64]) -> str:
    return "[" + ", ".join(str(edge) for edge in edges[:6]) + (", ...]" if len(edges) > 6 else "]")


def blocks(samples: int, length: int) -> NDArray[np.int64]:
    """Edges of even blocks of ``length`` samples over ``samples``.

    Raises
    ------
    InputError
        If the blocks do not fill them.
    """
    if length < 1 or samples % length:
        raise InputError(f"blocks of {length} samples given for {samples} samples; wanted a whole number of blocks")
    return np.arange(0, samples + 1, length)
