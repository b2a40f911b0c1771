r"""What rests and turns on the spot can tell of attitude and biases: the Cramer-Rao bound of two-position calibration.

Eight states, east-north-up: misalignment phi of a static mechanisation, gyro biases eps, accelerometer biases nabla,

    phi' = phi x omega_ie - C eps + w_g,   dv_E' = -g phi_N + (C nabla)_E + w_a,   dv_N' = g phi_E + (C nabla)_N + w_a,

with C = C_b^n of a level body that turns about up. The velocity is seen without error, so its increments are the data;
of white noise, none is lost to the velocity. The bound is the covariance of the Kalman filter of this linear
Gauss-Markov model, by which no unbiased estimator does better.
Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004), chapters 10 and 12; Kay,
Fundamentals of Statistical Signal Processing 1 (1993), chapter 13.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from insenv.core.earth import earth_rate_enu, gravity
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats
from insenv.effects.bias import Bias

#: Longest step of the filter: at rest and while the body turns [s].
_STEP, _TURNING_STEP = 1.0, 0.25


#: What stands for "nothing is known" of an angle [rad], a gyro's bias [rad/s] and an accelerometer's [m/s^2].
_ANY = (1.0, 1e-6, 1e-2)
#: Smallest walks: without noise there is no bound [rad/sqrt(s)], [m/s/sqrt(s)].
_QUIET = (1e-12, 1e-9)


@dataclass(frozen=True)
class AlignedUnit:
    """What the bound needs to know.

    Attributes
    ----------
    latitude, altitude : float
        [rad], [m]
    walk, velocity_walk : float
        Angle and velocity random walk [rad/sqrt(s)], [m/s/sqrt(s)].
    phi_sd, gyro_sd : tuple of float
        Prior deviations of misalignment east, north, up [rad] and of gyro biases x, y, z [rad/s].
    accel_sd : tuple of float
        Of accelerometer biases x, y [m/s^2].
    """

    latitude: float
    walk: float
    velocity_walk: float
    phi_sd: tuple[float, float, float]
    gyro_sd: tuple[float, float, float]
    accel_sd: tuple[float, float]
    altitude: float = 0.0

    @property
    def prior(self) -> Floats:
        """Covariance before any data, shape (8, 8)."""
        return np.diag(np.square([*self.phi_sd, *self.gyro_sd, *self.accel_sd]))


def instrument_of(sheet: Datasheet) -> AlignedUnit:
    """The instrument that a datasheet tells of; what it does not tell is free.

    Raises
    ------
    InputError
        If it tells no latitude.
    """
    if sheet.site.latitude is None:
        raise InputError("no latitude in the datasheet; wanted it, for heading comes from the Earth's rate")
    biases = [sheet.told(Bias.id, name) for name in ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y")]
    sd = [_ANY[1 if j < 3 else 2] if d is None else d.sd[0] for j, d in enumerate(biases)]
    walk, velocity = (sheet.white(name) for name in ("gyro_x", "accel_x"))
    level = [value if np.isfinite(value) else _ANY[0] for value in sheet.level_sd]
    return AlignedUnit(
        sheet.site.latitude,
        max(walk, _QUIET[0]),
        max(velocity, _QUIET[1]),
        (level[0], level[1], _ANY[0]),
        (sd[0], sd[1], sd[2]),
        (sd[3], sd[4]),
        sheet.site.altitude,
    )


@dataclass(frozen=True)
class Stretch:
    """A rest or a turn.

    Attributes
    ----------
    duration : float
        [s]
    turn : float
        Angle that is turned by, counter-clockwise [rad], at a steady rate; zero: a rest.
    """

    duration: float
    turn: float = 0.0


def procedure(rest: float, turns: Sequence[float], turn_s: float) -> tuple[Stretch, ...]:
    """Equal rests of ``rest`` seconds with turns [rad] of ``turn_s`` seconds between them."""
    found = [Stretch(rest)]
    for turn in turns:
        found += [Stretch(turn_s, turn), Stretch(rest)]
    return tuple(found)


@dataclass(frozen=True)
class Knowledge:
    """Covariance of the states, shape (8, 8), and of where they stood at the start, as it grows.

    ``cov`` holds phi now, the biases, and phi at the start: shape (11, 11); behind them phi_U at each time that was
    marked by `sighted`.
    """

    cov: Floats
    heading: float = 0.0
    time: float = 0.0

    @property
    def installation(self) -> float:
        """Deviation of phi_U at the start, the inertial part of the installation angle's [rad]."""
        return float(np.sqrt(self.cov[10, 10]))

    @property
    def sd(self) -> Floats:
        """Deviations of phi at the start (3), gyro biases (3), accelerometer biases (2)."""
        deviation = np.sqrt(np.diagonal(self.cov))
        return np.concatenate([deviation[8:11], deviation[3:8]])

    def sighted(self) -> Knowledge:
        """The same, which remembers phi_U now: a sighting tells of it."""
        n = len(self.cov)
        again = np.append(np.arange(n), 2)
        return Knowledge(self.cov[np.ix_(again, again)], self.heading, self.time)

    def target(self, tracking: float) -> float:
        r"""Deviation of the installation angle with the target's azimuth, from all sightings [rad].

        The first was at the start, of the others each was marked. A sighting reads phi_U = theta + t_k, t_k of the
        deviation ``tracking``; with P the covariance of phi_U at their times, of all data, that of theta is
        1 / (1' (P + tracking^2)^-1 1).
        """
        at = np.arange(10, len(self.cov))
        spread = self.cov[np.ix_(at, at)] + tracking**2 * np.eye(len(at))
        return float(np.sum(np.linalg.inv(spread)) ** -0.5)


def unknowing(instrument: AlignedUnit, heading: float = 0.0) -> Knowledge:
    """Before any data: phi now is phi at the start."""
    cov = np.zeros((11, 11))
    cov[:8, :8] = instrument.prior
    cov[8:, 8:] = cov[8:, :3] = cov[:3, 8:] = instrument.prior[:3, :3]
    return Knowledge(cov, heading)


def bound(
    instrument: AlignedUnit, stretches: Sequence[Stretch], heading: float = 0.0, turning_data: bool = True
) -> Knowledge:
    """Knowledge after a procedure.

    Parameters
    ----------
    instrument : AlignedUnit
    stretches : sequence of Stretch
    heading : float
        At the start, clockwise from north [rad].
    turning_data : bool
        Whether the velocities of the turns are data: an ideal body turns about its accelerometers.

    Raises
    ------
    InputError
        If a duration is negative.
    """
    known = unknowing(instrument, heading)
    for stretch in stretches:
        known = last(after(instrument, known, stretch, turning_data), known)
    return known


def last(steps: Iterator[Knowledge], before: Knowledge) -> Knowledge:
    """The last of some steps; what was known before if there is none."""
    for before in steps:  # noqa: B007, B020
        pass
    return before


def after(
    instrument: AlignedUnit, known: Knowledge, stretch: Stretch, turning_data: bool = False
) -> Iterator[Knowledge]:
    """Knowledge after each step of a stretch; steps of at most a second."""
    if not stretch.duration >= 0:
        raise InputError(f"a stretch of {stretch.duration:g} s given; wanted zero or more")
    cov, heading, time = known.cov, known.heading, known.time
    for dt, share in parts(stretch):
        seen = turning_data or not stretch.turn
        cov = advance(instrument, cov, heading - 0.5 * share, dt, seen).cov
        heading, time = heading - share, time + dt
        yield Knowledge(cov, heading, time)


def parts(stretch: Stretch) -> Iterator[tuple[float, float]]:
    """Steps of the filter in a stretch: their lengths [s] and the angles that they turn by [rad]."""
    longest = _TURNING_STEP if stretch.turn else _STEP
    steps = int(np.ceil(stretch.duration / longest - 1e-9))
    left = stretch.duration
    for k in range(steps):
        dt = longest if k < steps - 1 else left
        left -= dt
        yield dt, stretch.turn * dt / stretch.duration


@dataclass(frozen=True)
class FilterStep:
    """One step of the filter of eleven states: phi now, biases, phi at the start.

    Attributes
    ----------
    cov : ndarray, shape (11, 11)
        After it.
    transition : ndarray, shape (11, 11)
    regressor : ndarray, shape (2, 11)
        Of the velocity's increment east and north.
    gain : ndarray, shape (11, 2)
        Zero where the velocity is not seen.
    """

    cov: Floats
    transition: Floats
    regressor: Floats
    gain: Floats


def advance(instrument: AlignedUnit, cov: Floats, heading: float, dt: float, seen: bool) -> FilterStep:
    """What a step of ``dt`` seconds about ``heading`` [rad] does to the covariance of the states."""
    rate = earth_rate_enu(instrument.latitude)
    g = float(gravity(instrument.latitude, instrument.altitude))
    F, H, Q, R, cross = _remembering(step_model(instrument, heading, dt, rate, g), len(cov))
    gain: Floats = np.zeros((len(cov), 2))
    onward: Floats = F @ cov @ F.T + Q
    if seen:
        S = H @ cov @ H.T + R
        lean = F @ cov @ H.T + cross
        gain = np.asarray(np.linalg.solve(S, lean.T).T)
        onward = onward - gain @ lean.T
    return FilterStep(0.5 * (onward + onward.T), F, H, gain)


def _remembering(
    model: tuple[Floats, Floats, Floats, Floats, Floats], size: int
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """The model of a step with states behind the eleven that stay as they are."""
    F, H, Q, R, cross = model
    if (more := size - len(F)) == 0:
        return model
    onward = np.eye(size)
    onward[: len(F), : len(F)] = F
    return onward, np.pad(H, ((0, 0), (0, more))), np.pad(Q, (0, more)), R, np.pad(cross, ((0, more), (0, 0)))


def step_model(
    instrument: AlignedUnit, heading: float, dt: float, rate: Floats, g: float
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Transition, regressor of the velocity's increment, and the noise of both with its covariance.

    The walk of the attitude within the step is seen by the increment as well: hence the covariance.
    """
    c, s = np.cos(heading), np.sin(heading)
    C = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    n, u = rate[1], rate[2]
    W = np.array([[0.0, u, -n], [-u, 0.0, 0.0], [n, 0.0, 0.0]])  # phi x omega
    F = np.eye(11)
    F[:3, :3] += W * dt + 0.5 * W @ W * dt * dt
    F[:3, 3:6] = -C * dt - 0.5 * W @ C * dt * dt
    G = np.array([[0.0, -g, 0.0], [g, 0.0, 0.0]])
    H = np.zeros((2, 11))
    H[:, :3] = G @ (np.eye(3) * dt + 0.5 * W * dt * dt)
    H[:, 3:6] = -0.5 * G @ C * dt * dt
    H[:, 6:8] = C[:2, :2] * dt
    q = instrument.walk**2
    Q = np.zeros((11, 11))
    Q[range(3), range(3)] = q * dt
    R = np.eye(2) * (instrument.velocity_walk**2 * dt + q * g * g * dt**3 / 3)
    cross = np.zeros((11, 2))
    cross[:3] = G.T * (q * dt * dt / 2)
    return F, H, Q, R, cross
