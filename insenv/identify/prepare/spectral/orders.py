"""Waves of the table's angle that no effect foresees, in what is left.

The whitened residual r of bin i at the angle a_i is compared with waves of the angle, in windows of time so that their
amplitude and phase may change, over all blocks:

    sum_w |sum_i r_i exp(i k a_i)|^2 2 / n_w ~ chi-square with 2 degrees of freedom for each window w

for orders k that need not be whole: gears, belts and pole pairs turn at rates of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from insenv.core.recording import Floats

#: Orders that are tried: cycles per turn.
ORDERS = np.concatenate([np.arange(0.5, 8.0, 0.125), np.arange(8.0, 33.0)])
#: Numbers of windows that the longest block is cut into; shorter ones into fewer.
WINDOWS = (1, 3, 9, 27)
#: Bins in a window, and turns of the table, at least.
LEAST_BINS, LEAST_TURNS = 16, 1.0
#: Highest whole order of which a line may be, and the gain of its likelihood that noise does not have.
MOST_ORDER, BEYOND_NOISE = 32, 25.0
#: Share of what a wave of time takes from which on a wave of the angle does as well, of a table that turns so often; of
#: fewer turns any line is nearly an order, and the wave must take so much more.
AS_WELL, MANY_TURNS, BETTER = 0.8, 8.0, 10.0
#: Frequencies on either side at which a wave of time is tried.
FINE = 8
#: Cycles per bin above which a wave is averaged away.
MOST_CYCLES = 0.4


@dataclass(frozen=True)
class Wave:
    """The wave of the angle that what is left follows best: its cycles per turn, and how probably noise does so."""

    order: float
    p_value: float


def strongest(blocks: Sequence[tuple[Floats, Floats, Floats]]) -> Wave:
    """The wave of the angle that is least likely to be noise, its probability multiplied by all that were tried.

    Parameters
    ----------
    blocks : sequence of (residual, angle, change), each of shape (n,)
        Of consecutive bins: the residual, white and of unit variance if only noise is left; the angle of the table in
        the middle of each bin, and by how much it turns in a bin [rad].
    """
    waves = [_waves(angle, change) for _, angle, change in blocks]
    longest, found, tried = max((len(r) for r, *_ in blocks), default=0), [Wave(0.0, 1.0)], 0
    for count in WINDOWS:
        power, freedom = np.zeros(len(ORDERS)), np.zeros(len(ORDERS))
        for (residual, angle, _), wave in zip(blocks, waves, strict=True):
            for w in np.array_split(np.arange(len(residual)), max(1, round(count * len(residual) / longest))):
                if not _turns(w, angle):
                    continue
                size = np.sum(np.abs(wave[:, w]) ** 2, axis=1)
                told = size > 0.5 * len(w)
                power += np.where(told, 2 * np.abs(wave[:, w] @ residual[w]) ** 2 / np.maximum(size, 1.0), 0.0)
                freedom += 2 * told
        some = freedom > 0
        tried += int(some.sum())
        found += map(Wave, ORDERS[some].tolist(), chdtrc(freedom[some], power[some]).tolist())
    best = min(found, key=lambda wave: wave.p_value)
    return replace(best, p_value=min(1.0, best.p_value * max(tried, 1)))


def order_of(blocks: Sequence[tuple[Floats, Floats, Floats]], times: Sequence[Floats], frequency: float) -> int:
    """Times a turn of the table that a line at ``frequency`` [Hz] comes, if it goes with its angle; else 0.

    At one speed a wave of the angle is a wave of time, and nothing tells them apart; where the table reverses, or has
    several speeds, the one that follows what is left does. ``blocks`` are as in `strongest`, ``times`` of their bins
    [s].
    """
    span = max((float(np.ptp(t)) for t in times), default=0.0)
    turns = max((float(np.ptp(angle)) / (2 * np.pi) for _, angle, _ in blocks), default=0.0)
    if not span or turns < LEAST_TURNS:
        return 0
    left = [residual for residual, *_ in blocks]
    of_angle = [max(_gain(left, w) for w in _of_order(order, blocks)) for order in range(1, MOST_ORDER + 1)]
    near = frequency + np.linspace(-1.0, 1.0, 2 * FINE + 1) / span
    of_time = max(_gain(left, [np.exp(2j * np.pi * f * t) for t in times]) for f in near)
    best = int(np.argmax(of_angle))
    least = AS_WELL * of_time if turns >= MANY_TURNS else of_time + BETTER
    return best + 1 if of_angle[best] > max(BEYOND_NOISE, least) else 0


def _of_order(order: int, blocks: Sequence[tuple[Floats, Floats, Floats]]) -> Iterator[list[NDArray[np.complex128]]]:
    """A wave of the table's angle in the rate, and the rate of one in the angle."""
    waves = [np.exp(1j * order * a) * (order * np.abs(c) < 2 * np.pi * MOST_CYCLES) for _, a, c in blocks]
    yield waves
    yield [wave * change for wave, (*_, change) in zip(waves, blocks, strict=True)]


def _gain(left: Sequence[Floats], waves: Sequence[NDArray[np.complex128]]) -> float:
    """Square sum that a wave of one amplitude and phase takes of what is left, its level in each block apart."""
    free = [w - w.mean() for w in waves]
    columns = np.concatenate([np.column_stack([w.real, w.imag]) for w in free])
    products = columns.T @ np.concatenate(list(left))
    return float(products @ np.linalg.lstsq(columns.T @ columns, products, rcond=1e-9)[0])


def _waves(angle: Floats, change: Floats) -> NDArray[np.complex128]:
    """Waves of each order at the bins of a block, shape (orders, n); their level belongs to the bias."""
    waves = np.exp(1j * np.outer(ORDERS, angle))
    waves = np.where(np.abs(np.outer(ORDERS, change)) < 2 * np.pi * MOST_CYCLES, waves, 0.0)
    return np.asarray(waves - waves.mean(axis=1, keepdims=True))


def _turns(window: np.ndarray, angle: Floats) -> bool:
    return len(window) >= LEAST_BINS and float(np.ptp(angle[window])) >= 2 * np.pi * LEAST_TURNS
