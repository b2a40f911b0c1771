r"""The next rate by the expected information per second about where a gyro is out of its limits.

    residual = b + c x + a |x| + sign(x) h(|x|),     h a Gaussian process of deviation A and length l

With mean m and variance s^2 of h at a candidate, P = P(|h| > limit), and a dwell that lessens s^2 by g (the rest of the
residual is in doubt too),

    I = H(P) - E H(P'),     s'^2 = s^2 - g,   m' ~ N(m, g)

nats are gained in dwell + slewing seconds; the expectation is a Gauss-Hermite sum. Where nothing is known that fills
the space; where the tail of a fault was touched it goes there. The largest rate comes first, both ways: with low rates
alone a fault is taken for a slope. Source: D. J. C. MacKay, Neural Comput. 4 (1992) 590; level sets: A. Gotovos et
al., IJCAI (2013).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimators.rate_table import rate_ladder_tally as tallies
from estimators.rate_table.rate_ladder import (
    EMPTY,
    GO,
    STOP,
    Queue,
    QueuePlace,
    action,
    moved,
    over,
    started,
    time_of,
    top_rate,
)
from estimators.rate_table.rate_ladder_tally import Tally
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.rows import rows
from insenv.core.units import DEG, DEG_PER_HOUR

#: Deviations of bias [rad/s], scale factor and asymmetry before anything is measured.
_BIAS, _SCALE, _ASYMMETRY = 100 * DEG_PER_HOUR, 5e-3, 1e-4
#: Nodes of the expectation.
_NODES = 7


@dataclass(frozen=True)
class Learnt:
    """State of a test: what was run, and what it recorded; shapes (..., m)."""

    queue: Queue
    place: QueuePlace
    tally: Tally


class GreedyInformation:
    """A greedy choice, one dwell after the other.

    Parameters
    ----------
    datasheet : Datasheet
    settings : int
        Number of dwells.
    dwell : float
        [s]
    limit : float
        Of a local error [rad/s].
    length, amplitude : float
        Of the Gaussian process [rad/s].
    spacing : float
        Of the candidates [rad/s].
    top : float, optional
        Largest rate [rad/s]; default: that of the published test, as far as the table has it.

    Raises
    ------
    InputError
        If one of them is not positive, or the table has not the rate.
    """

    def __init__(  # noqa: PLR0913 - settings, each with its default
        self,
        datasheet: Datasheet,
        settings: int = 70,
        dwell: float = 5.0,
        *,
        limit: float = 0.005 * DEG,
        length: float = 0.35 * DEG,
        amplitude: float = 0.01 * DEG,
        spacing: float = 0.25 * DEG,
        top: float | None = None,
    ) -> None:
        given = {"settings": settings, "dwell": dwell, "limit": limit, "length": length, "amplitude": amplitude}
        for name, value in (given | {"spacing": spacing}).items():
            if not 0 < value < np.inf:
                raise InputError(f"greedy_information: {name} = {value:g} given, wanted a positive one")
        self.datasheet, self.settings, self.dwell = datasheet, settings, dwell
        self.limit, self.length, self.amplitude = limit, length, amplitude
        self.acceleration = datasheet.limits.acceleration
        self.top = top_rate(datasheet, top)
        magnitude = np.linspace(0.0, self.top, int(np.ceil(self.top / spacing)) + 1)[1:]
        self.candidates = np.concatenate([magnitude, -magnitude])

    def reset(self, batch: int | None = None) -> Learnt:
        """The first two dwells, and room for the others."""
        front = () if batch is None else (batch,)
        first = np.resize([self.top, -self.top], self.settings)
        queue = EMPTY.append(first, self.dwell).append(0.0, np.inf, STOP)
        queue = Queue(*(np.broadcast_to(a, (*front, len(a))).copy() for a in (queue.rate, queue.hold, queue.signal)))
        return Learnt(queue, started(queue, self.acceleration, batch), tallies.empty(self.settings + 1, batch))

    def act(self, state: Learnt, chunk: Recording | None, estimate: Estimate | None = None) -> tuple[Floats, Learnt]:
        """Rate and signal of the dwell that is under way, shape (..., 2)."""
        t = time_of(chunk)
        if chunk is not None and len(chunk):
            state = replace(state, tally=tallies.added(state.tally, chunk, state.place, self.datasheet))
        ended = over(state.place, state.queue, t)
        ended &= (state.place.entry >= 1) & (state.place.entry < self.settings - 1)
        if np.any(ended):
            state = replace(state, queue=self._extended(state, ended))
        place = moved(state.place, state.queue, t, self.acceleration)
        return action(place, state.queue, t), replace(state, place=place)

    def _extended(self, state: Learnt, ended: NDArray[np.bool_]) -> Queue:
        """With the next entry of the runs whose entry has ``ended``."""
        parts = [a.copy() for a in (state.queue.rate, state.queue.hold, state.queue.signal)]
        at = (np.flatnonzero(ended),) if ended.ndim else ()
        chosen = self.entry(rows(state, at[0]) if at else state)
        for part, value in zip(parts, chosen, strict=True):
            part[(*at, state.place.entry[at] + 1)] = value
        return Queue(*parts)

    def entry(self, state: Learnt) -> tuple[Floats, Floats, Floats]:
        """Rate [rad/s], time [s] and signal of the next entry, shape (...) each."""
        rate = self.choice(state)
        return rate, np.full(rate.shape, self.dwell), np.full(rate.shape, GO)

    def choice(self, state: Learnt) -> Floats:
        """The candidate [rad/s] of the most expected information per second, shape (...)."""
        mean, variance, told = self.process(state, self.candidates)
        now = np.take_along_axis(state.queue.rate, np.asarray(state.place.entry)[..., None], axis=-1)
        seconds = self.dwell + np.abs(self.candidates - now) / self.acceleration
        gain = self.information(mean, variance, told) / seconds
        return np.asarray(self.candidates[gain.argmax(axis=-1)])

    def process(self, state: Learnt, rate: Floats) -> tuple[Floats, Floats, Floats]:
        """Mean and variance of the local error h at rates, shape (k,), and how much a dwell there lessens the latter.

        Each of shape (..., k).
        """
        tally, used = state.tally, slice(0, int(np.max(state.place.entry)) + 1)
        time = tally.time[..., used]
        known = time > 0
        x, y = (np.where(known, values[..., used], 0.0) for values in (tally.rate, tally.residual))
        v = np.where(known, tallies.variance(time, self.datasheet, 0.0), 1.0)
        row, column = x[..., :, None], x[..., None, :]
        # An entry that was not run has no weight: a unit variance of its own, and no covariance.
        both = known[..., :, None] & known[..., None, :]
        C = np.where(both, self._local(row, column) + _smooth(row, column), 0.0)
        C[..., np.arange(x.shape[-1]), np.arange(x.shape[-1])] += v
        local = np.where(known[..., None], self._local(row, rate), 0.0)
        whole = local + np.where(known[..., None], _smooth(row, rate), 0.0)
        solved = np.linalg.solve(C, np.concatenate([local, whole, y[..., None]], axis=-1))
        k = len(rate)
        of_local, of_whole = solved[..., :k], solved[..., k : 2 * k]
        mean = np.sign(rate) * np.einsum("...ij,...i->...j", local, solved[..., -1])
        own = self.amplitude**2
        variance = np.maximum(own - np.einsum("...ij,...ij->...j", local, of_local), 1e-12 * own)
        shared = own - np.einsum("...ij,...ij->...j", local, of_whole)
        read = own + _smooth(rate, rate) - np.einsum("...ij,...ij->...j", whole, of_whole)
        noise = float(tallies.variance(np.array(self.dwell), self.datasheet, 0.0))
        return mean, variance, np.minimum(shared**2 / (np.maximum(read, 0.0) + noise), (1 - 1e-9) * variance)

    def _local(self, a: Floats, b: Floats) -> Floats:
        """Covariance of the local errors at two rates, odd in each."""
        distance = (np.abs(a) - np.abs(b)) / self.length
        kernel: Floats = self.amplitude**2 * np.sign(a) * np.sign(b) * np.exp(-0.5 * distance**2)
        return kernel

    def information(self, mean: Floats, variance: Floats, told: Floats) -> Floats:
        """Of one dwell at each candidate, about whether it is out of its limits [nat]."""
        nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
        shifted = mean[..., None] + np.sqrt(told)[..., None] * nodes
        later = self._doubt(shifted, (variance - told)[..., None]) @ (weights / weights.sum())
        gain: Floats = self._doubt(mean, variance) - later
        return gain

    def _doubt(self, mean: Floats, variance: Floats) -> Floats:
        """Entropy of whether the local error is beyond its limit [nat]."""
        from scipy.special import entr, ndtr

        sd = np.sqrt(variance)
        out = ndtr((mean - self.limit) / sd) + ndtr((-mean - self.limit) / sd)
        entropy: Floats = entr(out) + entr(np.maximum(1 - out, 0.0))
        return entropy


def _smooth(a: Floats, b: Floats) -> Floats:
    """Covariance of bias, scale factor and asymmetry at two rates."""
    return _BIAS**2 + _SCALE**2 * a * b + _ASYMMETRY**2 * np.abs(a * b)
