r"""Level of the table from an accelerometer that turns with it.

The accelerometer lies in the table plane along the horizontal direction of the gyro's input axis. On a table that
is out of level by the small rotation (east, north) = (dE, dN) it reads, at the azimuth az - a of its axis,

    f = b + g (level_c cos a + level_s sin a)
    level_c = dE cos az - dN sin az,      level_s = dE sin az + dN cos az

Least squares over whole revolutions, one b for each stretch of steady rate. The gyro's north is off by
dN tan(latitude): `north_error`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np

from estimators.common.told import Errors
from estimators.common.turns import Axis, Revolutions, begin, follow, slack
from estimators.north_finder.correlation import weigh
from estimators.north_finder.spread import solved
from insenv.core.earth import gravity
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import STANDARD_GRAVITY


@final
@dataclass(frozen=True)
class Levelling:
    """Tilt of the table in the frame of its zero mark, from whole revolutions.

    Attributes
    ----------
    datasheet : Datasheet
        Its noise and its declared effects of "accel_x" make the covariance, as in `estimators.north_finder.spread`.
    prior : float
        Standard deviation of the level error before any revolution [rad].
    """

    datasheet: Datasheet
    prior: float = float(np.radians(1.0))

    def reset(self, batch: int | None = None) -> Revolutions:
        """No revolution yet."""
        return begin(batch)

    def update(self, state: Revolutions, chunk: Recording) -> Revolutions:
        """After a chunk with the channels "accel_x" [m/s^2] and "table_angle" [rad]."""
        instant = chunk.channel("accel_x").covers == "instant"
        return follow(state, replace(self._errors.axis, instant=instant), chunk, "accel_x", "m/s^2")

    def estimate(self, state: Revolutions) -> Estimate:
        """``level_c`` and ``level_s`` [rad], shapes (..., 2) and (..., 2, 2)."""
        known, x, cov = solved(state, self._errors, weigh, 2)
        g = self.gravity
        mean = np.where(known[..., None], x / g, 0.0)
        spread = np.where(known[..., None, None], cov / g**2, self.prior**2 * np.eye(2))
        return Estimate(("level_c", "level_s"), ("rad", "rad"), mean, spread)

    @property
    def gravity(self) -> float:
        """Of the site: told, or by latitude and altitude, or the standard [m/s^2]."""
        site = self.datasheet.site
        if site.gravity is not None:
            return site.gravity
        return STANDARD_GRAVITY if site.latitude is None else float(gravity(site.latitude, site.altitude))

    @cached_property
    def _errors(self) -> Errors:
        # A constant 1 m/s^2 in the place of the Earth rate: the free multiple of it is the bias.
        axis = Axis(self.datasheet.dt, 0.0, 1.0, slack(self.datasheet))
        return Errors(self.datasheet, "accel_x", axis, self.datasheet.quantization("accel_x"))


def level_error(level: Estimate, azimuth: Floats | float) -> tuple[Floats, Floats]:
    """Level error as the rotation (east, north) [rad] for an azimuth [rad], shapes (...).

    ``level`` is an estimate of `Levelling`.
    """
    c, s = level.of("level_c")[0], level.of("level_s")[0]
    return c * np.cos(azimuth) + s * np.sin(azimuth), s * np.cos(azimuth) - c * np.sin(azimuth)


def north_error(level: Estimate, azimuth: Estimate, latitude: float) -> tuple[Floats, Floats]:
    """What the level error adds to a gyro's azimuth, dN tan(latitude), and its standard deviation [rad].

    Take it off the azimuth. It is linear in the level; that the azimuth which turns level_c and level_s into
    north and east is itself uncertain is in the deviation.

    Parameters
    ----------
    level : Estimate
        Of `Levelling`.
    azimuth : Estimate
        With the quantity "azimuth".
    latitude : float
        [rad]

    Returns
    -------
    error, sd : ndarray, shape (...)
    """
    angle, sd = azimuth.of("azimuth")
    east, north = level_error(level, angle)
    i, j = level.names.index("level_c"), level.names.index("level_s")
    a, b = -np.sin(angle), np.cos(angle)
    cov = level.cov
    variance = a * a * cov[..., i, i] + 2 * a * b * cov[..., i, j] + b * b * cov[..., j, j] + (east * sd) ** 2
    tan = np.tan(latitude)
    return north * tan, np.sqrt(variance) * abs(tan)
