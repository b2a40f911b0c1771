r"""Bias at rest: B_0, bias stability at any averaging time, repeatability, warm-up and Allan coefficients, on line.

    B_0 = F / K,   B_s(tau)^2 = sum (F_i - F)^2 / ((n - 1) K^2)  of means over tau,   B_r^2 = sum (B_0q - B)^2 / (Q - 1)

A record is never held: of each second the mean is kept, all else are sums (`estimators.at_rest.static_bias_kernel`).
Where a table's angle or rate is recorded only whole seconds at rest count whose neighbours rest too; segments labelled
"zero", "static" or "rest" are taken where there are labels.

Source: Zhang, DOI 10.11857/j.issn.1674-5124.2016.12.001; IEEE Std 952-1997, annex C.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sin
from typing import final

import numpy as np

from estimators.at_rest import static_bias_kernel as kernel
from estimators.at_rest import static_bias_result
from estimators.common.allan_terms import TERMS, Fit, fitted, plain
from insenv.core.compiled import of_one_type
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.rate_test import StaticResult
from insenv.core.recording import Floats, Recording
from insenv.core.units import ARCSEC, DEG
from insenv.effects.bias import Bias

#: Length of the means that are kept [s].
SECOND = 1.0
#: Averaging times of the bias stability, beside that of a sample [s].
AVERAGING = (0.01, 1.0, 10.0, 100.0)
#: A table that moves less than this in a second is at rest [rad].
MOVES = 10 * ARCSEC
#: Standard deviations where nothing is known: of a bias [rad/s]; of a noise coefficient, in its SI unit.
ANY_BIAS, ANY_NOISE = 0.1 * DEG, 1e-3
NOISES = TERMS[:4]
_UNITS = ("rad", "rad/sqrt(s)", "rad/s", "rad/s/sqrt(s)")
_RESTS = ("zero", "static", "rest")
_Five = tuple[Floats, Floats, Floats, Floats, Floats]


@dataclass(frozen=True)
class Record:
    """What is kept of a record at rest.

    Attributes
    ----------
    now, buffer, held : ndarray, shapes (..., STATE), (..., size), (..., size)
        The block under way and the one that is held back.
    moments, cascade : ndarray, shapes (..., times, 8), (..., LEVELS, 6)
        Sums for bias stability and Allan deviation.
    pieces : tuple of ndarray, each of shape (..., m, 4)
        Means over a second: time since the power-up, output, temperature, power-up; NaN where there is none.
    """

    now: Floats
    buffer: Floats
    held: Floats
    moments: Floats
    cascade: Floats
    pieces: tuple[Floats, ...] = ()


@final
@dataclass(frozen=True)
class StaticBias:
    """Bias of a gyro at rest.

    Needs "gyro" [rad/s]; takes "table_angle" [rad] or "table_rate" [rad/s], "temperature" [K], "power" and segments
    where they are there.

    Attributes
    ----------
    datasheet : Datasheet
    averaging : tuple of float
        Averaging times of the bias stability [s]; those below a sampling period count as one.
    warm_up : float
        Time after each power-up that B_0 leaves out [s]; the bias stability is given with and without.
    scale_factor : float
        K.

    Raises
    ------
    InputError
        If a time is not positive or K is zero.
    """

    datasheet: Datasheet
    averaging: tuple[float, ...] = AVERAGING
    warm_up: float = 0.0
    scale_factor: float = 1.0

    def __post_init__(self) -> None:
        if not all(0 < tau < np.inf for tau in self.averaging):
            raise InputError(f"static_bias: averaging = {list(self.averaging)} s; wanted times above zero")
        if not 0 <= self.warm_up < np.inf:
            raise InputError(f"static_bias: warm_up = {self.warm_up:g} s; wanted zero or more")
        if not abs(self.scale_factor) > 0:
            raise InputError("static_bias: scale_factor = 0; wanted output per rate")

    @property
    def size(self) -> int:
        """Samples of a mean that is kept."""
        return max(1, round(SECOND / self.datasheet.dt))

    @property
    def factors(self) -> tuple[int, ...]:
        """Samples of the averaging times, ascending, the first a single one."""
        return tuple(sorted({1, *(max(1, round(tau / self.datasheet.dt)) for tau in self.averaging)}))

    @property
    def earth_rate(self) -> float:
        """Vertical Earth rate on the input axis [rad/s]; NaN where no latitude is told."""
        sheet = self.datasheet
        latitude = sheet.site.latitude
        return float("nan") if latitude is None else EARTH_RATE * sin(latitude) * sin(sheet.mounting.tilt)

    def reset(self, batch: int | None = None) -> Record:
        """Nothing measured."""
        front = () if batch is None else (batch,)
        size = self.size
        return Record(
            np.zeros((*front, kernel.STATE)),
            np.zeros((*front, size)),
            np.zeros((*front, size)),
            np.zeros((*front, len(self.factors), 8)),
            np.zeros((*front, kernel.LEVELS, 6)),
        )

    def update(self, state: Record, chunk: Recording) -> Record:
        """After a chunk."""
        if not chunk.segments:
            return self._walked(state, chunk, slice(None))
        for segment in chunk.segments:
            if segment.label.strip().lower().startswith(_RESTS):
                state = self._walked(state, chunk, slice(segment.start, segment.stop))
        return state

    def estimate(self, state: Record) -> Estimate:
        """B_0 less the Earth rate where that is known [rad/s], and the noise coefficients [SI].

        Shapes (..., 5) and (..., 5, 5); what is not yet known is 0 with a wide variance.
        """
        front = state.now.shape[:-1]
        found = [self._of_row(row) for row in _rows(state)]
        mean, sd = (np.array([f[i] for f in found]).reshape(*front, 5) for i in range(2))
        return Estimate((Bias.id, *NOISES), ("rad/s", *_UNITS), mean, sd[..., None] ** 2 * np.eye(5))

    def result(self, state: Record, label: str = "recording") -> StaticResult | None:
        """All that a report shows of a single run, without a batch; None where there is no second at rest."""
        return self._result(state, label, fitted)

    def _result(self, state: Record, label: str, fit: Fit) -> StaticResult | None:
        state = self._flushed(state)
        if not len(series := _series(state)):
            return None
        settings = static_bias_result.Settings(
            label=label,
            dt=self.datasheet.dt,
            size=self.size,
            factors=self.factors,
            warm_up=self.warm_up,
            scale_factor=self.scale_factor,
            earth_rate=self.earth_rate,
            tilt=self.datasheet.mounting.tilt,
        )
        return static_bias_result.result(series, state.moments, state.cascade, settings, fit)

    def _of_row(self, state: Record) -> tuple[list[float], list[float]]:
        found = self._result(state, "recording", plain)  # asked at every step: no search for further terms
        if found is None:
            return 5 * [0.0], [ANY_BIAS, *(4 * [ANY_NOISE])]
        earth = 0.0 if np.isnan(found.earth_rate) else found.earth_rate
        values = [found.allan.coefficients[name] for name in NOISES if name in found.allan.coefficients]
        padded = [*((v.value, v.sd) for v in values), *(4 * [(0.0, ANY_NOISE)])][:4]
        mean, sd = zip((found.bias.value - earth, found.bias.sd), *padded, strict=True)
        return list(mean), [s if np.isfinite(s) else ANY_BIAS for s in sd]

    def _walked(self, state: Record, chunk: Recording, at: slice) -> Record:
        """After some rows of a chunk."""
        t = of_one_type(chunk.t)[at]
        y = chunk.values("gyro", "rad/s")[..., at]
        front, n = state.now.shape[:-1], len(t)
        rows = int(np.prod(front, dtype=int))
        moving, limit = _motion(chunk, self.datasheet)
        labelled = bool(chunk.segments)
        there = chunk.channels
        temperature = chunk.values("temperature", "K")[..., at] if "temperature" in there else np.full(n, np.nan)
        power = chunk.values("power", "1")[..., at] if "power" in there else np.ones(n)
        angle = np.zeros(n) if moving is None or labelled else moving[..., at]
        wide = tuple(of_one_type(c, (*front, n)).reshape(rows, n) for c in (y, angle, temperature, power))
        settings = (self.datasheet.dt, 0.0 if moving is None or labelled else 1.0, limit)
        now, buffer, held, moments, cascade = _copies(state, rows)
        made, count = np.full((rows, n // self.size + 3, 4), np.nan), np.zeros(rows, np.int64)
        kernel.walk(t, wide, settings, np.array(self.factors), (now, buffer, held, moments, cascade, made, count))
        most = int(count.max(initial=0))
        pieces = _appended(state.pieces, made[:, :most].reshape(*front, most, 4))
        return Record(*_shaped((now, buffer, held, moments, cascade), state), pieces)

    def _flushed(self, state: Record) -> Record:
        """With the block that is held back."""
        now, buffer, held, moments, cascade = _copies(state, 1)
        made, count = np.full((1, 1, 4), np.nan), np.zeros(1, np.int64)
        row = (now[0], buffer[0], held[0], moments[0], cascade[0], made[0], count, buffer[0].copy())
        kernel.release(row, np.array(self.factors))
        pieces = _appended(state.pieces, made[0, : count[0]])
        return Record(now[0], buffer[0], held[0], moments[0], cascade[0], pieces)


def _arrays(state: Record) -> _Five:
    return state.now, state.buffer, state.held, state.moments, state.cascade


def _copies(state: Record, rows: int) -> tuple[Floats, ...]:
    """The state's arrays to be changed, with one axis for the batch."""
    own = (1, 1, 1, 2, 2)
    return tuple(a.reshape(rows, *a.shape[a.ndim - k :]).copy() for a, k in zip(_arrays(state), own, strict=True))


def _shaped(arrays: tuple[Floats, ...], like: Record) -> _Five:
    """Arrays in the shapes of those of a state."""
    now, buffer, held, moments, cascade = (a.reshape(b.shape) for a, b in zip(arrays, _arrays(like), strict=True))
    return now, buffer, held, moments, cascade


def _rows(state: Record) -> list[Record]:
    """Each run of a batch alone; the one run where there is no batch."""
    if state.now.ndim == 1:
        return [state]
    return [
        Record(now, buffer, held, moments, cascade, tuple(piece[i] for piece in state.pieces))
        for i, (now, buffer, held, moments, cascade) in enumerate(zip(*_arrays(state), strict=True))
    ]


def _appended(pieces: tuple[Floats, ...], piece: Floats) -> tuple[Floats, ...]:
    """With one more piece; neighbours that are no longer than the next are joined, so that there are never many."""
    if not piece.shape[-2]:
        return pieces
    while pieces and pieces[-1].shape[-2] <= piece.shape[-2]:
        piece = np.concatenate([pieces[-1], piece], axis=-2)
        pieces = pieces[:-1]
    return (*pieces, piece)


def _series(state: Record) -> Floats:
    """Means over a second that are there, shape (m, 4)."""
    whole = np.concatenate([np.zeros((0, 4)), *state.pieces])
    return whole[np.isfinite(whole[:, 1])]


def _motion(chunk: Recording, sheet: Datasheet) -> tuple[Floats | None, float]:
    """The table's angle [rad], shape (..., n), or None where no channel tells of a table; what counts as rest [rad]."""
    limit = MOVES + 8 * sheet.encoder_noise
    if "table_angle" in chunk.channels:
        return chunk.values("table_angle", "rad"), limit
    if "table_rate" in chunk.channels:
        # Within a block differences count alone, so that it may begin anywhere.
        return np.cumsum(chunk.values("table_rate", "rad/s") * sheet.dt, axis=-1), limit
    return None, limit
