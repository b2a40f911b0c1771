"""What every plant gives: the exposure of each input axis, and the reference channels of its log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol, Self

import numpy as np

from insenv.core.estimate import Limits
from insenv.core.motion import Motion
from insenv.core.recording import Floats, Mounting


@dataclass(frozen=True)
class Reference:
    """A reference channel at the ends of the intervals.

    Attributes
    ----------
    values : ndarray, shape (..., n)
        Value at the end of each interval, or mean over it.
    unit : str
        SI unit.
    over_interval : bool
        Whether the values are means over the intervals.
    """

    values: Floats
    unit: str
    over_interval: bool = False


@dataclass(frozen=True)
class Scene:
    """What a plant did on ``n`` intervals.

    Attributes
    ----------
    motions : mapping of str to Motion
        Exposure of each input axis that the plant carries, by the name of its channel: "gyro", "accel_x".
    references : mapping of str to Reference
        What is logged beside the instruments: "table_angle", "table_rate", "temperature".
    """

    motions: Mapping[str, Motion]
    references: Mapping[str, Reference]


class Plant(Protocol):
    """A plant holds settings only; its state goes in and comes out.

    It says of itself what a scenario, a datasheet or an environment must know: nobody asks which plant it is. What is
    said here holds of a plain one, which carries triads, has no encoder and is driven by nobody; a plant says what
    differs.
    """

    @property
    def reference_temperature(self) -> float:
        """T_ref of the temperature effects [K]."""
        ...

    @property
    def latitude(self) -> float | None:
        """Of where it stands [rad]; without it the Earth does not turn."""
        ...

    @property
    def section(self) -> str:
        """The table of a scenario that describes it: "base"."""
        ...

    @property
    def steered_by(self) -> Literal["", "rate", "angle"]:
        """What it can be commanded: a rate that it keeps, an angle to turn by, or nothing."""
        return ""

    @property
    def draws(self) -> int:
        """Unit normals per sample."""
        return 0

    @property
    def by_chance(self) -> bool:
        """Whether chance moves it, so that it is not the command alone that says what an instrument is exposed to."""
        return self.draws > 0

    @property
    def limits(self) -> Limits:
        """Of what it can be commanded."""
        return Limits()

    @property
    def mounting(self) -> Mounting:
        """How it carries the instruments, as a datasheet tells it."""
        return Mounting()

    @property
    def encoder_noise(self) -> float:
        """White noise of its own reading of the angle [rad]."""
        return 0.0

    @property
    def pivots(self) -> bool:
        """Whether its profile turns it, with triads that it carries, about the vertical."""
        return False

    @property
    def repeatable(self) -> float | None:
        """Length of its profile [s] where that can be played again in the same run; None where it cannot."""
        return None

    @property
    def sightings(self) -> tuple[str, ...]:
        """References that are read at instants: of a sight, and of a level."""
        return ()

    @property
    def tells(self) -> Mapping[str, tuple[float, ...]]:
        """Parameters of effects that follow from the plant [SI], by the id of the effect."""
        return {}

    @property
    def entails(self) -> Mapping[str, str]:
        """Effects that its instruments must have, by id, and why."""
        return {}

    @property
    def excludes(self) -> Mapping[str, str]:
        """Effects that its instruments cannot have, by id, and why."""
        return {}

    def turned(self, angle: float) -> Self:
        """The plant with its base turned by ``angle``, clockwise from above [rad]."""
        ...

    def felt_force(self) -> Self:
        """The plant with the specific force in every exposure, where that is left out to save time."""
        return self

    def commands(self, step: float, n: int) -> Floats:
        """Its profile as commands that go out at every ``step`` [s], shape (n,): each at the step that is nearest.

        Raises
        ------
        InputError
            If the profile is one that no such commands play.
        """
        del step
        return np.zeros(n)

    def begin(self) -> Any:
        """State at time 0."""
        ...

    def later(self, state: Any, by: float) -> Any:
        """The state as it would be had the run begun ``by`` [s] later, where its profile is `repeatable`."""
        del by
        return state

    def advance(self, state: Any, command: Any, t: Floats, z: Floats) -> tuple[Scene, Any]:
        """Go on over the intervals with edges ``t``, shape (n + 1,).

        ``command`` is None where the plant goes on as before; ``z`` are unit normals, shape (..., draws, n).
        """
        ...
