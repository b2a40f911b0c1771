r"""Directions of a north finder by what they are expected to tell: greedy, or over a receding horizon.

With c = l cos az, s = l sin az, l the level Earth rate on the axis, and C the covariance of (c, s) after a sequence,

    var(az) = E[v' C v] / l^2,   v = (-sin az, cos az),   E[v v'] = (1 - rho) I / 2 + rho w w',   rho = exp(-2 sd^2),

w at the azimuth that is believed, sd its deviation. Before anything is known rho = 0 and all directions count alike:
the table turns. Once the azimuth is roughly known, the angles at which the Earth's rate moves most with it tell more
than the others: there the table turns back and forth, and changes sides as the bias asks for it. So what was read
decides what is done: the information depends on the azimuth, and no plan that is made beforehand can know it.

One magnitude of the rate is kept for a run: an error of the scale factor that is odd in the rate, as lock-in is, then
has the one polynomial that `estimators.north_finder.gls` gives it. With several it shows as an error of north.

What is known so far is the normal matrix of `north_gls` itself, of the motion that the encoder recorded; what a
sequence would add is computed by `estimators.north_finder.ahead`. It is meant for that estimator: those that need whole
revolutions at a steady rate, as `correlation` and `revolution` do, have little of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from estimators.common import horizon
from estimators.common.horizon import Aim
from estimators.common.rate_policies import checked_rate
from estimators.north_finder import ahead as north_ahead
from estimators.north_finder.gls import KNOWN_SD, GlsState, NorthGls
from estimators.north_finder.kernel import ANGLE, BACKWARD, FORWARD, ORDERS
from estimators.north_finder.rate_choice import plan
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import ARCSEC, DEG
from insenv.effects.angle import EncoderHarmonic
from insenv.information.rate_noise import density, white_angle

#: Length of a piece: a decision is taken anew after each [s].
PIECE = 3.0
#: Deviation that is demanded of the azimuth [rad].
DEMANDED = 30 * ARCSEC
#: Turn that comes first: the levelling asks for a whole revolution and a little more [rad].
FIRST_TURN = 1.05 * 2 * np.pi


class _Gls(NorthGls):
    """`NorthGls`, and what it knows as a matrix."""

    def information(self, state: GlsState) -> Floats:
        """Information of the motion so far with the priors, shape (R, p, p); c and s in the last two places."""
        normal = state.normal.reshape(-1, *state.normal.shape[-2:])
        p = len(self._mean)
        place = np.r_[2:p, 0:2]
        precision = self._precision.copy()
        if self.datasheet.told(EncoderHarmonic(1).key, "gyro") is None:
            precision[p - 2 * ORDERS : p - 2 * ORDERS + 2] = KNOWN_SD**-2.0
        precision[:2] = 2 / max(self.level, 1e-30) ** 2  # on the circle
        matrix = normal[:, :p, :p] + np.diag(precision)
        return np.ascontiguousarray(0.5 * (matrix + matrix.swapaxes(-1, -2))[:, place][:, :, place])


@dataclass(frozen=True)
class RunsTurning:
    """Where the runs stand; the batch in front.

    Attributes
    ----------
    known : GlsState
        What was recorded.
    rate : ndarray, shape (...)
        That the table has [rad/s], and ``wanted`` that it was told.
    until : ndarray, shape (...)
        Time of the next decision [s].
    sd, gain : ndarray, shape (...)
        Deviation of the azimuth at the last decision [rad], and the gain that was expected of the best sequence
        [nat/s].
    """

    known: GlsState
    rate: Floats
    wanted: Floats
    until: Floats
    sd: Floats
    gain: Floats


class _Ahead:
    """Base: sequences of rates, the best of which is begun.

    Parameters
    ----------
    datasheet : Datasheet
    demanded : float
        Deviation of the azimuth at which to stop [rad]; 0: none.
    price : float
        Least gain by the second [nat/s].
    rate : float, optional
        Magnitude of the table's rate [rad/s]; default: that of `estimators.north_finder.rate_choice`.
    piece : float
        Time between two decisions [s].

    Raises
    ------
    InputError
        Without a latitude or a duration, if the table has not the rate, or a setting is not positive.
    """

    def __init__(
        self,
        datasheet: Datasheet,
        demanded: float = DEMANDED,
        price: float = 0.0,
        rate: float | None = None,
        piece: float = PIECE,
    ) -> None:
        if datasheet.mounting.gimbals is not None:
            raise InputError(
                f"a table with axes {datasheet.mounting.gimbals.axes!r}; wanted one that turns about one axis"
            )
        self.aim = Aim(demanded, price)
        self.rate = plan(datasheet).rate if rate is None else abs(checked_rate(datasheet, rate))
        if not (self.rate > 0 and 0 < piece < np.inf):
            raise InputError(f"a rate of {self.rate / DEG:g} deg/s and pieces of {piece:g} s given; wanted more than 0")
        self.datasheet, self.piece, self.gls = datasheet, piece, _Gls(datasheet)
        self.plans = self._plans(self.rate)
        self.seconds = piece * np.isfinite(self.plans).sum(axis=1)
        walk = datasheet.white("gyro")
        noise = walk**2 + density(datasheet, self.plans[:, 0], self.gls.share)
        white = white_angle(datasheet) ** 2 * datasheet.dt
        self._weights = 1 / np.maximum(noise, 1e-30)
        lost = 2 * float(np.sqrt(white / max(walk**2, 1e-30)))
        acceleration = min(datasheet.limits.acceleration, 1e6)
        gls = self.gls
        self._numbers = np.array(
            [piece, acceleration, gls.share, gls.vertical, gls.span, min(lost, 0.5 * piece)], np.float64
        )
        self._levelled = gls._levelling is not None

    def reset(self, batch: int | None = None) -> RunsTurning:
        """At rest, nothing known; a decision is due."""
        zero = np.zeros(() if batch is None else batch)
        return RunsTurning(self.gls.reset(batch), zero, zero, zero, zero + np.inf, zero + np.inf)

    def act(
        self, state: RunsTurning, chunk: Recording | None, estimate: Estimate | None = None
    ) -> tuple[Floats, RunsTurning]:
        """Rate and stop of each run, shape (..., 2)."""
        t = 0.0
        if chunk is not None and len(chunk):
            t = float(chunk.t[-1])
            state = replace(state, known=self.gls.update(state.known, chunk), rate=self._rate(state, chunk))
        due = np.asarray(state.until <= t + 0.5 * self.datasheet.dt)
        if due.any():
            state = self._decided(state, due, t)
        over = t + 0.5 * self.datasheet.dt >= self.datasheet.duration
        stop = (self.aim.reached(state.sd, state.gain) & (t > 0)) | over
        return np.stack([state.wanted, stop.astype(float)], axis=-1), state

    def _plans(self, rate: float) -> Floats:
        """Sequences, shape (S, K); NaN behind those that are shorter."""
        raise NotImplementedError

    def _rate(self, state: RunsTurning, chunk: Recording) -> Floats:
        """Of the table at the end of a chunk [rad/s], from the last samples of the encoder."""
        angle = np.broadcast_to(chunk.values("table_angle", "rad"), (*np.shape(state.rate), len(chunk)))
        n = min(len(chunk) - 1, max(int(0.1 * self.datasheet.sampling), 1))
        if n < 1:
            return state.wanted
        return np.asarray((angle[..., -1] - angle[..., -1 - n]) / (n * self.datasheet.dt))

    def _decided(self, state: RunsTurning, due: NDArray[np.bool_], t: float) -> RunsTurning:
        """With the rates for the next piece, of the runs that are ``due``."""
        told = self.gls.estimate(state.known)
        azimuth, sd = (np.reshape(a, -1) for a in told.of("azimuth"))
        sums = state.known.sums.reshape(-1, state.known.sums.shape[-1])
        rate = np.where(np.isclose(state.rate, state.wanted, rtol=5e-3), state.wanted, state.rate).reshape(-1)
        start = np.stack([sums[:, ANGLE], rate, np.full_like(rate, t)], axis=-1)
        now, then = self._expected(self.gls.information(state.known), start, (azimuth, sd))
        gains = horizon.gain(now[:, None], then, self.seconds)
        if self._levelled:
            first = sums[:, FORWARD] + sums[:, BACKWARD] < FIRST_TURN
            gains[first[:, None] & np.any(self.plans < 0, axis=1)] = -np.inf
        best = gains.argmax(axis=-1)
        shape = np.shape(state.rate)
        wanted = self.plans[best, 0].reshape(shape)
        gained = np.take_along_axis(gains, best[:, None], axis=-1).reshape(shape)
        return replace(
            state,
            wanted=np.where(due, wanted, state.wanted),
            until=np.where(due, t + self.piece, state.until),
            sd=np.where(due, sd.reshape(shape), state.sd),
            gain=np.where(due, gained, state.gain),
        )

    def _expected(self, known: Floats, start: Floats, belief: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """Deviations of the azimuth [rad] now, shape (R,), and after each sequence, shape (R, S)."""
        azimuth, sd = belief
        # A sequence without a piece stands first: what is known now.
        plans = np.concatenate([np.full((1, self.plans.shape[1]), np.nan), self.plans])
        weights = np.concatenate([[0.0], self._weights])
        found = np.empty((len(known), len(plans), 3))
        gls = self.gls
        north_ahead.compiled()(known, start, plans, weights, self._numbers, gls.degree, gls.bias_degree, found)
        rho = np.exp(-2 * sd**2)
        a, b = -np.sin(azimuth), np.cos(azimuth)
        weight = np.stack([0.5 * (1 - rho) + rho * a * a, 2 * rho * a * b, 0.5 * (1 - rho) + rho * b * b], axis=-1)
        deviation = np.sqrt((weight[:, None, :] * found).sum(axis=-1)) / max(gls.level, 1e-30)
        return deviation[:, 0], deviation[:, 1:]


@final
class GreedyNorth(_Ahead):
    """One direction for one to four pieces, by the gain by the second; settings as of `HorizonNorth`."""

    def _plans(self, rate: float) -> Floats:
        return np.array([[w] * n + [np.nan] * (4 - n) for w in (rate, -rate) for n in (1, 2, 4)])


@final
class HorizonNorth(_Ahead):
    """Fourteen pieces with two reversals at most, by the deviation at their end.

    Parameters
    ----------
    datasheet : Datasheet
    demanded : float
        Deviation of the azimuth at which to stop [rad]; 0: none.
    price : float
        Least gain by the second [nat/s].
    rate : float, optional
        Magnitude of the table's rate [rad/s]; default: that of `estimators.north_finder.rate_choice`.
    piece : float
        Time between two decisions [s].
    """

    def _plans(self, rate: float) -> Floats:
        return rate * horizon.sequences(14, 2)
