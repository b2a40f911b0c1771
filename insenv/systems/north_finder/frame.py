"""What a frame of the north finder shows.

An input axis at table angle a points to azimuth az - a. The residual of a step of duration dt is

    r = mean gyro rate - sin(tilt) da/dt - Earth rate sin(L) sin(tilt)

its mean over the step; what stays is the horizontal Earth rate, the scale factor and everything undeclared.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Floats

#: From this standard deviation of a direction on [rad] there is no belief: uniform on the circle it is pi/sqrt(3).
IGNORANT = 1.75

_NOTHING: Floats = np.zeros(0)


@dataclass(frozen=True)
class History:
    """What the strip charts show, one value for each step of the run so far.

    Attributes
    ----------
    time : ndarray, shape (k,)
        End of the step [s].
    angle : ndarray, shape (k,)
        Table angle by the encoder at that time, cumulative [rad].
    residual : ndarray, shape (k,)
        Mean of the gyro's rate without table rate and vertical Earth rate [rad/s].
    unexplained : ndarray, shape (k,), or empty
        The residual without the believed horizontal Earth rate [rad/s]; NaN: nothing was believed.
    scale_factor : ndarray, shape (k,)
        Its true error, a fraction.
    believed_scale_factor : ndarray, shape (k, 2), or empty
        Mean and standard deviation, fractions; empty: not estimated.
    north : ndarray, shape (k, 2), or empty
        Mean and standard deviation of the believed azimuth [rad]; empty: there is no estimator.
    """

    time: Floats = field(default_factory=lambda: _NOTHING)
    angle: Floats = field(default_factory=lambda: _NOTHING)
    residual: Floats = field(default_factory=lambda: _NOTHING)
    unexplained: Floats = field(default_factory=lambda: _NOTHING)
    scale_factor: Floats = field(default_factory=lambda: _NOTHING)
    believed_scale_factor: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    north: Floats = field(default_factory=lambda: np.zeros((0, 2)))

    def then(
        self,
        time: float,
        angle: float,
        residual: float,
        scale_factor: float,
        *,
        unexplained: float | None = None,
        believed_scale_factor: tuple[float, float] | None = None,
        north: tuple[float, float] | None = None,
    ) -> History:
        """The history with one step more; what is None once is None in every step."""
        return History(
            np.append(self.time, time),
            np.append(self.angle, angle),
            np.append(self.residual, residual),
            _more(self.unexplained, unexplained),
            np.append(self.scale_factor, scale_factor),
            _more(self.believed_scale_factor, believed_scale_factor),
            _more(self.north, north),
        )


def _more(rows: Floats, row: float | tuple[float, float] | None) -> Floats:
    return rows if row is None else np.concatenate([rows, np.asarray([row], dtype=np.float64)])


@dataclass(frozen=True)
class View:
    """One frame.

    Attributes
    ----------
    time, duration : float
        Since the start of the episode, and its length at most [s].
    table_angle : float
        Counter-clockwise seen from above [rad]; cumulative.
    azimuth_true : float
        Clockwise from north, of the input axis at table angle 0 [rad].
    belief : (float, float) or None
        Mean and standard deviation of the azimuth [rad]; None: there is no estimator.
    rate : float
        Table rate, counter-clockwise positive [rad/s].
    tilt : float
        Elevation of the input axis above the table [rad].
    history : History
    title : str
        Of the scenario.
    demanded : float or None
        Standard deviation of north that is wanted [rad].
    """

    time: float
    duration: float
    table_angle: float
    azimuth_true: float
    belief: tuple[float, float] | None
    rate: float
    tilt: float
    history: History = field(default_factory=History)
    title: str = ""
    demanded: float | None = None


def residual(rate: Floats, table_rate: Floats, tilt: float, latitude: float) -> float:
    """Mean residual of a step [rad/s] (see the module's opening).

    Parameters
    ----------
    rate, table_rate : ndarray, shape (n,)
        Of the gyro and of the table by its encoder, means over the sampling intervals [rad/s].
    tilt, latitude : float
        [rad].
    """
    vertical = EARTH_RATE * np.sin(latitude) * np.sin(tilt)
    return float(np.mean(rate) - np.sin(tilt) * np.mean(table_rate) - vertical)


def horizontal_earth_rate(azimuth: float, table_angle: Floats, tilt: float, latitude: float) -> float:
    """Mean of the horizontal Earth rate on the input axis over table angles of shape (n,) [rad/s]."""
    return float(EARTH_RATE * np.cos(latitude) * np.cos(tilt) * np.mean(np.cos(azimuth - table_angle)))
