"""The fit of gain, lags and levels: Gauss and Newton with Tukey's weights.

Rows in which a table is on its way to a commanded rate are not to bend the gain. Source of the weights: P. J. Huber and
E. M. Ronchetti, Robust Statistics (2009), section 4.8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.core.series.robust import robust_deviation
from insenv.identify.clean.response.stretches import FEWEST, Stretch

#: Longest lag [s], and that of two clocks that were never set by each other.
LONGEST, FARTHEST = 0.5, 2.0
#: Passes, the departure in robust deviations from which a row has no weight, and the change of a lag in rows and of the
#: gain in its deviations that is none.
PASSES, FAR, SETTLED = 8, 5.0, 1e-3
#: Share of the range of the readings within which they are one number, and a gain that may be on its way to none.
SAME, NOTHING = 1e-6, 0.1


def fitted(
    parts: list[Stretch],
    lags: dict[int, float],
    lag_of: set[int],
    held: tuple[float, dict[int, float]] | None = None,
) -> tuple[float, float, dict[int, float]]:
    """Gain, its standard deviation, and the lags, those of the runs ``lag_of`` fitted.

    ``held`` has a hold time and the phase of each run. A gain next to nothing is asked again by the rows that
    are not all one number.
    """
    found = _fitted(parts, lags, lag_of, held, None)
    if abs(found[0]) > NOTHING:
        return found
    told = _that_change(np.concatenate([s.y for s in parts]), np.concatenate([s.known for s in parts]) > 0)
    return found if told is None else _fitted(parts, lags, lag_of, held, told)


def _fitted(
    parts: list[Stretch],
    lags: dict[int, float],
    lag_of: set[int],
    held: tuple[float, dict[int, float]] | None,
    told: NDArray[np.bool_] | None,
) -> tuple[float, float, dict[int, float]]:
    """The same, the scatter of what is left by the rows ``told``; None: by all."""
    lags, weights, gain, sd = dict(lags), [s.known for s in parts], 1.0, np.inf
    for _ in range(PASSES):
        columns, readings, late = [], [], []
        for k, s in enumerate(parts):
            u = seen(s, lags[s.run], held)
            slope = slope_of(s, lags[s.run], held)
            own = np.zeros((len(u), 1 + 2 * len(parts)))
            own[:, 0], own[:, 1 + 2 * k] = u, 1.0
            own[:, 2 + 2 * k] = slope if s.run in lag_of else 0.0
            columns.append(own)
            readings.append(s.y)
            late.append(slack_of(s, slope, held) * (s.run in lag_of))
        matrix, y, w = np.vstack(columns), np.concatenate(readings), np.concatenate(weights)
        size = np.sqrt(np.sum(w[:, None] * matrix**2, axis=0))
        size[size == 0] = 1.0
        scaled = matrix / size * np.sqrt(w)[:, None]
        theta = np.linalg.lstsq(scaled, y * np.sqrt(w), rcond=1e-10)[0]
        left = y - (matrix / size) @ theta
        before, gain = gain, float(theta[0] / size[0])
        scatter = w > 0 if told is None else (w > 0) & told
        spread = robust_deviation(left[scatter]) if np.any(scatter) else 0.0
        sd = spread * float(np.sqrt(max(np.linalg.pinv(scaled.T @ scaled, hermitian=True)[0, 0], 0.0))) / size[0]
        sd *= float(np.sqrt(parts[0].over))  # running means share rows
        moved = 0.0
        for k, s in enumerate(parts):
            if s.run in lag_of and gain:
                change = float(theta[2 + 2 * k] / size[2 + 2 * k]) / gain
                change = float(np.clip(change, -5 * s.exposure.motion.dt, 5 * s.exposure.motion.dt))
                lags[s.run] = float(np.clip(lags[s.run] + change, -FARTHEST - LONGEST, FARTHEST + LONGEST))
                moved = max(moved, abs(change) / s.exposure.motion.dt)
        if spread:
            far = FAR * spread + np.concatenate(late)
            share = np.clip(1 - (left / far) ** 2, 0.0, None) ** 2
            ends = np.cumsum([0, *(len(s.y) for s in parts)])
            weights = [share[a:b] * s.known for s, a, b in zip(parts, ends[:-1], ends[1:], strict=True)]
        if moved < SETTLED and abs(gain - before) < SETTLED * abs(sd):
            break
    return gain, sd, lags


def _that_change(y: Floats, known: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """Of readings that are one number most of the time the other rows; None where they are not.

    Below its threshold, or where the table stands and it is coarse, a reading is one number whatever the input does: a
    gain of nothing leaves nothing there, and beside that all rows of the motion are outliers.
    """
    at = np.abs(y - np.median(y[known])) <= SAME * np.ptp(y[known]) if known.any() else known
    rest = known & ~at
    return rest if np.sum(known & at) > np.sum(rest) >= FEWEST // 8 else None


def seen(one: Stretch, lag: float, held: tuple[float, dict[int, float]] | None) -> Floats:
    """What is seen of the input of a stretch at a lag, held or not."""
    return one.input(lag) if held is None else one.held(lag, held[0], held[1][one.run])


def slope_of(one: Stretch, lag: float, held: tuple[float, dict[int, float]] | None) -> Floats:
    """Change of what is seen with the lag."""
    step = 0.1 * one.exposure.motion.dt
    return (seen(one, lag + step, held) - seen(one, lag - step, held)) / (2 * step)


def slack_of(one: Stretch, slope: Floats, held: tuple[float, dict[int, float]] | None) -> Floats:
    """What a row is off by if it is a renewal, or a row, too late: such rows tell the lag, and are no outliers.

    Where a table spins evenly and is stopped now and then, all that tells the lag lies in few rows.
    """
    return np.asarray(np.abs(slope) * (one.exposure.motion.dt if held is None else held[0]))
