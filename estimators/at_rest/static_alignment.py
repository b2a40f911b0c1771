r"""Static alignment (gyrocompassing) of a parked body whose base tilts.

The mean rate w and the mean specific force f of a rest, in body axes right, forward, up, give the attitude: with the
up direction u = f / |f|, the forward axis n made level and r = n x u,

    h = w - (w . u) u - base,      heading = atan2(-h . r, h . n),      horizontal Earth rate = |h|

`base` is the net rate of the base about the level axes, (tilt at the end - tilt at the start) / T, which a mean of the
gyros contains: a millirad in 300 s is 0.7 deg/h, on the middle latitudes 3 deg of heading. `still_base` takes it to be
zero; `tilting_base` and `StaticAlignment` take it from `estimators.at_rest.base_motion`.

The heading is that of the rest's mean. A bias of the gyros is not told from the Earth's rate: it counts as declared.
Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004), section 10.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from estimators.at_rest.base_motion import ACCELS, BLOCK, FEWEST, GYROS, base_motion, level_axes, means
from insenv.core import earth
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Channel, Covers, Floats, Recording
from insenv.core.series.allan import WHITE
from insenv.core.units import DEG, DEG_PER_HOUR
from insenv.effects.bias import Bias

NAMES = ("heading", "pitch", "roll", "horizontal_rate")
UNITS = ("rad", "rad", "rad", "rad/s")
#: Before any data: any heading, a body that stands level, a gyro of any grade.
LEVEL_SD, RATE_SD = 3 * DEG, 10 * DEG_PER_HOUR


@dataclass(frozen=True)
class RestSamples:
    """What `StaticAlignment` has seen: times, shape (n,), and samples, (..., 6, n), of each chunk."""

    batch: int | None
    t: tuple[Floats, ...] = ()
    samples: tuple[Floats, ...] = ()
    covers: tuple[Covers, ...] = ("interval",) * 6

    def rows(self, index: NDArray[np.int64]) -> RestSamples:
        """The runs ``index`` of the batch alone."""
        return replace(self, batch=len(index), samples=tuple(part[index] for part in self.samples))


@final
@dataclass(frozen=True)
class StaticAlignment:
    """Heading, pitch and roll [rad] and the horizontal Earth rate [rad/s] of a parked body, base tilt removed.

    Its state keeps what was recorded: 48 bytes a row. While the rest is too short it tells the prior.

    Attributes
    ----------
    datasheet : Datasheet
        Site; "angle_random_walk" of the gyros, which must be told; "bias" of gyros and accelerometers, mean and
        deviation, where declared.
    """

    datasheet: Datasheet

    def reset(self, batch: int | None = None) -> RestSamples:
        """Nothing seen yet."""
        return RestSamples(batch)

    def update(self, state: RestSamples, chunk: Recording) -> RestSamples:
        """After a chunk with three gyros [rad/s] and three accelerometers [m/s^2] in axes right, forward, up.

        Raises InputError if a channel is missing, in another unit or delayed.
        """
        units = ("rad/s",) * 3 + ("m/s^2",) * 3
        samples = np.stack([chunk.values(n, u) for n, u in zip(GYROS + ACCELS, units, strict=True)], axis=-2)
        channels = [chunk.channel(name) for name in GYROS + ACCELS]
        if any(channel.delay for channel in channels):
            raise InputError(f"{chunk.label}: gyros or accelerometers are delayed; wanted channels without delay")
        covers = tuple(channel.covers for channel in channels)
        return replace(state, t=(*state.t, chunk.t), samples=(*state.samples, samples), covers=covers)

    def estimate(self, state: RestSamples) -> Estimate:
        """Quantities `NAMES`, shapes (..., 4) and (..., 4, 4); InputError as `tilting_base`."""
        count = 1 if state.batch is None else state.batch
        # A block more than the fit wants: the first row only starts the integrals.
        if sum(map(len, state.t)) * self.datasheet.dt < (FEWEST + 1) * BLOCK:
            found = [_prior(self.datasheet)] * count
        else:
            t, samples = np.concatenate(state.t), np.concatenate(state.samples, axis=-1).reshape(count, 6, -1)
            found = [tilting_base(self._recording(t, row, state.covers), self.datasheet) for row in samples]
        shape = () if state.batch is None else (count,)
        mean, cov = np.stack([e.mean for e in found]), np.stack([e.cov for e in found])
        return Estimate(NAMES, UNITS, mean.reshape(*shape, 4), cov.reshape(*shape, 4, 4))

    def _recording(self, t: Floats, samples: Floats, covers: tuple[Covers, ...]) -> Recording:
        units = ("rad/s",) * 3 + ("m/s^2",) * 3
        columns = zip(GYROS + ACCELS, samples, units, covers, strict=True)
        channels = {name: Channel(values, unit, cover) for name, values, unit, cover in columns}
        return Recording(t, channels, site=self.datasheet.site, mounting=self.datasheet.mounting)


def tilting_base(rest: Recording, datasheet: Datasheet) -> Estimate:
    """Alignment of a whole rest with the base's net rate taken off; quantities `NAMES`.

    Raises InputError as `estimators.at_rest.base_motion.base_motion`, or if the datasheet tells no latitude or no
    angle random walk.
    """
    base = base_motion(rest, site_gravity(datasheet), _walk(datasheet))
    rate, force = means(rest)
    return gyrocompass(rate - base.rate, force, base.cov, base.force_cov, datasheet)


def still_base(rest: Recording, datasheet: Datasheet) -> Estimate:
    """Alignment by the plain means of a rest, as if the base stood still; quantities `NAMES`.

    Its covariance knows of the gyros' noise and of the declared biases, and of nothing else: it is honest on a base
    that does stand still. Raises InputError as `tilting_base`.
    """
    site_gravity(datasheet)
    rate, force = means(rest)
    span = (len(rest) - 1) * rest.dt
    return gyrocompass(rate, force, _walk(datasheet) ** 2 / span * np.eye(3), np.zeros((3, 3)), datasheet)


def gyrocompass(rate: Floats, force: Floats, rate_cov: Floats, force_cov: Floats, datasheet: Datasheet) -> Estimate:
    """Quantities `NAMES` from a mean rate [rad/s] and a mean specific force [m/s^2], shapes (3,).

    The covariances, shape (3, 3), are those of the noise; declared biases are taken off and their variances added.
    """
    x, cov = np.concatenate([rate, force]), np.zeros((6, 6))
    cov[:3, :3], cov[3:, 3:] = rate_cov, force_cov
    for j, name in enumerate(GYROS + ACCELS):
        if (bias := datasheet.told(Bias.id, name)) is not None:
            x[j] -= bias.mean[0]
            cov[j, j] += bias.sd[0] ** 2
    step = 1e-6 * np.repeat([np.linalg.norm(x[:3]), np.linalg.norm(x[3:])], 3)
    ahead, behind = (np.stack([_attitude(x + sign * d) for d in np.diag(step)], axis=1) for sign in (1, -1))
    difference = ahead - behind
    difference[0] = np.angle(np.exp(1j * difference[0]))
    J = difference / (2 * step)
    return Estimate(NAMES, UNITS, _attitude(x), J @ cov @ J.T)


def site_gravity(datasheet: Datasheet) -> float:
    """Gravity of the site [m/s^2]; InputError without a latitude."""
    site = datasheet.site
    if site.latitude is None:
        raise InputError("static alignment: the datasheet has no latitude; wanted site.latitude")
    return float(earth.gravity(site.latitude, site.altitude)) if site.gravity is None else site.gravity


def _attitude(x: Floats) -> Floats:
    right, forward, up = level_axes(x[3:])
    east, north = -right @ x[:3], forward @ x[:3]
    pitch, roll = np.arctan2(up[1], np.hypot(up[0], up[2])), np.arctan2(-up[0], up[2])
    return np.array([np.arctan2(east, north), pitch, roll, np.hypot(east, north)])


def _walk(datasheet: Datasheet) -> float:
    told = [datasheet.noise.get(name, {}).get(WHITE) for name in GYROS]
    if None in told:
        raise InputError("static alignment: the datasheet tells no angle_random_walk of the gyros; wanted one of each")
    return float(np.sqrt(np.mean(np.square(np.array(told, float)))))


def _prior(datasheet: Datasheet) -> Estimate:
    site_gravity(datasheet)
    level = [sd if np.isfinite(sd) else LEVEL_SD for sd in datasheet.level_sd]
    mean = np.array([0.0, 0.0, 0.0, earth.EARTH_RATE * np.cos(datasheet.site.latitude or 0.0)])
    return Estimate(NAMES, UNITS, mean, np.diag(np.square([np.pi / np.sqrt(3), *level, RATE_SD])))
