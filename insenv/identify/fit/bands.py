r"""The input in bands of frequency: what a response of the reference that nobody foretold makes of it.

A reference that was filtered, interpolated or read through a shaft that bends has a gain and a phase that go with the
frequency, and so has one into which another axis leaks that moves along. To first order what it leaves is F b: F the
input in bands, as it is and a quarter of a wave late, b ~ N(0, S^2) with S = tau f^gamma, f in swings of the table,
and a constant beside it (S^2 is the sum of both squares). With r what is left, whitened and beside the model, the
marginal likelihood says them:

    l(S) = -1/2 log |I + S F'F S| + 1/2 r'F (F'F + S^-2)^-1 F'r

Source: D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415.
"""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from insenv.core.recording import Floats
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem

#: Bands to the octave at least, and swings' frequencies up to which each has a band of its own.
PER_OCTAVE, OWN_BANDS = 2.0, 20.5
#: Waves in a run of the slowest band that is not the first.
SLOWEST = 4.0
#: Departures of the gain that are tried, and the powers of the frequency with which they may grow.
SIZES, POWERS = np.geomspace(1e-4, 0.3, 24), (0.0, 1.0, 2.0)
#: Departures at all frequencies that are tried beside one that grows: an axis that leaks in, and a filter.
FLOORS = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2)


def in_bands(problem: Problem) -> tuple[Floats, Floats]:
    """The input in bands in the modes of the fitted blocks, shape (modes, k), and each one's frequency, in swings."""
    found: tuple[Floats, Floats] = problem.remember(("bands", problem.bins.width), lambda: _in_bands(problem))
    return found


def response(products: Floats, score: Floats, frequency: Floats) -> tuple[Floats, float]:
    """Standard deviations S of the bands' coefficients, shape (k,), and the gain l of the likelihood; zeros where none.

    Parameters
    ----------
    products : ndarray, shape (k, k)
        F'F, whitened and beside the model.
    score : ndarray, shape (k,)
        F'r.
    frequency : ndarray, shape (k,)
        As of `in_bands`.
    """
    best, sizes = 0.0, np.zeros(len(score))
    for power in POWERS:
        gain, found = _likeliest(products, score, frequency**power)
        if gain > best:
            best, sizes = gain, found
    for floor in FLOORS if best and np.ptp(sizes) else ():
        gain, found = _likeliest(products, score, np.hypot(sizes, floor), np.ones(1))
        if gain > best + 1e-9 * abs(best):
            best, sizes = gain, found
    return sizes, best


def _likeliest(products: Floats, score: Floats, shape: Floats, times: Floats = SIZES) -> tuple[float, Floats]:
    """Gain of the likelihood at the best of some multiples of ``shape``, and the standard deviations there."""
    values, vectors = np.linalg.eigh(products * np.outer(shape, shape))
    along, values = (vectors.T @ (score * shape)) ** 2, np.maximum(values, 0.0)
    t = times[:, None] ** 2
    gain = 0.5 * np.sum(t * along / (1 + t * values) - np.log1p(t * values), axis=1)
    top = int(np.argmax(gain))
    return float(gain[top]), times[top] * shape


def _in_bands(problem: Problem) -> tuple[Floats, Floats]:
    motion = problem.exposures[0].motion
    edges = _edges(motion.dt * max(e.motion.n for e in problem.exposures), motion.dt, 1 / swing(problem))
    parts = [_filtered(e.u, motion.dt, edges) for e in problem.exposures]
    columns = transform(problem.fitted, problem.bins.mean(tuple(parts)))
    size = np.linalg.norm(columns, axis=0).reshape(-1, 2).max(axis=1)
    kept = np.flatnonzero(size > 1e-9 * size.max(initial=1e-300))
    middle = np.sqrt(edges[1:-1] * np.append(edges[2:-1], 0.5 / motion.dt))
    frequency = np.concatenate([edges[1:2], middle])[: len(size)] * swing(problem)
    return columns.reshape(len(columns), -1, 2)[:, kept].reshape(len(columns), -1), np.repeat(frequency[kept], 2)


def _edges(time: float, dt: float, swings: float) -> Floats:
    """Ends of the bands [Hz] up to the frequency of the cells: one to a harmonic of the swings, or two to an octave."""
    edges, most = [0.0, SLOWEST / time], 0.5 / dt
    while edges[-1] < most:
        last = edges[-1]
        wider = last * 2 ** (1 / PER_OCTAVE)
        following = wider if wider - last < swings or last > OWN_BANDS * swings else last + swings
        # The first harmonic stands in the middle of its band.
        edges.append(0.5 * swings if last < 0.5 * swings < following else following)
    return np.array([*edges[:-1], np.inf])


def _filtered(u: Floats, dt: float, edges: Floats) -> Floats:
    """An input in bands, and the same a quarter of a wave late, in turn, shape (n, 2 bands)."""
    n = len(u)
    size = next_fast_len(2 * n, real=True)
    at = np.arange(size // 2 + 1) / (size * dt)
    level = u - u.mean()
    # As if it went on at its mean; at its ends a band reads a little of that.
    spectrum = rfft(level, size)
    out = np.empty((n, 2 * (len(edges) - 1)))
    for j, (low, high) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
        band = np.where((at >= low) & (at < high), spectrum, 0.0)
        out[:, 2 * j : 2 * j + 2] = irfft(np.stack([band, -1j * band]), size)[:, :n].T
    return out


def swing(problem: Problem) -> float:
    """Time of one swing of the table: the reciprocal of the mean frequency of the rate's power [s]."""
    return float(problem.remember("swing", lambda: _swing(problem)))


def _swing(problem: Problem) -> float:
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    power, weighted = 0.0, 0.0
    for block in problem.fitted:
        spectrum = np.abs(rfft(u[block.start : block.stop] - u[block.start : block.stop].mean())) ** 2
        power += float(spectrum.sum())
        weighted += float(spectrum @ np.arange(len(spectrum))) / (block.n * problem.bins.width)
    longest = max(b.n for b in problem.fitted) * problem.bins.width
    return min(power / weighted, longest) if weighted > 0 else longest
