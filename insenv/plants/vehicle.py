r"""A parked vehicle with a triad of gyros and one of accelerometers, that turns on the spot.

    C_b^n(t) = C_v^n R_a(phi(t)) R_s(theta(t))

with the vehicle's frame v at turn angle 0, the turn angle phi (counter-clockwise) about the pivot axis a, which is the
normal of the ground, and the sway theta about a level axis s of the vehicle. The instruments stand at P = rho + R_s r
from the pivot: lever arm l = rho + r, and r from the roll centre. What they sense is the converse of the mechanisation
(`insenv.navigation.truth`), with the velocity of the instruments through the lever arms in it, so that a
mechanisation without errors finds heading, level and velocity of the references. Attitude and velocity are those in
east, north, up at the instruments; the place of the vehicle is one for gravity and Earth rate.

The mean specific force of an interval is that of C_n^b(t) f^n over it (`insenv.plants.vehicle_pieces`). The vertical
may be deflected by xi (north) and eta (east): gravity then is -g (eta, xi, 1) in the axes of the ellipsoid.
Source of the procedure: Guo, Li and He (2018), as in `insenv.plants.vehicle_sight`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate
from typing import Any, Literal, Self

import numpy as np

from insenv.core import earth
from insenv.core.attitude import dcm_from_angles
from insenv.core.errors import InputError
from insenv.core.estimate import Limits
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.angle import EarthRate
from insenv.plants.base import Plant, Reference, Scene
from insenv.plants.thermal import Constant, Temperature
from insenv.plants.vehicle_frame import Slope, product, times, transport_matrix
from insenv.plants.vehicle_rule import rule
from insenv.plants.vehicle_sight import OpticalSight, first_rows
from insenv.plants.vehicle_sway import Settling, Sway
from insenv.plants.vehicle_turn import SAME, Drive, LatestTurn, ahead

_AXES = "xyz"
_Segment = tuple[int, int, LatestTurn]


@dataclass(frozen=True)
class Vehicle(Plant):
    """A vehicle, axes right-forward-up.

    Attributes
    ----------
    heading, pitch, roll : float or ndarray, shape (R,)
        Of the instruments against the ground at turn angle 0 [rad].
    max_rate, max_acceleration : float
        Limits of a turn [rad/s], [rad/s^2]; 0: it cannot turn.
    latitude : float, optional
        [rad]; without it the Earth does not turn.
    altitude, gravity : float
        [m], [m/s^2]
    deflection : tuple of float
        Of the vertical: xi, eta [rad].
    slope : Slope
    lever_arm : tuple of float
        From the pivot to the instruments, along right, forward, up [m].
    sway : Sway
    residual, creep : Settling
        What a turn ends with.
    sight : OpticalSight, optional
    level_error : tuple of float or ndarray, shape (R,)
        Error of pitch and roll as they are told at the start [rad]; None: they are not told.
    temperature : Temperature
        Of the instruments.
    reference_temperature : float
        T_ref of the temperature effects [K].
    profile : tuple of (float, float)
        Rests [s] and the turns after them [rad]: done until the vehicle is commanded.
    """

    heading: float | Floats = 0.0
    pitch: float | Floats = 0.0
    roll: float | Floats = 0.0
    max_rate: float = 0.0
    max_acceleration: float = 0.0
    latitude: float | None = None
    altitude: float = 0.0
    gravity: float = 9.80665
    deflection: tuple[float, float] = (0.0, 0.0)
    slope: Slope = field(default_factory=Slope)
    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sway: Sway = field(default_factory=Sway)
    residual: Settling = field(default_factory=Settling)
    creep: Settling = field(default_factory=Settling)
    sight: OpticalSight | None = None
    level_error: tuple[float | Floats, float | Floats] | None = None
    temperature: Temperature = field(default_factory=Constant)
    reference_temperature: float = 298.15
    profile: tuple[tuple[float, float], ...] = ()

    @property
    def section(self) -> str:
        """The [vehicle]."""
        return "vehicle"

    @property
    def steered_by(self) -> Literal["", "rate", "angle"]:
        """An angle to turn by."""
        return "angle"

    @property
    def draws(self) -> int:
        """Unit normals per sample: one where a sighting has an error of its own."""
        return int(self.sight is not None and self.sight.tracking > 0)

    @property
    def limits(self) -> Limits:
        """Of a turn."""
        return Limits(self.max_rate, self.max_acceleration)

    @property
    def pivots(self) -> bool:
        """Whether its profile has turns."""
        return any(angle for _, angle in self.profile)

    @property
    def sightings(self) -> tuple[str, ...]:
        """Of the sight, where there is one, and of the level with it, where that is told."""
        if self.sight is None:
            return ()
        return ("sight_heading",) if self.level_error is None else ("sight_heading", "level_pitch", "level_roll")

    @property
    def excludes(self) -> Mapping[str, str]:
        """The Earth rate is what its gyros are there to sense."""
        return {EarthRate.id: "earth_rate is no error of a [vehicle]'s gyros, which sense it"}

    def turned(self, angle: float) -> Self:
        """Towards another heading."""
        return replace(self, heading=self.heading + angle)

    @property
    def turns(self) -> bool:
        """Whether it can turn."""
        return 0 < self.max_rate < np.inf and 0 < self.max_acceleration < np.inf

    @cached_property
    def attitude(self) -> Floats:
        """C_v^n: attitude at turn angle 0, without sway, shape (..., 3, 3)."""
        return product(self.slope.dcm, dcm_from_angles(self.heading, self.pitch, self.roll))

    @cached_property
    def drive(self) -> Drive:
        """What it turns with."""
        axis = times(np.swapaxes(self.attitude, -1, -2), self.slope.dcm[:, 2])
        # A vehicle that cannot turn has a drive of any rate: it is never told to go.
        limits = (self.max_rate, self.max_acceleration) if self.turns else (1.0, 1.0)
        return Drive(*limits, axis, (self.residual, self.creep))

    @cached_property
    def starts(self) -> tuple[float, ...]:
        """Times at which the turns of the profile begin [s]."""
        lasting = [self.turn_time(angle) for _, angle in self.profile]
        rests = [rest for rest, _ in self.profile]
        return tuple(accumulate(rest + before for rest, before in zip(rests, [0.0, *lasting[:-1]], strict=False)))

    def turn_time(self, angle: float) -> float:
        """Time that a turn takes [s]; infinite if it cannot turn."""
        if not self.turns:
            return 0.0 if angle == 0 else np.inf
        return float(self.drive.times(np.asarray(angle, float))[1])

    def commands(self, step: float, n: int) -> Floats:
        """Angles to turn by [rad], shape (n,): those of the profile, each at the step that is nearest."""
        found, time = np.zeros(n), 0.0
        for rest, angle in self.profile:
            time += rest
            k = round(time / step)
            if k < n:
                found[k] = angle
            time = k * step + self.turn_time(angle)
        return found

    def begin(self) -> LatestTurn:
        """The vehicle at rest.

        Raises
        ------
        InputError
            If its profile has turns and it cannot turn.
        """
        if not self.turns and self.pivots:
            raise InputError("the profile asks for a turn of a vehicle without a rate and an acceleration to turn with")
        return ahead()

    def advance(
        self, state: LatestTurn, command: Floats | float | None, t: Floats, z: Floats
    ) -> tuple[Scene, LatestTurn]:
        """Go on over the intervals with edges ``t``.

        Parameters
        ----------
        state : LatestTurn
        command : ndarray, shape (...), or float, optional
            Angle to turn by from ``t[0]`` on [rad], counter-clockwise; 0 or NaN: stay, and a vehicle that turns goes
            on turning. None: as the profile says.
        t : ndarray, shape (n + 1,)
            [s]
        z : ndarray, shape (..., draws, n)
            Unit normals.

        Returns
        -------
        scene : Scene
            Exposure of gyro_x .. gyro_z and accel_x .. accel_z. References: "turn_angle" (also as "table_angle") and
            "turning" (1 in intervals with a turn in them); "heading", "pitch", "roll" and "velocity_east", "_north",
            "_up", all true; "sight_heading", "level_pitch", "level_roll" (NaN where there is no reading);
            "temperature".
        state : LatestTurn

        Raises
        ------
        InputError
            If a vehicle that cannot turn is told to.
        """
        if command is not None and not self.turns and np.nan_to_num(np.asarray(command, float)).any():
            raise InputError("a turn was commanded of a vehicle that has no rate or no acceleration to turn with")
        segments = list(self._segments(state, command, t))
        after = segments[-1][2]
        batch = np.broadcast_shapes(
            self.attitude.shape[:-2],
            () if self.sway.waves is None else self.sway.waves.shape[:-2],
            after.start.shape,
            z.shape[:-2] if self.draws else (),
            () if self.sight is None else np.shape(self.sight.installation),
        )
        runs, n = int(np.prod(batch)), len(t) - 1
        means, edges = np.empty((runs, 7, n)), np.empty((runs, 10, n + 1))
        for first, last, turning in segments:
            self._play(t, (first, last), turning, (means, edges))
        means, edges = means.reshape(*batch, 7, n), edges.reshape(*batch, 10, n + 1)
        temperature = self.temperature.at(t)
        scene = Scene(
            self._motions(t, means, edges, temperature),
            self._references(means, edges, temperature) | self._readings(t, segments, edges, z),
        )
        return scene, after

    def _segments(self, state: LatestTurn, command: Floats | float | None, t: Floats) -> Iterator[_Segment]:
        """Stretches of intervals with one latest turn each: first edge, last edge, state."""
        first, n = 0, len(t) - 1
        if command is not None:
            state = replace(state, planned=len(self.profile))
            state = self.drive.commanded(state, np.asarray(command, float), float(t[0]))
        while state.planned < len(self.profile):
            edge = int(np.searchsorted(t, self.starts[state.planned] - SAME))
            if edge >= n:
                break
            if edge > first:
                yield first, edge, state
            angle = np.asarray(self.profile[state.planned][1])
            state = replace(self.drive.commanded(state, angle, float(t[edge])), planned=state.planned + 1)
            first = edge
        yield first, n, state

    def _play(self, t: Floats, span: tuple[int, int], state: LatestTurn, out: tuple[Floats, Floats]) -> None:
        """Fill the means over intervals and the values at edges of all runs."""
        from insenv.plants.vehicle_pieces import expose  # numba costs more to import than all the rest

        ramp, whole = self.drive.times(state.by)
        push = np.copysign(self.drive.acceleration, state.by)
        turn = np.stack(np.broadcast_arrays(state.start, state.before, state.by, push, ramp, whole), axis=-1)
        waves = np.zeros((1, 0, 3)) if self.sway.waves is None else self.sway.waves
        settle = np.array([(one.velocity, one.time_constant) for one in (self.residual, self.creep)])
        rows = (_listed(self._fixed, 1), _listed(turn, 1), _listed(state.tails, 2), settle, _listed(waves, 2))
        expose(t, span, rows, self._rule, *out)

    @cached_property
    def _rule(self) -> tuple[float, Floats, Floats, int]:
        """Length, nodes, transform and terms of the pieces of time in which the motion is resolved."""
        # No turn, by 360 deg at most, gets faster than that.
        turning = min(self.max_rate, np.sqrt(2 * np.pi * self.max_acceleration)) if self.turns else 0.0
        fading = [1 / one.time_constant for one in (self.residual, self.creep) if one.velocity]
        found = rule(2 * np.pi * self.sway.fastest, float(max([turning, *fading])))
        return found.length, found.nodes, found.transform, found.terms

    @cached_property
    def _fixed(self) -> Floats:
        """What does not change in a run, shape (..., 39).

        Earth rate, specific force of gravity, pivot axis, sway axis, pivot to roll centre, roll centre to instruments
        and up, in the vehicle's frame; C_v^n; the matrix from velocity to transport rate in that frame.
        """
        c = self.attitude
        to_body = np.swapaxes(c, -1, -2)
        xi, eta = self.deflection
        rate = earth.earth_rate_enu(self.latitude) if self.latitude is not None else np.zeros(3)
        transport = transport_matrix(self.latitude, self.altitude) if self.latitude is not None else np.zeros((3, 3))
        sway = np.array([np.sin(self.sway.axis), np.cos(self.sway.axis), 0.0])
        arm = np.array(self.sway.arm) if self.sway.waves is not None else np.zeros(3)
        vectors = (
            times(to_body, rate),
            times(to_body, self.gravity * np.array([eta, xi, 1.0])),
            self.drive.axis,
            sway,
            np.array(self.lever_arm) - arm,
            arm,
            c[..., 2, :],
        )
        matrices = (c, product(product(to_body, transport), c))
        batch = c.shape[:-2]
        parts = [np.broadcast_to(v, (*batch, 3)) for v in vectors] + [m.reshape(*batch, 9) for m in matrices]
        return np.concatenate(parts, axis=-1)

    def _motions(self, t: Floats, means: Floats, edges: Floats, temperature: Floats) -> dict[str, Motion]:
        shared: dict[str, Any] = {
            "t": t,
            "angle": edges[..., 9, :],
            "force": {axis: means[..., 3 + i, :] for i, axis in enumerate(_AXES)},
            "temperature": temperature,
            "reference_temperature": self.reference_temperature,
        }
        rates = {axis: means[..., i, :] for i, axis in enumerate(_AXES)}
        motions = {
            f"gyro_{axis}": Motion(
                rate=rates[axis],
                rate_edges=edges[..., i, :],
                cross_rate={other: rate for other, rate in rates.items() if other != axis},
                **shared,
            )
            for i, axis in enumerate(_AXES)
        }
        still = np.zeros(len(t) - 1)
        others = {axis: {o: f for o, f in shared["force"].items() if o != axis} for axis in _AXES}
        return motions | {f"accel_{a}": Motion(rate=still, cross_rate=others[a], **shared) for a in _AXES}

    def _references(self, means: Floats, edges: Floats, temperature: Floats) -> dict[str, Reference]:
        found = {
            "turn_angle": Reference(edges[..., 9, 1:], "rad"),
            "table_angle": Reference(edges[..., 9, 1:], "rad"),
            "turning": Reference(means[..., 6, :], "1", over_interval=True),
            "temperature": Reference(temperature[1:], "K"),
        }
        for i, name in enumerate(("heading", "pitch", "roll")):
            found[name] = Reference(edges[..., 3 + i, 1:], "rad")
        for i, name in enumerate(("east", "north", "up")):
            found[f"velocity_{name}"] = Reference(edges[..., 6 + i, 1:], "m/s")
        return found

    def _readings(self, t: Floats, segments: list[_Segment], edges: Floats, z: Floats) -> dict[str, Reference]:
        """What the sight shows, and the level that is told."""
        found, heading, first = {}, edges[..., 3, 1:], t[0] == 0.0
        if self.sight is not None:
            taken = np.zeros(heading.shape, bool)
            taken[..., 0] = first
            for start, last, turning in segments if self.sight.after_turns else ():
                end = np.where(turning.by != 0, turning.start + self.drive.times(turning.by)[1], np.nan)
                first_rows(t, (start, last), end - SAME, taken)
            found["sight_heading"] = Reference(self.sight.read(heading, taken, z), "rad")
        if self.level_error is not None:
            for i, name in enumerate(("pitch", "roll")):
                level = np.full(heading.shape, np.nan)
                if first:
                    level[..., 0] = edges[..., 4 + i, 1] + self.level_error[i]
                found[f"level_{name}"] = Reference(level, "rad")
        return found


def _listed(values: Floats, axes: int) -> Floats:
    """All runs in one axis, contiguous; ``axes`` are those of one run."""
    batch, own = values.shape[:-axes], values.shape[-axes:]
    return np.ascontiguousarray(values).reshape(int(np.prod(batch)), *own)
