"""What is no error of an instrument but a wrong unit, range, sign or axis: which one, in words.

Rates that are wrong by a factor k turn a triad by k times the angle: past half a turn no small correction finds that.
So k is tried first, over two orders of magnitude, by the rotations from rest to rest; and so are the 48 ways to call
three axes x, y and z, each with either sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations, product

import numpy as np

from insenv.core.recording import Floats
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.positions.gyros.rotations import Rotations

#: Factors that have a name: of ranges and register settings, of units.
KNOWN = {
    2.0: "2",
    4.0: "4",
    8.0: "8",
    1000.0: "1000",
    60.0: "60",
    float(np.pi / 180): "pi/180 (degrees and radians)",
    STANDARD_GRAVITY: "9.81 (g and m/s^2)",
}
#: Share by which a scale may miss a named factor, and by which scales of three axes may differ to be one factor.
NEAR = 0.06
#: Share by which a scale must be wrong to be no error of an instrument.
WRONG = 0.3
#: Factors of the rates that are tried, and how much less of the rotation errors one must leave to be believed.
TRIED, BETTER = np.geomspace(0.1, 10.0, 121), 3.0
#: Share by which errors may differ where two ways to call the axes do equally well: one is hardly turned about.
NEARLY = 1.2
#: Median error of the turns from which on the gyros do not tell them [rad]: by chance it is a quarter turn and more.
UNTOLD = 0.5
#: Bias from which an accelerometer is taken to be broken [m/s^2].
BROKEN = 0.3 * STANDARD_GRAVITY


def factor_of(scales: Sequence[float] | Floats) -> str:
    """What a common scale of several axes is, 1 for none, as the end of a sentence; empty where they have none."""
    logs = np.log(np.abs(np.asarray(scales, float)))
    if not len(logs) or not np.isfinite(logs).all() or np.ptp(logs) > 2 * NEAR or abs(logs.mean()) < WRONG:
        return ""
    scale = float(np.exp(logs.mean()))
    named = next((name for k, name in KNOWN.items() if abs(abs(logs.mean()) - abs(np.log(k))) < NEAR), "")
    what = f"a factor of {named}" if named else f"a factor of {max(scale, 1 / scale):.3g}"
    return f"readings are {scale:.3g} of what they should be, {what}: check the unit or the range setting"


def common_factor(problem: Rotations) -> float:
    """What the rates of a triad of gyros are times the true ones, to some per cent; 1 where it is no such factor.

    It is one if with it the rotations come out `BETTER` times as well, and no instrument is off by so much.
    """
    errors = [_left(problem, np.eye(3) / k) for k in TRIED]
    best = int(np.argmin(errors))
    if errors[best] * BETTER > _left(problem, np.eye(3)) or not factor_of([float(TRIED[best])]):
        return 1.0
    return float(TRIED[best])


def other_axes(problem: Rotations) -> str:
    """With which signs and order of the gyros' axes the rotations come out `BETTER` times as well, in words.

    By the median turn or by all of them: of a table that turns about one axis at a time few turns show a reversed one.
    Empty where none does; of those that do nearly as well as the best, the one that changes the least.
    """
    ways = _ways()
    each = np.array([_lefts(problem, _taken(way) / problem.gain) for way in ways])
    for left in each.T:
        best = int(np.argmax(left < NEARLY * left.min()))
        if left[best] * BETTER <= left[0]:
            break
    else:
        return ""
    return (
        f"rotations from rest to rest come out {left[0] / left[best]:.2g} times as well with the gyros' axes taken as "
        f"{_called(ways[best])} beside the accelerometers' x, y, z: check signs and order of the columns"
    )


def unaccounted(problem: Rotations, errors: Floats) -> str:
    """A word where gyros do not tell the turns at all, though no factor and no order of the axes alone mends it.

    Parameters
    ----------
    problem : Rotations
    errors : ndarray, shape (m, 2)
        What is left of each turn by all that was found [rad].
    """
    off = float(np.sqrt(np.median(np.sum(errors**2, axis=1)))) if len(errors) else 0.0
    if off < UNTOLD:
        return ""
    said = f"the gyros do not tell the turns from rest to rest: half of them are missed by more than {off:.2g} rad"
    both = [(k, way) for factor in KNOWN for k in (factor, 1 / factor) for way in _ways()]
    lefts = [_left(problem, _taken(way) / k) for k, way in both]
    best = int(np.argmin(lefts))
    if lefts[best] * BETTER > off:
        return f"{said}: check columns, units and clock"
    k, way = both[best]
    return (
        f"{said}, and come out {off / lefts[best]:.2g} times as well with readings that are {k:.3g} of what they "
        f"should be and the gyros' axes taken as {_called(way)}: check the unit or the range setting, signs and order "
        "of the columns"
    )


Way = tuple[tuple[int, ...], tuple[int, ...]]


def _ways() -> list[Way]:
    """All orders and signs of three axes, those that change the least first."""
    return sorted(
        ((order, signs) for order in permutations(range(3)) for signs in product((1, -1), repeat=3)),
        key=lambda way: sum(k != i or sign < 0 for i, (k, sign) in enumerate(zip(*way, strict=True))),
    )


def _taken(way: Way) -> Floats:
    """Axes in another order, with other signs, shape (3, 3)."""
    order, signs = way
    return np.asarray(np.array(signs)[:, None] * np.eye(3)[list(order)])


def _called(way: Way) -> str:
    return ", ".join(("-" if sign < 0 else "") + "xyz"[k] for k, sign in zip(*way, strict=True))


def _left(problem: Rotations, matrix: Floats) -> float:
    """Median error of the rotations with rates that ``matrix`` has changed [rad]."""
    return _lefts(problem, matrix)[0]


def _lefts(problem: Rotations, matrix: Floats) -> tuple[float, float]:
    """Median and root mean square of the errors of the rotations with rates that ``matrix`` has changed [rad]."""
    changed = replace(problem, turns=tuple(replace(t, rates=t.rates @ matrix.T) for t in problem.turns))
    errors, _ = changed.errors((), np.zeros(0))
    squares = np.sum(errors**2, axis=1)
    return float(np.sqrt(np.median(squares))), float(np.sqrt(np.mean(squares)))
