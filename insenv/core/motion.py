"""What an instrument is exposed to, on ``n`` contiguous intervals with ``n + 1`` edges.

States (table angle, temperature) are given at the edges; rates and forces are means over the intervals. A
plant makes a ``Motion`` from commands, `insenv.data.exposure` makes one from the reference channels of a
recording.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from insenv.core.recording import Floats

#: Quantile of the size of fourth differences by which the noise of a reading is told, and its deviation by unit noise.
QUANTILE, DEVIATION = 0.75, 1.15 * 70**0.5
_AT_EDGES = ("t", "angle", "temperature", "rate_edges", "turn_rate", "body_rate")
_PER_INTERVAL = ("rate", "base_tilt", "across", "force", "vibration", "cross_rate")


@dataclass(frozen=True)
class Motion:
    """Exposure of one input axis.

    Attributes
    ----------
    t : ndarray, shape (n + 1,)
        Edges of the intervals [s], from the start of the run, evenly spaced.
    rate : ndarray, shape (..., n)
        Mean true rate about the input axis over each interval [rad/s]; zero for an accelerometer at rest, of one that
        gravity turns through the specific force along its input axis [m/s^2].
    angle : ndarray, shape (..., n + 1), optional
        Table angle at the edges, cumulative [rad].
    rate_edges : ndarray, shape (..., n + 1), optional
        Rate about the input axis at the edges [rad/s].
    turn_rate : ndarray, shape (..., n + 1), optional
        Rate of the table at the edges, for an accelerometer that turns with it [rad/s].
    temperature : ndarray, shape (..., n + 1), optional
        Temperature at the edges [K].
    base_tilt : ndarray, shape (..., n), optional
        Angle by which the base has turned about the level axis normal to the input axis, signed so that an
        accelerometer reads gravity times it [rad].
    across : ndarray, shape (..., n), optional
        Specific force across the input axis of an accelerometer that gravity turns through [m/s^2].
    force : mapping of str to ndarray, shape (..., n)
        Specific force along the body axes "x", "y", "z" [m/s^2].
    vibration : mapping of str to ndarray, shape (..., n)
        Mean square of the specific force about its own mean over a second, along body axes [(m/s^2)^2].
    cross_rate : mapping of str to ndarray, shape (..., n)
        Input of the other axes of the triad, by axis name: rates [rad/s], of an accelerometer specific forces [m/s^2].
    body_rate : mapping of str to ndarray, shape (..., n + 1)
        Rates of a unit against the Earth about its axes "x", "y", "z", at the edges [rad/s].
    axis : str
        Which of them is the input axis, where ``body_rate`` is given.
    projection : float
        Share of the table's rate that the input axis sees: the sine of the mounting's tilt.
    level : float
        Share of the Earth's rate that the input axis sees at most of its horizontal part: cosine of the latitude times
        that of the mounting's tilt.
    reference_temperature : float
        T_ref of the temperature effects [K].
    base_turned : float
        How far the base was turned since the first run, clockwise from above [rad]: what stands with the Earth comes
        to a table angle that is larger by it.
    gain : float
        What the instrument makes of its input: -1 on an axis that is reversed. Rates are already multiplied by it.
    lag : float
        Seconds by which the output is nearly behind its input; effects of timing are exact there.
    filtered : bool
        Whether that lag is the one of a first-order filter before the reference, and no delay.
    window : float
        Time over which the reference is a mean of the rate [s], beside that lag, as counts of an encoder are. 0: none.
    stands : bool
        Whether the table stands in each interval at the angle of its end, and was turned between them.
    points : bool
        Whether each interval is of one rate, angle or temperature that was set, and nothing is known of the way from
        one to the next: the temperature of each is that at its end.
    reading : float, optional
        Standard deviation of the noise with which the rate is read, at most, by the instrument's own reading [rad/s].
    step : float, optional
        Length of an interval where it is known [s]. The one that ``t`` says is rounded, and differs by that from chunk
        to chunk of a run.
    """

    t: Floats
    rate: Floats
    angle: Floats | None = None
    rate_edges: Floats | None = None
    turn_rate: Floats | None = None
    temperature: Floats | None = None
    base_tilt: Floats | None = None
    across: Floats | None = None
    force: Mapping[str, Floats] = field(default_factory=dict)
    vibration: Mapping[str, Floats] = field(default_factory=dict)
    cross_rate: Mapping[str, Floats] = field(default_factory=dict)
    body_rate: Mapping[str, Floats] = field(default_factory=dict)
    axis: str = ""
    projection: float = 1.0
    level: float = 1.0
    reference_temperature: float = 298.15
    base_turned: float = 0.0
    gain: float = 1.0
    lag: float = 0.0
    filtered: bool = False
    window: float = 0.0
    stands: bool = False
    points: bool = False
    reading: float | None = None
    step: float | None = None

    @property
    def n(self) -> int:
        """Number of intervals."""
        return len(self.t) - 1

    @property
    def dt(self) -> float:
        """Length of an interval [s]."""
        return float(self.t[-1] - self.t[0]) / self.n if self.step is None else self.step

    @property
    def middle(self) -> Floats:
        """Mid-times of the intervals [s], shape (n,)."""
        return 0.5 * (self.t[1:] + self.t[:-1])

    @property
    def rate_noise(self) -> float:
        """Standard deviation of the noise of the rate, at most: fast motion leaves fourth differences too."""
        own = reading_noise(self.rate)
        return own if self.reading is None else min(own, self.reading)

    def has(self, need: str) -> bool:
        """Whether the exposure ``need`` (a field's name, or "force.x") is known."""
        name, _, key = need.partition(".")
        value = getattr(self, name)
        return key in value if key else value is not None and (not isinstance(value, Mapping) or bool(value))

    def interval(self, start: int, stop: int) -> Motion:
        """The same exposure on intervals ``[start, stop)`` alone."""
        edge, inner = slice(start, stop + 1), slice(start, stop)
        return self._each(lambda a: a[..., edge], lambda a: a[..., inner])

    def row(self, index: int) -> Motion:
        """Row ``index`` of a batch of exposures (arrays that have no batch axis are shared)."""
        return self._each(*(2 * [lambda a: a[index] if a.ndim > 1 else a]))

    def _each(self, edges: Callable[[Floats], Floats], intervals: Callable[[Floats], Floats]) -> Motion:
        """Map the arrays at the edges and the arrays per interval."""
        changed: dict[str, Any] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if value is None or f.name not in (*_AT_EDGES, *_PER_INTERVAL):
                continue
            part = edges if f.name in _AT_EDGES else intervals
            changed[f.name] = {k: part(a) for k, a in value.items()} if isinstance(value, Mapping) else part(value)
        return replace(self, **changed)


def reading_noise(x: Floats) -> float:
    """Standard deviation of the noise of a reading, shape (..., n): smooth motion leaves no fourth differences."""
    if x.shape[-1] < 8:
        return 0.0
    return float(np.quantile(np.abs(np.diff(x, 4, axis=-1)), QUANTILE)) / DEVIATION


def interval_product(a: Floats, b: Floats) -> Floats:
    """Mean over each interval of the product of two states that are straight between their edges, shape (..., n)."""
    if a.ndim == 2 and a.shape[0] > 1 and a.shape == b.shape:
        from insenv.core.rows import kernel

        out = np.empty((a.shape[0], a.shape[1] - 1))
        kernel.product_means(a, b, out)
        return out
    a0, a1, b0, b1 = a[..., :-1], a[..., 1:], b[..., :-1], b[..., 1:]
    # In place: temporaries of a batch cost more than the sums.
    early, late = 2 * b0, 2 * b1
    early += b1
    late += b0
    mean: Floats = a0 * early
    mean += a1 * late
    mean /= 6
    return mean


def interval_mean(at_edges: Floats) -> Floats:
    """Mean over each interval of a state known at its edges (trapezoid), shape (..., n)."""
    mean = at_edges[..., 1:] + at_edges[..., :-1]
    mean *= 0.5
    return mean


def interval_slope(at_edges: Floats, dt: float) -> Floats:
    """Mean derivative over each interval of a state known at its edges: exact, shape (..., n)."""
    slope: Floats = np.diff(at_edges, axis=-1)
    slope /= dt
    return slope
