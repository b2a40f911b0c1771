r"""A rate table whose servo obeys limits of rate and acceleration (`insenv.plants.servo`).

Ripple: with the servo's angle b and rate W the true rate is ``W (1 + p cos(n a)) / sqrt(1 - p^2)``: it repeats
with the angle a and its mean over a turn is W. Whatever W(t), this integrates to

    a = b + (2/n) atan2(q sin(n b), 1 - q cos(n b)),    q = p / (1 + sqrt(1 - p^2))

(the relation of eccentric and true anomaly). So angles at the edges are exact, the mean rate over an interval
is the difference of its edges' angles, and a run may be cut anywhere.

The gyro's input axis is elevated by ``tilt`` above the table plane; its horizontal part has the azimuth
``azimuth - a``. A table that is not level, turned by the small angles dE about east and dN about north, sees

    Earth rate      east -w sin L dN,   north w cos L + w sin L dE,   up w sin L - w cos L dE
    specific force  east -g dN,         north g dE

The gyro has ``sin(tilt)`` of the table's rate and of the Earth rate's upward part in its true rate; the
horizontal part is the effect ``earth_rate``. An accelerometer ``accel_x`` lies in the table plane along the
horizontal part of the gyro's axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import cos, sin
from typing import Literal, Self

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Limits
from insenv.core.motion import Motion
from insenv.core.recording import Floats, Mounting
from insenv.effects.angle import EarthRate
from insenv.effects.forms import wave
from insenv.plants.base import Plant, Reference, Scene
from insenv.plants.profile import Piece, Profile, duration
from insenv.plants.servo import Knots, joined, knot
from insenv.plants.thermal import Constant, Temperature

#: Instruments that a table can carry.
CARRIED = ("gyro", "accel_x")


@dataclass(frozen=True)
class Ripple:
    """Rate ripple: relative amplitude ``fraction`` (below 1), ``order`` periods per turn."""

    fraction: float = 0.0
    order: int = 1


@dataclass(frozen=True)
class Encoder:
    """The table's angle reading: ``resolution``, white ``noise`` (1 sigma) and ``eccentricity``, all [rad].

    It shows the angle as it was ``skew`` [s] ago. Eccentricity adds ``eccentricity * sin(a + phase)``. A reference that
    is wrong is seen as an error of the gyro: the effect ``encoder_harmonic`` says the same from the gyro's side; a
    scenario uses one or the other.
    """

    resolution: float = 0.0
    noise: float = 0.0
    eccentricity: float = 0.0
    phase: float = 0.0
    skew: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.skew < np.inf:
            raise InputError(f"the encoder's skew is {self.skew:g} s; wanted zero or more seconds of delay")

    def read(self, angle: Floats, z: Floats) -> Floats:
        """Reading [rad], shape (..., n), of ``angle`` (..., n) with unit normals ``z`` (..., draws, n)."""
        if self.eccentricity:
            angle = angle + self.eccentricity * np.sin(angle + self.phase)
        if self.noise:
            angle = angle + self.noise * z[..., 0, :]
        if not self.resolution:
            return angle
        read = angle / self.resolution
        np.rint(read, out=read)
        read *= self.resolution
        return read


@dataclass(frozen=True)
class Turntable(Plant):
    """A single-axis rate table with a gyro, and an accelerometer for levelling if asked for.

    Attributes
    ----------
    tilt : float
        Elevation of the gyro's input axis above the table plane [rad].
    latitude : float, optional
        [rad]; without it the Earth does not turn.
    azimuth : float or ndarray, shape (R,)
        Of the horizontal part of the input axis at table angle 0 [rad], clockwise from north.
    level_error : pair of float or ndarray, shape (R,)
        Small rotation of the whole table about east and about north [rad].
    gravity : float
        [m/s^2]
    carries : tuple of str
        Instruments on the table: "gyro", "accel_x".
    felt : bool
        Whether the gyro's exposure has the specific force too, along the accelerometer (x), across it in the table
        plane (y), and along the table's axis (z): only where an effect asks for it, for it costs two waves a chunk.
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
    azimuth: float | Floats = 0.0
    max_rate: float = np.inf
    max_acceleration: float = np.inf
    ripple: Ripple = field(default_factory=Ripple)
    encoder: Encoder = field(default_factory=Encoder)
    temperature: Temperature = field(default_factory=Constant)
    reference_temperature: float = 298.15
    profile: Profile = (Piece(np.inf),)
    level_error: tuple[float | Floats, float | Floats] = (0.0, 0.0)
    gravity: float = 9.80665
    carries: tuple[str, ...] = ("gyro",)
    felt: bool = False

    def __post_init__(self) -> None:
        for name in self.carries:
            if name not in CARRIED:
                raise InputError(f"a turntable carries no {name!r}; wanted {' or '.join(CARRIED)}")

    @property
    def earth_rate(self) -> tuple[float | Floats, float | Floats, float | Floats]:
        """Earth rate along the table's east, north and axis [rad/s], each a float or of shape (R,)."""
        if self.latitude is None:
            return 0.0, 0.0, 0.0
        north, up = EARTH_RATE * cos(self.latitude), EARTH_RATE * sin(self.latitude)
        about_east, about_north = self.level_error
        return -up * about_north, north + up * about_east, up - north * about_east

    @property
    def horizontal_earth_rate(self) -> tuple[float | Floats, float | Floats]:
        """Coefficients c, s [rad/s] of the Earth rate ``c cos a + s sin a`` at the table angle a.

        Floats, or of shape (R,) where azimuth or level error differ from run to run.
        """
        east, north, _ = self.earth_rate
        return self._along_axis(cos(self.tilt) * east, cos(self.tilt) * north)

    @property
    def vertical_earth_rate(self) -> float | Floats:
        """Share of the Earth rate along the table's axis that the gyro sees [rad/s]: float or of shape (R,)."""
        return sin(self.tilt) * self.earth_rate[2]

    @property
    def section(self) -> str:
        """The [table]."""
        return "table"

    @property
    def steered_by(self) -> Literal["", "rate", "angle"]:
        """A rate."""
        return "rate"

    @property
    def repeatable(self) -> float | None:
        """Length of the profile: the table begins again at its zero mark."""
        return duration(self.profile)

    @property
    def draws(self) -> int:
        """Unit normals per sample: one for a noisy encoder."""
        return int(self.encoder.noise > 0)

    @property
    def by_chance(self) -> bool:
        """No: its reading alone is noisy."""
        return False

    @property
    def limits(self) -> Limits:
        """Of the servo."""
        return Limits(self.max_rate, self.max_acceleration)

    @property
    def mounting(self) -> Mounting:
        """The gyro's tilt."""
        return Mounting(tilt=self.tilt)

    @property
    def encoder_noise(self) -> float:
        """Root sum of squares of the encoder's white noise and of its resolution / sqrt(12) [rad]."""
        return float(np.hypot(self.encoder.noise, self.encoder.resolution / np.sqrt(12.0)))

    @property
    def tells(self) -> Mapping[str, tuple[float, ...]]:
        """The horizontal Earth rate, where the site is known."""
        if self.latitude is None:
            return {}
        c, s = self.horizontal_earth_rate
        return {EarthRate.id: (float(c), float(s))}

    @property
    def entails(self) -> Mapping[str, str]:
        """The horizontal Earth rate, where the gyro sees it."""
        if not np.hypot(*self.horizontal_earth_rate) > 1e-12:
            return {}
        return {EarthRate.id: "the input axis is not vertical and sees the Earth turn"}

    def turned(self, angle: float) -> Self:
        """With another azimuth at table angle 0."""
        return replace(self, azimuth=self.azimuth + angle)

    def felt_force(self) -> Self:
        """With `felt` set."""
        return replace(self, felt=True)

    def commands(self, step: float, n: int) -> Floats:
        """Rates [rad/s], shape (n,): those of the profile, each from the step that is nearest.

        Raises
        ------
        InputError
            If a piece has a sine.
        """
        found, time = np.zeros(n), 0.0
        for piece in self.profile:
            if piece.amplitude:
                raise InputError("profile.kind = 'sine' cannot be played in steps; wanted steady rates")
            found[round(time / step) :] = piece.rate
            time += min(piece.duration, (n + 1) * step)
        return found

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
        knots = [knot(0.0, np.zeros(1), np.array([first.rate]), first)]
        for before, piece in zip(self.profile[:-1], self.profile[1:], strict=True):
            start = float(knots[-1].start[0]) + before.duration
            knots.append(knot(start, *knots[-1].at(np.array([start]), self.max_acceleration), piece))
        return joined(*knots)

    def later(self, state: Knots, by: float) -> Knots:
        """The servo with all that it was asked for at later times."""
        return replace(state, start=state.start + by)

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
            Exposure of what the table `carries`; references "table_angle", "table_rate" (set by the servo),
            "command" (what a controller logs: at the end of each interval, with jumps),
            "zero_pulse" (1 in intervals in which the true angle passed the zero mark) and "temperature".
        state : Knots
        """
        if command is not None:
            wanted = np.minimum(np.maximum(command, -self.max_rate), self.max_rate)
            state = state.commanded(float(t[0]), wanted, self.max_acceleration, self.encoder.skew)
        servo, set_rate = state.at(t, self.max_acceleration)
        angle, rate = self._rippled(servo, set_rate)
        per_second = (len(t) - 1) / float(t[-1] - t[0])
        turned = angle[..., 1:] - angle[..., :-1]
        turned *= per_second
        temperature = self.temperature.at(t)
        scene = Scene(
            {name: self._motion(name, t, angle, (turned, rate), temperature) for name in self.carries},
            {
                "table_angle": Reference(self._read(state, t, angle, z), "rad"),
                "table_rate": Reference(
                    turned if servo is angle else np.diff(servo, axis=-1) * per_second, "rad/s", over_interval=True
                ),
                "command": Reference(state.setpoint(t[1:]), "rad/s"),
                "zero_pulse": Reference(_passes(angle), "1", over_interval=True),
                "temperature": Reference(temperature[..., 1:], "K"),
            },
        )
        return scene, state

    def _motion(self, name: str, t: Floats, angle: Floats, rates: tuple[Floats, Floats], temperature: Floats) -> Motion:
        """Exposure of one instrument; ``rates`` of the table: means over the intervals, and at the edges."""
        if name != "gyro":
            return Motion(
                t=t,
                rate=np.zeros(len(t) - 1),
                angle=angle,
                temperature=temperature,
                force={"x": self._level_force(angle)},
                reference_temperature=self.reference_temperature,
            )
        at_edges = self._seen(rates[1])
        if at_edges.shape[-1] == 1:
            at_edges = np.broadcast_to(at_edges, (*at_edges.shape[:-1], len(t)))
        return Motion(
            t=t,
            rate=self._seen(rates[0]),
            angle=angle,
            rate_edges=at_edges,
            temperature=temperature,
            force=self._force(angle) if self.felt else {},
            projection=self._share,
            reference_temperature=self.reference_temperature,
        )

    def _seen(self, rate: Floats) -> Floats:
        """Rate about the gyro's axis, which sees a share of the table's, and of what the whole turns by."""
        seen = rate * self._share
        return np.add(seen, self._vertical, out=seen if isinstance(self._vertical, float) else None)

    @cached_property
    def _share(self) -> float:
        return sin(self.tilt)

    @cached_property
    def _vertical(self) -> float | Floats:
        """As `vertical_earth_rate`, to stand before time."""
        return _column(self.vertical_earth_rate)

    def _force(self, angle: Floats) -> dict[str, Floats]:
        """Mean specific force along the three axes of `felt` [m/s^2], shape (..., n) each."""
        x, y = self._level_force(angle), self._level_force(angle + 0.5 * np.pi)
        return {"x": x, "y": y, "z": np.full(x.shape[-1], self.gravity)}

    def _level_force(self, angle: Floats) -> Floats:
        """Mean specific force along the accelerometer at a table angle [m/s^2], shape (..., n)."""
        about_east, about_north = self.level_error
        c, s = self._along_axis(-self.gravity * about_north, self.gravity * about_east)
        return wave(angle, 1, _column(c), _column(s))

    def _along_axis(self, east: float | Floats, north: float | Floats) -> tuple[float | Floats, float | Floats]:
        """Coefficients of cos a and sin a of a horizontal vector along the azimuth ``azimuth - a``."""
        to_north, to_east = np.cos(self.azimuth), np.sin(self.azimuth)
        return _number(north * to_north + east * to_east), _number(north * to_east - east * to_north)

    def _read(self, state: Knots, t: Floats, angle: Floats, z: Floats) -> Floats:
        """The encoder's reading at the ends of the intervals [rad], shape (..., n)."""
        skew = self.encoder.skew
        if skew:
            shown, _ = self._rippled(*state.at(t[1:] - skew, self.max_acceleration))
            return self.encoder.read(shown, z)
        return self.encoder.read(angle[..., 1:], z)

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

    def _rippled(self, servo: Floats, rate: Floats) -> tuple[Floats, Floats]:
        """True angle and rate for those that the servo sets."""
        p, n = self.ripple.fraction, self.ripple.order
        if not p:
            return servo, rate
        root = np.sqrt(1 - p * p)
        q = p / (1 + root)
        odd, even = np.sin(n * servo), np.cos(n * servo)
        return servo + (2 / n) * np.arctan2(q * odd, 1 - q * even), rate * (root / (1 - p * even))


def _number(value: float | Floats) -> float | Floats:
    """A plain float where there is one value for all runs."""
    return value if np.ndim(value) else float(value)


def _column(value: float | Floats) -> float | Floats:
    """One value for each run, to stand before time: shape (R, 1)."""
    return np.asarray(value)[..., None] if np.ndim(value) else value


def _passes(angle: Floats) -> Floats:
    """1.0 for intervals in which the table passed its zero mark, else 0.0; shape (..., n)."""
    turn = angle * (1 / (2 * np.pi))
    np.floor(turn, out=turn)
    return (turn[..., 1:] != turn[..., :-1]).astype(float)
