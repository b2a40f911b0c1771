r"""A base at rest that carries a triad of gyros and one of accelerometers, and that may tilt a little.

In the level frame (right, forward, up; forward at the azimuth ``heading`` from north, clockwise)

    Earth rate      w = (-w_E cos L sin h, w_E cos L cos h, w_E sin L)
    specific force  f = (0, 0, g)

A base that turns by the small angles ``th = (th_R, th_F, 0)`` about the level axes shows

    its gyros           w - th x w + d(th)/dt
    its accelerometers  f - th x f = f + g (-th_F, th_R, 0)

The matrix of pitch and roll takes all this to the body axes. What an accelerometer reads of the tilt is the
effect ``base_tilt``, with ``Motion.base_tilt = mat_bl (-th_F, th_R, 0)``; ``Motion.force`` stays that of
the untilted base.

The tilt is a first-order Gauss-Markov process, smoothed by a second pole of the same time constant: a
parked vehicle, pushed about by wind and people. It is linear between the edges, so mean rates and mean
tilts are exact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion, interval_mean
from insenv.core.recording import Floats
from insenv.effects.tilt import BaseTilt
from insenv.plants.base import Plant, Reference, Scene
from insenv.plants.thermal import Constant, Temperature

_AXES = "xyz"


@dataclass(frozen=True)
class Disturbance:
    """Random tilt of the base: standard deviation ``sd`` [rad] per level axis, ``time_constant`` [s]."""

    sd: float = 0.0
    time_constant: float = 60.0


@dataclass(frozen=True)
class StaticBase(Plant):
    """A base at rest, axes right-forward-up.

    Attributes
    ----------
    heading : float
        Azimuth of the forward axis [rad], clockwise from north.
    pitch, roll : float
        Forward axis up, right axis down [rad].
    gravity : float
        [m/s^2]
    latitude : float, optional
        [rad]; without it the Earth does not turn.
    disturbance : Disturbance
    temperature : Temperature
        Of the instruments.
    reference_temperature : float
        T_ref of the temperature effects [K].
    """

    heading: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    gravity: float = 9.80665
    latitude: float | None = None
    disturbance: Disturbance = field(default_factory=Disturbance)
    temperature: Temperature = field(default_factory=Constant)
    reference_temperature: float = 298.15

    @property
    def section(self) -> str:
        """The [base]."""
        return "base"

    @property
    def draws(self) -> int:
        """Unit normals per sample: one for each level axis about which the base tilts."""
        return 2 if self.disturbance.sd > 0 else 0

    @property
    def tells(self) -> Mapping[str, tuple[float, ...]]:
        """Gravity, of which a tilt shows a part."""
        return {"base_tilt": (self.gravity, 0.0)}

    @property
    def entails(self) -> Mapping[str, str]:
        """The tilt, where there is one."""
        if not self.disturbance.sd > 0:
            return {}
        return {BaseTilt.id: "the base tilts and the accelerometers read gravity times it"}

    def turned(self, angle: float) -> Self:
        """Towards another heading."""
        return replace(self, heading=self.heading + angle)

    @property
    def mat_bl(self) -> Floats:
        """Matrix from the level frame to the body, shape (3, 3)."""
        cp, sp, cr, sr = np.cos(self.pitch), np.sin(self.pitch), np.cos(self.roll), np.sin(self.roll)
        about_right = np.array([[1, 0, 0], [0, cp, sp], [0, -sp, cp]])
        about_forward = np.array([[cr, 0, -sr], [0, 1, 0], [sr, 0, cr]])
        return about_forward @ about_right

    @property
    def earth_rate(self) -> Floats:
        """Earth rate in the level frame [rad/s], shape (3,)."""
        if self.latitude is None:
            return np.zeros(3)
        north = EARTH_RATE * np.cos(self.latitude)
        up = EARTH_RATE * np.sin(self.latitude)
        return np.array([-north * np.sin(self.heading), north * np.cos(self.heading), up])

    def begin(self) -> Floats | None:
        """The base untilted: None, or the filter's two memories and the last tilt."""
        return None

    def advance(self, state: Floats | None, command: None, t: Floats, z: Floats) -> tuple[Scene, Floats | None]:
        """Go on over the intervals with edges ``t``, shape (n + 1,) [s]; ``z`` of shape (..., draws, n).

        Returns
        -------
        scene : Scene
            Exposure of gyro_x .. gyro_z and accel_x .. accel_z; reference "temperature".
        state : ndarray, shape (..., 2, 3), or None
        """
        del command  # nobody drives a base at rest
        temperature = self.temperature.at(t)
        tilt, state = self._tilt(state, t, z)
        motions = self._motions(t, temperature, tilt)
        return Scene(motions, {"temperature": Reference(temperature[1:], "K")}), state

    def _tilt(self, state: Floats | None, t: Floats, z: Floats) -> tuple[Floats | None, Floats | None]:
        """Tilts about the level axes at the edges [rad], shape (..., 2, n + 1), and the state."""
        if not self.draws:
            return None, None
        from scipy.signal import lfilter  # slow to import

        dt = float(t[-1] - t[0]) / (len(t) - 1)
        a = np.exp(-dt / self.disturbance.time_constant)
        # Two equal poles: variance (1 + a^2) / (1 - a^2)^3 per unit of driving variance.
        gain = self.disturbance.sd * np.sqrt((1 - a * a) ** 3 / (1 + a * a))
        if state is None:
            state = np.zeros((*z.shape[:-1], 3))
        new, memory = lfilter([gain], [1.0, -2 * a, a * a], z, axis=-1, zi=state[..., :2])
        at_edges = np.concatenate([state[..., 2:], new], axis=-1)
        return at_edges, np.concatenate([memory, new[..., -1:]], axis=-1)

    def _motions(self, t: Floats, temperature: Floats, tilt: Floats | None) -> dict[str, Motion]:
        n = len(t) - 1
        rates = self._rates(t, tilt)
        force = dict(zip(_AXES, self._to_body(np.zeros(n), np.zeros(n), np.full(n, self.gravity)), strict=True))
        shared: dict[str, Any] = {
            "t": t,
            "force": force,
            "temperature": temperature,
            "reference_temperature": self.reference_temperature,
        }
        motions = {
            f"gyro_{axis}": Motion(
                rate=rate,
                cross_rate={other: r for other, r in zip(_AXES, rates, strict=True) if other != axis},
                **shared,
            )
            for axis, rate in zip(_AXES, rates, strict=True)
        }
        leaning = self._leaning(n, tilt)
        for axis, lean in zip(_AXES, leaning, strict=True):
            others = {other: f for other, f in force.items() if other != axis}
            motions[f"accel_{axis}"] = Motion(rate=np.zeros(n), base_tilt=lean, cross_rate=others, **shared)
        return motions

    def _rates(self, t: Floats, tilt: Floats | None) -> tuple[Floats, Floats, Floats]:
        """Rates of the tilting base about the body axes [rad/s], each of shape (..., n)."""
        if tilt is None:
            return self._to_body(*(np.full(len(t) - 1, w) for w in self.earth_rate))
        dt = float(t[-1] - t[0]) / (len(t) - 1)
        turning = np.diff(tilt, axis=-1) / dt
        mean = interval_mean(tilt)
        right, forward = mean[..., 0, :], mean[..., 1, :]
        wr, wf, wu = self.earth_rate
        return self._to_body(
            wr - forward * wu + turning[..., 0, :],
            wf + right * wu + turning[..., 1, :],
            wu - right * wf + forward * wr,
        )

    def _leaning(self, n: int, tilt: Floats | None) -> tuple[Floats, Floats, Floats]:
        """Share of gravity that each accelerometer reads of the tilt, each of shape (..., n)."""
        if tilt is None:
            return np.zeros(n), np.zeros(n), np.zeros(n)
        mean = interval_mean(tilt)
        return self._to_body(-mean[..., 1, :], mean[..., 0, :], np.zeros_like(mean[..., 0, :]))

    def _to_body(self, right: Floats, forward: Floats, up: Floats) -> tuple[Floats, Floats, Floats]:
        """Components along the body axes of a vector given in the level frame."""
        x, y, z = (row[0] * right + row[1] * forward + row[2] * up for row in self.mat_bl)
        return x, y, z
