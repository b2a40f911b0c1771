"""Positions of a unit on a table of several axes: those at right angles, the published order, and how it gets there."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, product

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.unit.gimbals import Gimbals

QUARTER = np.pi / 2
#: Turns of 90 deg about axes of the unit by which 19 positions follow each other. Source: Xie Bo, Multiposition
#: calibration method of laser gyro SINS, J. Chinese Inertial Technology 2011, as the toolbox PSINS simulates it.
NINETEEN = ["+y", "+y", "+y", "-y", "-y", "-y", "+z", "+x", "+x", "+x", "-x", "-x", "-x", "+z", "+z", "-z", "-z", "-z"]
#: Cosine from which on a direction is that of an axis.
_SAME = 0.99

Angles = tuple[float, ...]


def attitude(gimbals: Gimbals, angles: Sequence[float]) -> Floats:
    """Matrix from the base's axes to the unit's, shape (3, 3), of a table without errors."""
    at = np.asarray(angles, float)[:, None]
    none = np.zeros(len(gimbals.names))
    columns = []
    for x, y, z in np.eye(3)[..., None]:
        columns.append(np.concatenate(np.broadcast_arrays(*gimbals.inside((x, y, z), at, none))))
    return np.stack(columns, axis=-1)


def up(gimbals: Gimbals, angles: Sequence[float]) -> Floats:
    """Direction up in the unit's axes, shape (3,)."""
    direction: Floats = attitude(gimbals, angles)[:, 2]
    return direction


def right_angles(gimbals: Gimbals) -> tuple[Angles, ...]:
    """All combinations of multiples of 90 deg that the table reaches, from -90 to 180 deg."""
    steps = [[q * QUARTER for q in (0, 1, 2, -1) if abs(q) * QUARTER <= most + 1e-9] for most in gimbals.most]
    return tuple(product(*steps))


def six(gimbals: Gimbals) -> tuple[Angles, ...]:
    """Each axis of the unit up and down, the nearest position that does it taken each time.

    Raises
    ------
    InputError
        If the table does not reach one of them.
    """
    found: list[Angles] = []
    now: Angles = (0.0,) * len(gimbals.axes)
    for axis, sense in ((2, 1), (1, 1), (1, -1), (0, 1), (0, -1), (2, -1)):
        able = [a for a in right_angles(gimbals) if sense * up(gimbals, a)[axis] > _SAME]
        if not able:
            raise InputError(f"a table with axes {gimbals.axes!r} does not bring {'xyz'[axis]} of the unit up and down")
        now = min(able, key=lambda a: float(np.abs(np.subtract(a, now)).sum()))
        found.append(now)
    return tuple(found)


def nineteen(gimbals: Gimbals) -> tuple[Angles, ...]:
    """The published 19 positions, by turns of one axis of the table each.

    The unit's axes are named otherwise where the table's need it.

    Raises
    ------
    InputError
        If no naming suits the table.
    """
    for names in permutations("xyz"):
        renamed = [turn[0] + dict(zip("xyz", names, strict=True))[turn[1]] for turn in NINETEEN]
        found = _turned(gimbals, renamed)
        if found is not None:
            return found
    raise InputError(f"a table with axes {gimbals.axes!r} cannot turn a unit through the 19 positions")


def _turned(gimbals: Gimbals, turns: Sequence[str]) -> tuple[Angles, ...] | None:
    """Positions of turns about the unit's axes, from zero on; None where no axis of the table makes one."""
    now = np.zeros(len(gimbals.axes))
    found: list[Angles] = [tuple(now.tolist())]
    for turn in turns:
        axis, sense = "xyz".index(turn[1]), 1.0 if turn[0] == "+" else -1.0
        for m in reversed(range(len(now))):
            unit = np.zeros((len(now), 1))
            unit[m] = 1.0
            along = np.concatenate(gimbals.turning(unit, now[:, None], np.zeros(len(gimbals.names))))[axis]
            after = now[m] + sense * along * QUARTER
            if abs(along) > _SAME and abs(after) <= gimbals.most[m] + 1e-9:
                now[m] = after
                break
        else:
            return None
        found.append(tuple(np.round(now / QUARTER) * QUARTER))
    return tuple(found)


def twenty_four(gimbals: Gimbals) -> tuple[Angles, ...]:
    """The 24 attitudes at right angles, the nearest next; a table that reaches fewer goes through them again."""
    left: dict[bytes, Angles] = {}
    for angles in right_angles(gimbals):
        left.setdefault(np.rint(attitude(gimbals, angles)).astype(int).tobytes(), angles)
    every = list(left.values())
    found: list[Angles] = []
    now: Angles = (0.0,) * len(gimbals.axes)
    while len(found) < 24:
        rest = [a for a in every if a not in found[len(found) // len(every) * len(every) :]]
        now = min(rest, key=lambda a: float(np.abs(np.subtract(a, now)).sum()))
        found.append(now)
    return tuple(found)


def from_level(gimbals: Gimbals, angles: Sequence[float]) -> tuple[Floats, Floats]:
    """Matrices from east, north, up to the unit's axes and to the base's, shape (3, 3), without errors."""
    none = np.zeros(len(gimbals.names))
    base = np.stack(
        [np.concatenate(np.broadcast_arrays(*gimbals.based((x, y, z), none))) for x, y, z in np.eye(3)[..., None]],
        axis=-1,
    )
    return attitude(gimbals, angles) @ base, base
