r"""Scale-factor test on a rate table: angle per pulse from whole turns in both directions, and its repeatability.

A dwell of n whole turns at one rate gives q = q0 sin(tilt) 2 pi n / (sum of pulses in rad). A constant rate b beside
the table's (bias, vertical Earth rate) adds b T to one direction and takes it off the other: so the readings per
angle of a pair of dwells are averaged, and the horizontal Earth rate cancels over whole turns.

Source: Zhang, Wu and Wu, Opt. Precis. Eng. 19 (2011) 146, table 1; IEEE Std 647-2006, scale factor test.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording, Segment


def repeatability(values: ArrayLike) -> tuple[float, float]:
    """Mean and relative standard deviation (n - 1) of scale factors, shape (n,).

    Raises
    ------
    InputError
        If there are fewer than two.
    """
    given = np.asarray(values, float)
    if given.ndim != 1 or len(given) < 2:
        raise InputError(f"repeatability: values of shape {given.shape} given, wanted two or more in a row")
    mean, spread = mean_and_repeatability(given, np.ones(given.shape, bool))
    return float(mean), float(spread)


def mean_and_repeatability(values: Floats, there: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """The same of rows of values, shape (..., n), of which only those ``there`` count, each of shape (...).

    A row without a value has the mean zero; one with fewer than two has the deviation zero.
    """
    n = there.sum(axis=-1)
    mean = np.where(there, values, 0.0).sum(axis=-1) / np.maximum(n, 1)
    left = np.where(there, values - mean[..., None], 0.0)
    deviation = np.sqrt((left**2).sum(axis=-1) / np.maximum(n - 1, 1))
    return mean, deviation / np.where(n > 1, np.abs(mean), 1.0)


def scale_factor_of(recording: Recording, segments: Sequence[Segment], pulse: float) -> Floats:
    """Angle per pulse [rad] of each pair of dwells, shape (pairs,).

    Parameters
    ----------
    recording : Recording
        With the channels "gyro" [rad/s], pulses times ``pulse`` per interval, and "table_angle" [rad], each of
        shape (n,).
    segments : sequence of Segment
        Dwells at a steady rate, two and two in opposite directions; of each the whole turns are taken.
    pulse : float
        Angle per pulse [rad] with which the recording was made.

    Raises
    ------
    InputError
        If the dwells are not pairs of opposite directions, or one has no whole turn.
    """
    if not segments or len(segments) % 2:
        raise InputError(f"{recording.label}: {len(segments)} dwells given, wanted pairs in opposite directions")
    readings = [_reading_per_angle(recording, segment) for segment in segments]
    pairs = list(zip(readings[::2], readings[1::2], strict=True))
    for (one, other), segment in zip(pairs, segments[::2], strict=True):
        if one[1] * other[1] > 0:
            raise InputError(
                f"{recording.label}: dwell {segment.label!r} and the next turn the same way, wanted opposite directions"
            )
    per_angle = np.array([0.5 * (one[0] + other[0]) for one, other in pairs])
    return np.sin(recording.mounting.tilt) * pulse / per_angle


def _reading_per_angle(recording: Recording, segment: Segment) -> tuple[float, float]:
    """Sum of the increments over the whole turns of a dwell by the table's angle, and the way it turns."""
    rows = slice(segment.start, segment.stop)
    angle = recording.values("table_angle", "rad")[rows]
    # The dwell's first row only tells where it begins.
    total = np.concatenate([[0.0], np.cumsum(recording.values("gyro", "rad/s")[rows][1:])]) * recording.dt
    turned = np.abs(angle - angle[0]) / (2 * np.pi)
    whole = int(np.floor(turned[-1] + 1e-9)) if len(turned) else 0
    if whole < 1:
        raise InputError(f"{recording.label}: dwell {segment.label!r} has no whole turn")
    after = max(int(np.argmax(turned >= whole - 1e-9)), 1)
    part = (whole - turned[after - 1]) / (turned[after] - turned[after - 1])
    way = float(np.sign(angle[-1] - angle[0]))
    reading = total[after - 1] + part * (total[after] - total[after - 1])
    return float(reading) / (way * whole * 2 * np.pi), way
