"""What a datasheet tells the two-position estimators: site, noise, biases, and the errors of sight and level."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from insenv.core import earth
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats
from insenv.core.units import ARCMIN, ARCSEC, DEG, DEG_PER_HOUR, STANDARD_GRAVITY
from insenv.effects.bias import Bias
from insenv.effects.cross import CrossAxis
from insenv.effects.rate.scale import ScaleFactor

#: Where the datasheet is silent: gyro biases (the vertical one as of a navigation gyro, for no data tell of it),
#: accelerometer biases, installation angle, errors of the level and of the sight.
GYRO_SD, VERTICAL_SD, ACCEL_SD = 10 * DEG_PER_HOUR, 0.01 * DEG_PER_HOUR, 1e-2 * STANDARD_GRAVITY
INSTALLATION_SD, PITCH_SD, ROLL_SD = 30 * ARCMIN, 5 * ARCMIN, 3 * ARCMIN
#: Deviation of a level that nothing is told of: the body is taken to stand level.
UNTOLD_SD = 3 * DEG
ORIENTATION_SD, TRACKING_SD = 20 * ARCSEC, 20 * ARCSEC
#: A deviation that stands for none, as a share of those above; noise that stands for none.
_NONE, _NO_WALK, _NO_VELOCITY_WALK = 1e-9, 1e-12, 1e-9
#: Length of x, see `estimators.two_position.alignment`.
PARAMETERS = 12
#: Channels of the IMU.
GYROS, ACCELS = ("gyro_x", "gyro_y", "gyro_z"), ("accel_x", "accel_y", "accel_z")


@dataclass(frozen=True)
class Sighting:
    """Errors of sight and level and spread of the installation angle, one standard deviation each [rad].

    ``orientation`` is one draw for a run, ``tracking`` one for each sighting.
    """

    installation: float = INSTALLATION_SD
    orientation: float = ORIENTATION_SD
    tracking: float = TRACKING_SD
    pitch: float = PITCH_SD
    roll: float = ROLL_SD


@dataclass(frozen=True)
class Told:
    """What is known of site, noise and biases before anything is measured.

    Attributes
    ----------
    latitude, gravity, dt : float
    walk, velocity_walk : float
        Angle and velocity random walk of the horizontal channels [rad/sqrt(s)], [m/s/sqrt(s)].
    mean, sd : ndarray, shape (9,)
        Biases of the gyros and of the accelerometers, misalignments of the gyros x and y to z, scale factor of the z
        gyro; the last three are none where nothing is declared.
    sighting : Sighting
    """

    latitude: float
    altitude: float
    gravity: float
    dt: float
    walk: float
    velocity_walk: float
    mean: Floats
    sd: Floats
    sighting: Sighting

    @classmethod
    def of(cls, datasheet: Datasheet, sighting: Sighting | None = None) -> Told:
        """From a datasheet; InputError without a latitude."""
        site = datasheet.site
        if site.latitude is None:
            raise InputError("two-position calibration: the datasheet has no latitude; wanted site.latitude")
        silent = (GYRO_SD, GYRO_SD, VERTICAL_SD, ACCEL_SD, ACCEL_SD, ACCEL_SD, _NONE, _NONE, _NONE)
        mean, sd = np.zeros(len(silent)), np.array(silent)
        declared = [datasheet.told(Bias.id, name) for name in (*GYROS, *ACCELS)]
        declared += [datasheet.told(CrossAxis.id, name) for name in GYROS[:2]]
        declared += [datasheet.told(ScaleFactor.id, GYROS[2])]
        for j, one in enumerate(declared):
            if one is not None:
                # Of a misalignment the part to z is the last of three.
                mean[j], sd[j] = one.mean[-1], max(one.sd[-1], _NONE * min(silent[j], 1.0))
        walks = [
            float(np.sqrt(np.mean([datasheet.white(name) ** 2 for name in names]))) for names in (GYROS[:2], ACCELS[:2])
        ]
        return cls(
            latitude=site.latitude,
            altitude=site.altitude,
            gravity=float(earth.gravity(site.latitude, site.altitude)) if site.gravity is None else site.gravity,
            dt=datasheet.dt,
            walk=max(walks[0], _NO_WALK),
            velocity_walk=max(walks[1], _NO_VELOCITY_WALK),
            mean=mean,
            sd=sd,
            sighting=_sighting(datasheet) if sighting is None else sighting,
        )

    @cached_property
    def rate(self) -> tuple[float, float]:
        """Earth rate, north and up [rad/s]."""
        _, north, up = earth.earth_rate_enu(self.latitude)
        return float(north), float(up)

    @cached_property
    def numbers(self) -> Floats:
        """Gravity and Earth rate, as the kernel takes them."""
        return np.array([self.gravity, *self.rate])

    @property
    def prior_mean(self) -> Floats:
        """Of x, shape (12,)."""
        return np.concatenate([np.zeros(3), self.mean])

    def prior(self, heading: Floats) -> Floats:
        """Covariance of x, shape (..., 12, 12), where the sight says ``heading``, shape (...)."""
        s = self.sighting
        cov = np.zeros((*np.shape(heading), PARAMETERS, PARAMETERS))
        across, along = max(s.pitch, _NONE) ** 2, max(s.roll, _NONE) ** 2
        # Pitch is an error about the body's right axis (cos, -sin) of heading, roll about its forward axis (sin, cos).
        c, n = np.cos(heading), np.sin(heading)
        cov[..., 0, 0] = across * c * c + along * n * n
        cov[..., 1, 1] = across * n * n + along * c * c
        cov[..., 0, 1] = cov[..., 1, 0] = (along - across) * c * n
        cov[..., 2, 2] = s.installation**2 + s.orientation**2 + s.tracking**2
        cov[..., range(3, PARAMETERS), range(3, PARAMETERS)] = self.sd**2
        return cov


def _sighting(datasheet: Datasheet) -> Sighting:
    """As the datasheet has it; where it is silent as the published study."""
    default, sight = Sighting(), datasheet.sight
    pitch, roll = (sd if np.isfinite(sd) else UNTOLD_SD for sd in datasheet.level_sd)
    if sight is None:
        return replace(default, pitch=pitch, roll=roll)
    installation = sight.installation if np.isfinite(sight.installation) else default.installation
    return Sighting(installation, sight.orientation, sight.tracking, pitch, roll)
