r"""An input axis and a chain of effects.

    y = u + sum_i e_i(u, motion; theta_i)

with ``u`` the true input of the axis on each interval: the rate about it, or the specific force along it.
Every effect sees the same true input, so the order does not matter and ``sensor + effect`` leaves the rest
as it was. The same chain simulates (`Sensor.measure`) and gives the regressors of a fit
(`Sensor.regressors`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, DrivenEffect, Effect


@dataclass(frozen=True)
class Sensor:
    """One input axis with its errors; the numbers are given when it is used.

    Attributes
    ----------
    target : str
        Name of the output channel: "gyro", "gyro_x", "accel_z" ...
    effects : tuple of Effect
        ``theta``, wherever one is asked for, holds their parameters one after the other, shape (..., p).
    """

    target: str
    effects: tuple[Effect, ...] = ()

    def __add__(self, effect: Effect) -> Sensor:
        return replace(self, effects=(*self.effects, effect))

    @property
    def unit(self) -> str:
        """SI unit of the output."""
        return "m/s^2" if self.target.startswith("accel") else "rad/s"

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Name of each parameter: "bias.c"; "tone.c" and "tone#2.c" where an effect comes twice."""
        names, seen = [], Counter[str]()
        for effect in self.effects:
            seen[effect.key] += 1
            label = effect.key if seen[effect.key] == 1 else f"{effect.key}#{seen[effect.key]}"
            names += [f"{label}.{param.name}" for param in effect.params]
        return tuple(names)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each parameter."""
        return tuple(p.unit.replace(OUTPUT, self.unit) for effect in self.effects for p in effect.params)

    @property
    def driven(self) -> tuple[DrivenEffect, ...]:
        """The effects driven by chance, in order: unit normals are dealt out to them one after the other."""
        return tuple(effect for effect in self.effects if isinstance(effect, DrivenEffect))

    @property
    def draws(self) -> int:
        """Unit normals per sample, over all of `driven`."""
        return sum(effect.draws for effect in self.driven)

    @property
    def draws_at_start(self) -> int:
        """Unit normals that `begin` takes, over all of `driven`."""
        return sum(effect.draws_at_start for effect in self.driven)

    def theta(self, values: Sequence[Sequence[float]]) -> Floats:
        """Parameters in one vector, shape (p,), from the values of each effect in turn.

        Raises
        ------
        ValueError
            If an effect gets more or fewer values than it has parameters.
        """
        for effect, given in zip(self.effects, values, strict=True):
            if len(given) != len(effect.params):
                raise ValueError(f"{effect.key} has {len(effect.params)} parameters, given {len(given)}")
        return np.array([float(v) for given in values for v in given])

    def missing(self, motion: Motion) -> tuple[str, ...]:
        """Fields of the exposure that some effect needs and ``motion`` lacks."""
        return tuple(dict.fromkeys(need for effect in self.effects for need in effect.missing(motion)))

    def true_input(self, motion: Motion) -> Floats:
        """Input of the axis, mean over each interval, shape (..., n), in `unit`."""
        return motion.force[self.target[-1]] if self.target.startswith("accel") else motion.rate

    def begin(self, motion: Motion, theta: Floats, z: Floats | None = None) -> tuple[Any, ...]:
        """States of the effects before the first interval of ``motion``.

        ``z`` are unit normals, shape (..., draws_at_start); without them noise begins at zero instead of in
        its stationary state.
        """
        states, first = [], 0
        for effect, part, _ in self._parts(theta, None):
            if z is not None and isinstance(effect, DrivenEffect):
                states.append(effect.start(z[..., first : first + effect.draws_at_start]))
                first += effect.draws_at_start
            else:
                states.append(effect.begin(motion, part))
        return tuple(states)

    def measure(
        self, motion: Motion, theta: Floats, state: tuple[Any, ...] | None = None, z: Floats | None = None
    ) -> tuple[Floats, tuple[Any, ...]]:
        """Output of the instrument.

        Parameters
        ----------
        motion : Motion
            Exposure on n intervals.
        theta : ndarray, shape (..., p)
        state : tuple, optional
            As returned by the call for the intervals before; None at the start of a run.
        z : ndarray, shape (..., draws, n), optional
            Unit normals; needed where the chain has a `DrivenEffect`.

        Returns
        -------
        reading : ndarray, shape (..., n)
            Mean over each interval [`unit`]; times ``motion.dt`` it is the increment.
        state : tuple
        """
        u = self.true_input(motion)
        state = self.begin(motion, theta) if state is None else state
        reading, after = u, []
        for (effect, part, normals), before in zip(self._parts(theta, z), state, strict=True):
            addition, carried = effect.apply(u, motion, part, before, normals)
            # In place once the sum is an array of its own.
            own = reading is not u and reading.shape == addition.shape
            reading = np.add(reading, addition, out=reading if own else None)
            after.append(carried)
        return reading, tuple(after)

    def regressors(self, motion: Motion, theta: Floats) -> Floats:
        """Derivative of the expected output to each parameter, shape (..., n, p); zero for a noise."""
        u = self.true_input(motion)
        columns = [effect.jacobian(u, motion, part) for effect, part, _ in self._parts(theta, None)]
        if not columns:
            return np.zeros((*u.shape, 0))
        batch = np.broadcast_shapes(*(c.shape[:-1] for c in columns))
        return np.concatenate([np.broadcast_to(c, (*batch, c.shape[-1])) for c in columns], axis=-1)

    def _parts(self, theta: Floats, z: Floats | None) -> Iterator[tuple[Effect, Floats, Floats | None]]:
        """Each effect with its own parameters and its own unit normals."""
        theta = np.asarray(theta, float)
        for effect, own, drawn in self._places:
            yield effect, theta[..., own], None if drawn is None or z is None else z[..., drawn, :]

    @cached_property
    def _places(self) -> tuple[tuple[Effect, slice, slice | None], ...]:
        """Each effect with the places of its parameters and of its unit normals, None where it takes none."""
        places: list[tuple[Effect, slice, slice | None]] = []
        p = d = 0
        for effect in self.effects:
            own, drawn = slice(p, p + len(effect.params)), None
            if isinstance(effect, DrivenEffect):
                drawn = slice(d, d + effect.draws)
                d = drawn.stop
            places.append((effect, own, drawn))
            p = own.stop
        return tuple(places)
