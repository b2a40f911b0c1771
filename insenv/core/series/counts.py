r"""The counts of an encoder behind what was read of them: the angle, or a rate that was differenced from it.

An angle read in steps of q has the error e_k in row k. A rate over w rows of the period T is in steps of q / (w T),

    r_k = (a_k - a_{k-w}) / (w T),      error  (e_k - e_{k-w}) / (w T),

and its integral over the rows has the mean error of w rows: what is missing at the end of one is made up for by the
next. Errors of rows that are w apart are half of each other with the other sign, which tells w.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats
from insenv.core.series.rounding import counter_step, swung_step
from insenv.core.series.stretches import stretches

#: Rows at most over which a rate is differenced; the correlation of errors, at most, that tells how many.
MOST_ROWS, APART = 32, -0.3
#: Share of the largest angle below which a few digits still show a step that they hide in large angles; rows that tell.
SMALL, FEWEST = 1 / 32, 50


@dataclass(frozen=True)
class Counts:
    """An encoder's step [rad], and over how many rows a rate was differenced; 0 of an angle."""

    step: float
    rows: int = 0

    def of_rows(self, errors: Floats) -> Floats:
        """Errors of the integrated reading, shape (..., n), of those of the angle in each row, the same shape."""
        if self.rows < 2:
            return errors
        total = np.cumsum(np.concatenate([np.repeat(errors[..., :1], self.rows, axis=-1), errors], axis=-1), axis=-1)
        return np.asarray((total[..., self.rows :] - total[..., : -self.rows]) / self.rows)


def counts_of_angle(angle: Floats) -> Counts | None:
    """The counts behind an ``angle`` that was read in each row, shape (n,) [rad]; None where it shows none."""
    step = counter_step(angle) or swung_step(angle) or _step_of_small_angles(angle)
    return Counts(step) if step else None


def _step_of_small_angles(angle: Floats) -> float:
    """The same of an angle that counts turns in a few digits, by rows in which it is small; 0 where they show none."""
    size = np.abs(angle)
    small = stretches(size < SMALL * float(size.max(initial=0.0)))
    start, stop = max(small, key=lambda part: part[1] - part[0], default=(0, 0))
    return counter_step(angle[start:stop]) if stop - start >= FEWEST else 0.0


def counts_of_rate(rate: Floats, motion: Floats, dt: float) -> Counts | None:
    """The counts behind a ``rate`` read every ``dt`` seconds; None where it shows none, or not over how many rows.

    Parameters
    ----------
    rate : ndarray, shape (n,)
        [rad/s]
    motion : ndarray, shape (n,)
        The rate of the table without the reading's noise [rad/s].
    dt : float
    """
    step = counter_step(np.cumsum(rate))
    if not step:
        return None
    left = rate - motion
    left = left - left.mean()
    power = float(left @ left)
    most = min(MOST_ROWS, len(left) // 4)
    if not power or most < 1:
        return None
    apart = np.array([float(left[w:] @ left[:-w]) / power for w in range(1, most + 1)])
    rows = int(apart.argmin()) + 1
    return Counts(step * rows * dt, rows) if apart[rows - 1] < APART else None
