r"""A rate table whose servo obeys limits of rate and acceleration.

After a command ``r + A sin(2 pi f s)`` at ``s = 0``, with the table at rate W0 and the acceleration limit a,

    d = r - W0,   S = |d| / (a - 2 pi f |A|),   m = min(s, S),   x = m / S
    rate   W(s) = W0 + d x + A sin(2 pi f s)
    angle  b(s) = b0 + W0 s + d x (s - m/2) + A (1 - cos(2 pi f s)) / (2 pi f)

Ripple: the true rate is ``W (1 + p cos(n a)) / sqrt(1 - p^2)`` with the angle ``a``: it repeats with the
angle and its mean over a turn is W. Whatever W(t), this integrates to

    a = b + (2/n) atan2(q sin(n b), 1 - q cos(n b)),    q = p / (1 + sqrt(1 - p^2))

(the relation of eccentric and true anomaly). So angles at the edges are exact, the mean rate over an interval
is the difference of its edges' angles, and a run may be cut anywhere.

The input axis is elevated by ``tilt`` above the table plane. It sees ``sin(tilt)`` of the table's rate and of
the vertical Earth rate ``w sin(latitude)``; the horizontal Earth rate is the effect ``earth_rate``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.plants.base import Reference, Scene
from insenv.plants.profile import Piece, Profile
from insenv.plants.thermal import Constant, Temperature


@dataclass(frozen=True)
class Ripple:
    """Rate ripple: relative amplitude ``fraction`` (below 1), ``order`` periods per turn."""

    fraction: float = 0.0
    order: int = 1


@dataclass(frozen=True)
class Encoder:
    """The table's angle reading: ``resolution``, white ``noise`` (1 sigma) and ``eccentricity``, all [rad].

    Eccentricity adds ``eccentricity * sin(a + phase)``. A reference that is wrong is seen as an error of
    the gyro: the effect ``encoder_harmonic`` says the same from the gyro's side; a scenario uses one or the
    other.
    """

    resolution: float = 0.0
    noise: float = 0.0
    eccentricity: float = 0.0
    phase: float = 0.0

    def read(self, angle: Floats, z: Floats) -> Floats:
        """Reading [rad], shape (..., n), of ``angle`` (..., n) with unit normals ``z`` (..., draws, n)."""
        if self.eccentricity:
            angle = angle + self.eccentricity * np.sin(angle + self.phase)
        if self.noise:
            angle = angle + self.noise * z[..., 0, :]
        return np.rint(angle / self.resolution) * self.resolution if self.resolution else angle


@dataclass(frozen=True)
class Knots:
    """State of the servo: the commands that it follows, J of them, and where the table was when each began.

    ``start`` [s], ``amplitude`` [rad/s] and ``frequency`` [Hz] have shape (J,); ``angle`` [rad], ``rate`` and
    ``command`` [rad/s] have shape (..., J).
    """

    start: Floats
    angle: Floats
    rate: Floats
    command: Floats
    amplitude: Floats
    frequency: Floats

    def take(self, j: slice | NDArray[np.int64]) -> Knots:
        """Knots ``j`` alone."""
        return Knots(*(getattr(self, name)[..., j] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class Turntable:
    """A single-axis rate table with one gyro.

    Attributes
    ----------
    tilt : float
        Elevation of the gyro's input axis above the table plane [rad].
    latitude : float, optional
        [rad]; without it the Earth does not turn.
    azimuth : float
        Of the horizontal part of the input axis at table angle 0 [rad], clockwise from north.
    max_rate, max_acceleration : float
        Limits of the servo [rad/s], [rad/s^2].
    ripple : Ripple
    encoder : Encoder
    temperature : Temperature
        Of the instrument.
    reference_temperature : float
        T_ref of the temperature effects [K].
    profile : Profile
        What the table follows until it is commanded otherwise.
    """

    tilt: float = np.pi / 2
    latitude: float | None = None
    azimuth: float = 0.0
    max_rate: float = np.inf
    max_acceleration: float = np.inf
    ripple: Ripple = field(default_factory=Ripple)
    encoder: Encoder = field(default_factory=Encoder)
    temperature: Temperature = field(default_factory=Constant)
    reference_temperature: float = 298.15
    profile: Profile = (Piece(np.inf),)

    @property
    def horizontal_earth_rate(self) -> tuple[float, float]:
        """Coefficients c, s [rad/s] of the Earth rate ``c cos a + s sin a`` at the table angle a."""
        level = 0.0 if self.latitude is None else EARTH_RATE * np.cos(self.latitude) * np.cos(self.tilt)
        return float(level * np.cos(self.azimuth)), float(level * np.sin(self.azimuth))

    @property
    def draws(self) -> int:
        """Unit normals per sample: one for a noisy encoder."""
        return int(self.encoder.noise > 0)

    def begin(self) -> Knots:
        """The servo at angle 0, already at the rate of the first piece, and all that will be asked of it.

        Raises
        ------
        InputError
            If the profile asks for more rate or acceleration than the table has.
        """
        for piece in self.profile:
            self._check(piece)
        first = self.profile[0]
        knots = [self._knot(0.0, np.array(0.0), np.array(first.rate), first)]
        for before, piece in zip(self.profile[:-1], self.profile[1:], strict=True):
            last = knots[-1]
            start = float(last.start[0]) + before.duration
            angle, rate = self._servo(last, np.array([start]))
            knots.append(self._knot(start, angle[..., 0], rate[..., 0], piece))
        return Knots(*(np.concatenate([getattr(k, f) for k in knots], axis=-1) for f in Knots.__dataclass_fields__))

    def advance(self, state: Knots, command: Floats | float | None, t: Floats, z: Floats) -> tuple[Scene, Knots]:
        """Go on over the intervals with edges ``t``.

        Parameters
        ----------
        state : Knots
        command : ndarray, shape (...), or float, optional
            Rate to take up from ``t[0]`` on [rad/s], held within the table's limit; None: go on as before.
        t : ndarray, shape (n + 1,)
            [s]
        z : ndarray, shape (..., draws, n)
            Unit normals.

        Returns
        -------
        scene : Scene
            Exposure of "gyro"; references "table_angle", "table_rate" (set by the servo), "temperature".
        state : Knots
        """
        if command is not None:
            angle, rate = self._servo(state, t[:1])
            wanted = np.clip(command, -self.max_rate, self.max_rate)
            state = replace(
                self._knot(float(t[0]), angle[..., 0], rate[..., 0], Piece(np.inf)),
                command=np.asarray(wanted)[..., None],
            )
        servo, rate = self._servo(state, t)
        angle, factor = self._rippled(servo)
        dt = float(t[-1] - t[0]) / (len(t) - 1)
        share = float(np.sin(self.tilt))
        vertical = 0.0 if self.latitude is None else EARTH_RATE * np.sin(self.latitude) * share
        motion = Motion(
            t=t,
            rate=np.diff(angle, axis=-1) * (share / dt) + vertical,
            angle=angle,
            rate_edges=rate * factor * share + vertical,
            temperature=self.temperature.at(t),
            projection=share,
            reference_temperature=self.reference_temperature,
        )
        return Scene({"gyro": motion}, self._references(motion, servo, dt, z)), state

    def _references(self, motion: Motion, servo: Floats, dt: float, z: Floats) -> dict[str, Reference]:
        assert motion.angle is not None and motion.temperature is not None
        return {
            "table_angle": Reference(self.encoder.read(motion.angle[..., 1:], z), "rad"),
            "table_rate": Reference(np.diff(servo, axis=-1) / dt, "rad/s", over_interval=True),
            "temperature": Reference(motion.temperature[..., 1:], "K"),
        }

    def _check(self, piece: Piece) -> None:
        """Whether the table can do what a piece asks for."""
        top = abs(piece.rate) + abs(piece.amplitude)
        steepest = 2 * np.pi * piece.frequency * abs(piece.amplitude)
        for what, value, limit, unit in (
            ("rate", top, self.max_rate, "deg/s"),
            ("acceleration", steepest, self.max_acceleration, "deg/s^2"),
        ):
            if value > limit * (1 + 1e-9):
                raise InputError(
                    f"the profile asks for a {what} of {np.degrees(value):.6g} {unit}, "
                    f"the table reaches {np.degrees(limit):.6g} {unit}"
                )

    @staticmethod
    def _knot(start: float, angle: Floats, rate: Floats, piece: Piece) -> Knots:
        return Knots(
            start=np.array([start]),
            angle=np.asarray(angle)[..., None],
            rate=np.asarray(rate)[..., None],
            command=np.array([piece.rate]),
            amplitude=np.array([piece.amplitude]),
            frequency=np.array([piece.frequency]),
        )

    def _servo(self, knots: Knots, t: Floats) -> tuple[Floats, Floats]:
        """Angle and rate without ripple, shape (..., n + 1), at times ``t``."""
        first, last = np.maximum(np.searchsorted(knots.start, t[[0, -1]], side="right") - 1, 0)
        if first == last:
            k = knots.take(slice(first, first + 1))
        else:
            k = knots.take(np.maximum(np.searchsorted(knots.start, t, side="right") - 1, 0))
        s = t - k.start
        change = k.command - k.rate
        w = 2 * np.pi * k.frequency
        # What the sine takes of the acceleration is not there to slew with.
        spare = np.maximum(self.max_acceleration - w * np.abs(k.amplitude), 1e-6 * self.max_acceleration)
        time = np.abs(change) / spare
        m = np.minimum(s, time)
        done = change * np.where(time > 0, m / np.where(time > 0, time, 1.0), 1.0)
        angle = k.angle + k.rate * s + done * (s - 0.5 * m)
        rate = k.rate + done
        if np.any(k.amplitude):
            angle = angle + k.amplitude * (2 * np.sin(0.5 * w * s) ** 2) / np.where(w > 0, w, 1.0)
            rate = rate + k.amplitude * np.sin(w * s)
        return angle, rate

    def _rippled(self, servo: Floats) -> tuple[Floats, Floats | float]:
        """True angle, and true rate as a multiple of the servo's."""
        p, n = self.ripple.fraction, self.ripple.order
        if not p:
            return servo, 1.0
        root = np.sqrt(1 - p * p)
        q = p / (1 + root)
        sin, cos = np.sin(n * servo), np.cos(n * servo)
        return servo + (2 / n) * np.arctan2(q * sin, 1 - q * cos), root / (1 - p * cos)
