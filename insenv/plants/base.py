"""What every plant gives: the exposure of each input axis, and the reference channels of its log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from insenv.core.motion import Motion
from insenv.core.recording import Floats


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
    """A plant holds settings only; its state goes in and comes out."""

    @property
    def reference_temperature(self) -> float:
        """T_ref of the temperature effects [K]."""

    @property
    def draws(self) -> int:
        """Unit normals per sample."""

    def begin(self) -> Any:
        """State at time 0."""

    def advance(self, state: Any, command: Any, t: Floats, z: Floats) -> tuple[Scene, Any]:
        """Go on over the intervals with edges ``t``, shape (n + 1,).

        ``command`` is None where the plant goes on as before; ``z`` are unit normals, shape (..., draws, n).
        """
