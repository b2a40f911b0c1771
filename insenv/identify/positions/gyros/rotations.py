"""Gyros between rests: the rotation that they integrate carries the direction of gravity from one rest to the next.

    e_k = angle and axis from  C_k' n_k  to  n_k+1,     C_k = product of exp([A (w - b) dt x])

with n the direction of specific force that the calibrated accelerometers show in either rest, and b the bias of the
gyros, which goes straight from its mean in one rest to its mean in the next. Two of three components of e_k say
something; the turn about gravity is the attitude's own. At rest the means of the gyros say how the bias depends on
the attitude: `insenv.identify.positions.gyros.means`. What is uncertain of the accelerometers' calibration turns the
directions of all rests at once: its covariance, carried through to e_k, is a part of the noise.

Source: Tedaldi, Pretto and Menegatti, ICRA (2014), section III-B.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import GAP, Channel, Floats, Recording
from insenv.identify.fit.evidence import HELD_OUT_SPREAD
from insenv.identify.positions.model import AXES, NOWHEN, Linear, TriadTerm
from insenv.identify.positions.rests import Rest, means, middle_times
from insenv.identify.positions.walk import restricted_likelihood
from insenv.navigation.turned import turned

#: White parts of the noise of a turn that are tried, as shares of the variance that is left.
WHITE = (1e-3, *np.geomspace(0.03, 3.0, 13).tolist())

#: Longest step of time within a turn over which the rate goes straight from row to row [s]: a hand changes it within
#: tenths of a second, and loggers lose a row now and then.
BRIDGED = 0.05


@dataclass(frozen=True)
class Turn:
    """From one rest to the next: rates less bias, shape (n, 3) [rad/s], intervals, shape (n,) [s], numbers of both."""

    rates: Floats
    dt: Floats
    before: int
    after: int


@dataclass(frozen=True)
class Rotations:
    """Errors of the rotation from rest to rest [rad], m of them.

    Attributes
    ----------
    turns : tuple of Turn
    start, end : ndarray, shape (m, 3)
        Unit vectors of specific force in the rest before and in the one after.
    time : ndarray, shape (m,)
        Middle of each turn [s].
    fitted, held_out : ndarray of bool, shape (m,)
    level : ndarray, shape (m, 2, 3)
        Two directions across ``end`` in which the errors are told.
    root : ndarray, shape (2 m, 2 m)
        L of the noise's covariance s^2 L L', turn by turn.
    gain : float
        What the rates are times the true ones, roughly: where a fit of what scales all of them begins.
    """

    turns: tuple[Turn, ...]
    start: Floats
    end: Floats
    time: Floats
    fitted: NDArray[np.bool_]
    held_out: NDArray[np.bool_]
    level: Floats
    root: Floats
    gain: float = 1.0
    rank: int = 2
    spread: float = HELD_OUT_SPREAD

    @property
    def nuisance(self) -> Floats:
        """No unknowns but those of the effects."""
        return np.zeros(0)

    def begin(self, terms: Sequence[TriadTerm]) -> Floats:
        """At zero, shape (p,), or where E = (gain - 1) I if these terms can be that."""
        zero = np.zeros(sum(term.size for term in terms))
        if self.gain == 1 or not len(zero):
            return zero
        parts = Linear.of(terms, NOWHEN).gain.reshape(len(zero), 9).T
        wanted = (self.gain - 1) * np.eye(3).ravel()
        theta = np.linalg.lstsq(parts, wanted, rcond=None)[0]
        return np.asarray(theta, float) if np.allclose(parts @ theta, wanted) else zero

    def evaluate(self, terms: Sequence[TriadTerm], theta: Floats) -> tuple[Floats, Floats]:
        """Whitened errors, shape (m, 2), and their derivatives, shape (m, 2, p)."""
        errors, slopes = self.errors(terms, theta)
        m, p = len(errors), len(theta)
        flat = np.concatenate([errors[:, :, None], slopes], axis=2).reshape(2 * m, 1 + p)
        both = (self._whitening @ flat).reshape(m, 2, 1 + p)
        return both[:, :, 0], both[:, :, 1:]

    @cached_property
    def _whitening(self) -> Floats:
        """L^-1, shape (2 m, 2 m)."""
        return np.asarray(np.linalg.inv(self.root), np.float64)

    def errors(self, terms: Sequence[TriadTerm], theta: Floats) -> tuple[Floats, Floats]:
        """Errors across the vertical at the end, shape (m, 2), and their derivatives, shape (m, 2, p)."""
        linear = Linear.of(terms, NOWHEN)
        matrix = linear.matrix(theta)[0]
        # A changes by -A dE A; of corrected rates w that is -(A dE) w.
        change = -np.einsum("ij,pjk->pik", matrix, linear.gain[:, 0])
        errors, slopes = np.empty((len(self.turns), 2)), np.empty((len(self.turns), 2, len(theta)))
        for k, turn in enumerate(self.turns):
            attitude, tensor = turned(turn.rates, turn.dt, matrix)
            carried = attitude.T @ self.start[k]
            cross = _cross(carried, self.end[k])
            sine, cosine = float(np.linalg.norm(cross)), float(carried @ self.end[k])
            stretch = np.arctan2(sine, cosine) / sine if sine > 1e-9 else 1.0
            errors[k] = stretch * self.level[k] @ cross
            if not len(theta):
                continue
            moved = _moved(np.einsum("abc,pbc->pa", tensor, change), attitude, self.start[k], self.end[k])
            slopes[k] = stretch * self.level[k] @ moved.T
        return errors, slopes

    def plain(self, residual: Floats) -> Floats:
        """The errors before they were whitened, rotation vectors in the axes at the end, (m, 3) or (m, 3, k) [rad]."""
        flat = np.tensordot(self.root, residual.reshape(-1, *residual.shape[2:]), axes=1).reshape(residual.shape)
        return np.einsum("mij,mi...->mj...", self.level, flat)


def _moved(phi: Floats, attitude: Floats, start: Floats, end: Floats) -> Floats:
    """Change of the error vector, shape (p, 3), by small turns phi, shape (p, 3), in the axes at the start."""
    return _cross(-_cross(phi, start) @ attitude, end)


def _cross(a: Floats, b: Floats) -> Floats:
    """Vectors a, shape (..., 3), times b, shape (3,): the bits of `numpy.cross`, which spends its time on its axes."""
    (x, y, z), (u, v, w) = a.T, b
    product = np.empty(a.shape)
    product[..., 0], product[..., 1], product[..., 2] = y * w - z * v, z * u - x * w, x * v - y * u
    return product


def _across(end: Floats) -> Floats:
    """Two unit vectors across each of ``end``, shape (m, 2, 3)."""
    helper = np.eye(3)[np.argmin(np.abs(end), axis=1)]
    first = np.cross(end, helper)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(end, first)], axis=1)


def with_noise(
    problem: Rotations,
    terms: Sequence[TriadTerm],
    theta: Floats,
    direction: float,
    bias: float,
    calibration: Mapping[int, Floats],
) -> Rotations:
    """The problem with the noise that neighbouring turns share, and white noise as the fitted turns show it.

    Parameters
    ----------
    problem : Rotations
        With white noise.
    terms, theta
        Model at which the noise is looked at, and its coefficients.
    direction : float
        Variance of a component of the vertical in a rest [rad^2].
    bias : float
        Variance of the bias in a rest about what is assumed of it [rad^2/s^2].
    calibration : mapping of int to ndarray, shape (3, q)
        Of each rest, what q independent unit normals make of its direction: the errors of the calibration.
    """
    shared = _shared(problem, direction, bias, calibration)
    used = np.repeat(problem.fitted, 2)
    errors, slopes = problem.errors(terms, theta)
    y, design = errors.reshape(-1)[used], slopes.reshape(2 * len(errors), -1)[used]
    left = float(y @ y) / max(len(y) - design.shape[1], 1)

    def covariance(white: float) -> Floats:
        return (shared + white * left * np.eye(len(shared))) / left

    def likelihood(white: float) -> float:
        return restricted_likelihood(y, design, covariance(white)[np.ix_(used, used)])

    best = covariance(max(WHITE, key=likelihood))
    order = np.concatenate([np.flatnonzero(used), np.flatnonzero(~used)])
    root = np.zeros_like(best)
    root[np.ix_(order, order)] = np.linalg.cholesky(best[np.ix_(order, order)])
    return replace(problem, root=root)


def _shared(problem: Rotations, direction: float, bias: float, calibration: Mapping[int, Floats]) -> Floats:
    """Covariance of the errors by directions and biases of the rests, each of which two turns share, (2 m, 2 m)."""
    rests = sorted({number for turn in problem.turns for number in (turn.before, turn.after)})
    place = {number: 3 * i for i, number in enumerate(rests)}
    m = len(problem.turns)
    by_direction, by_bias = (np.zeros((2 * m, 3 * len(rests))) for _ in range(2))
    for k, turn in enumerate(problem.turns):
        attitude, _ = turned(turn.rates, turn.dt, np.eye(3))
        rows, a, b = slice(2 * k, 2 * k + 2), place[turn.before], place[turn.after]
        level, start, end = problem.level[k], problem.start[k], problem.end[k]
        by_direction[rows, a : a + 3] = level @ np.cross(attitude.T, end, axis=0)
        by_direction[rows, b : b + 3] = level @ np.cross(attitude.T @ start, np.eye(3)).T
        # Half of the way with the one bias and half with the other: the attitude in between is that of the middle.
        half = 0.5 * float(turn.dt.sum()) * (attitude + np.eye(3)) / 2
        by_bias[rows, a : a + 3] = by_bias[rows, b : b + 3] = level @ _moved(half.T, attitude, start, end).T
    common = by_direction @ np.concatenate([calibration[number] for number in rests])
    return direction * by_direction @ by_direction.T + bias * by_bias @ by_bias.T + common @ common.T


def rotations(
    recordings: Sequence[Recording], rests: Sequence[Rest], forces: Floats, in_turn: bool = False
) -> Rotations:
    """Turns between neighbouring rests of a run; a turn belongs to the use of the rest in which it starts.

    ``forces``, shape (rests, 3), are the calibrated specific forces; ``in_turn``: each is held out in its turn.
    """
    bias = means(recordings, rests, "gyro")
    middle = middle_times(recordings, rests)
    unit = forces / np.linalg.norm(forces, axis=1)[:, None]
    pairs = [
        (a, b)
        for a, b in pairwise(range(len(rests)))
        if rests[a].run == rests[b].run and _whole(recordings, rests, a, b)
    ]
    turns = tuple(_turn(recordings[rests[a].run], rests[a], rests[b], bias[a], bias[b]) for a, b in pairs)
    first, last = [a for a, _ in pairs], [b for _, b in pairs]
    held = np.array([rests[a].held_out for a in first], dtype=bool)
    time = 0.5 * (middle[first] + middle[last])
    root = np.eye(2 * len(turns))
    return Rotations(turns, unit[first], unit[last], time, ~held, held | in_turn, _across(unit[last]), root)


def _whole(recordings: Sequence[Recording], rests: Sequence[Rest], a: int, b: int) -> bool:
    """Whether the turn between two rests was recorded: there are rows of it, and no gap that hides how it went on."""
    recording, at = recordings[rests[a].run], rests[a].stop - 1
    steps = np.diff(recording.t[at : rests[b].start + 1])
    return len(steps) > 1 and bool(steps.max() <= max(GAP * recording.dt, BRIDGED))


def _turn(recording: Recording, before: Rest, after: Rest, bias: Floats, bias_after: Floats) -> Turn:
    """Rates from the end of one rest to the start of the next, less the bias on its way."""
    rows = slice(before.stop - 1, after.start + 1)
    t = recording.t[rows]
    channels = [recording.channels[f"gyro_{axis}"] for axis in AXES]
    columns = [_rates(c, rows, t, recording.dt) for c in channels]
    dt = np.diff(t)
    share = ((0.5 * (t[1:] + t[:-1]) - t[0]) / (t[-1] - t[0]))[:, None]
    return Turn(np.column_stack(columns) - (bias + share * (bias_after - bias)), dt, before.number, after.number)


def _rates(channel: Channel, rows: slice, t: Floats, period: float) -> Floats:
    """Mean rates between rows: a channel that covers intervals knows the last period of a longer step alone."""
    middle = 0.5 * (channel.values[rows][1:] + channel.values[rows][:-1])
    if channel.covers != "interval":
        return np.asarray(middle, float)
    steps = np.diff(t)
    known = np.where(steps > GAP * period, period / steps, 1.0)
    return np.asarray(known * channel.values[rows][1:] + (1 - known) * middle, float)
