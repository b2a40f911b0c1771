r"""What a rate test has recorded, entry by entry of its queue: the error of the gyro against the encoder.

Over the rows of an entry on which the table has its rate, T seconds in which it turns by a and the gyro by g,

    rate = a / T,    residual = (g - s a) / T,    variance N^2 / T + 2 (s^2 e^2 + Q^2) / T^2 + floor^2

with the share s of the table's rate that the gyro sees, the encoder's noise e and the quantisation Q. What lies
before the table has its rate, and `GUARD` longer, is left out: there a latency of the gyro times the acceleration
would be an error, and a loop that locks takes its time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.rate_table.rate_ladder import QueuePlace
from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats, Recording

#: Left out after the table has got to its rate [s].
GUARD = 0.05


@dataclass(frozen=True)
class Tally:
    """Sums of each of m entries.

    Attributes
    ----------
    time, moment : ndarray, shape (..., m)
        At the rate [s], and its first moment [s^2].
    turned, error : ndarray, shape (..., m)
        Angle of the table, and error angle of the gyro [rad].
    last : ndarray, shape (...)
        The encoder's last reading [rad]; NaN: there is none.
    """

    time: Floats
    moment: Floats
    turned: Floats
    error: Floats
    last: Floats

    @property
    def rate(self) -> Floats:
        """Mean rate of each entry [rad/s]; NaN where nothing was recorded."""
        return self._mean(self.turned)

    @property
    def residual(self) -> Floats:
        """Mean error of the gyro in each entry [rad/s]; NaN where nothing was recorded."""
        return self._mean(self.error)

    @property
    def middle(self) -> Floats:
        """Mean time of each entry [s]."""
        return self._mean(self.moment)

    def _mean(self, total: Floats) -> Floats:
        return np.where(self.time > 0, total, np.nan) / np.where(self.time > 0, self.time, 1.0)


def empty(entries: int, batch: int | None) -> Tally:
    """Nothing recorded yet."""
    front = () if batch is None else (batch,)
    zeros = np.zeros((*front, entries))
    return Tally(zeros, zeros, zeros, zeros, last=np.full(front, np.nan))


def added(tally: Tally, chunk: Recording, place: QueuePlace, datasheet: Datasheet) -> Tally:
    """With a chunk all of which belongs to one entry, that of ``place``."""
    front = np.shape(place.entry)
    t, dt, share = np.asarray(chunk.t, float), datasheet.dt, float(np.sin(datasheet.mounting.tilt))
    angle, gyro = (
        np.broadcast_to(chunk.values(name, unit), (*front, len(t)))
        for name, unit in (("table_angle", "rad"), ("gyro", "rad/s"))
    )
    used = t - 0.5 * dt > (place.steady + GUARD)[..., None]
    used[..., 0] &= np.isfinite(tally.last)
    count = used.sum(axis=-1)
    # All rows from one of them on: the reading before that one is where the stretch begins.
    before = np.concatenate([tally.last[..., None], angle[..., :-1]], axis=-1)
    start = np.take_along_axis(before, used.argmax(axis=-1)[..., None], axis=-1)[..., 0]
    turned = np.where(count > 0, angle[..., -1] - start, 0.0)
    error = dt * np.where(used, gyro, 0.0).sum(axis=-1) - share * turned
    time = dt * count
    moment = dt * np.where(used, t - 0.5 * dt, 0.0).sum(axis=-1)
    return Tally(
        time=_put(tally.time, place, time),
        turned=_put(tally.turned, place, turned),
        error=_put(tally.error, place, error),
        moment=_put(tally.moment, place, moment),
        last=angle[..., -1].copy(),
    )


def variance(time: Floats, datasheet: Datasheet, floor: float) -> Floats:
    """Variance of the mean error over ``time`` seconds [rad^2/s^2]; infinite where there is none."""
    share = float(np.sin(datasheet.mounting.tilt))
    quantised = datasheet.pulse / 12**0.5 or datasheet.quantization("gyro")
    angle = 2 * ((share * datasheet.encoder_noise) ** 2 + quantised**2)
    walk = datasheet.white("gyro")
    some = np.where(time > 0, time, 1.0)
    return np.where(time > 0, walk**2 / some + angle / some**2 + floor**2, np.inf)


def _put(total: Floats, place: QueuePlace, addition: Floats) -> Floats:
    """``total`` (..., m) with ``addition`` (...) at the entry of each run."""
    result, at = total.copy(), place.entry[..., None]
    np.put_along_axis(result, at, np.take_along_axis(result, at, axis=-1) + addition[..., None], axis=-1)
    return result
