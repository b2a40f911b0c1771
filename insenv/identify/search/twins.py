"""Effects that no search tries, for on one recording they are the very curve of one that it does.

No data at hand tell the two apart, whatever the noise: what is named is then the commoner of two causes, and the report
says so with what would tell. An effect names its twins itself (`Effect.twins`). They are told where the recording has
but one of what would tell them apart (the tilt of a gyro on its table), the instrument can have them, and their size is
credible.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from insenv.core.units import ARCSEC, STANDARD_GRAVITY
from insenv.effects.base import Effect
from insenv.effects.triad import AccelCrossCoupling, AccelSecondOrder
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.problem import Problem, Term

#: Share of gravity that an axis feels, up to which it is level: a small tilt changes what it reads.
LEVEL = 0.3
#: Share of a row within which a skew of half a row is that, and to which it must be told.
HALF_ROW = 0.02
#: Share of half a step of the readings within which a dead band is that, and to which it must be told.
NEAR_HALF = 0.35

#: Deviations of a drift beside a tilt from which on it is said what else it may be.
LEANS_ON = 5.0
#: Shares of a row's square that the chord of a turn over the row, and its sine, are short of the cube of the rate; the
#: share of them within which a cubic is that, and to which it must be told.
CHORDS, NEAR_CHORD = (1 / 24, 1 / 6), 0.15


def twins(problem: Problem, fit: Fit, term: Term) -> tuple[Effect, ...]:
    """Effects that are the curve of a term of ``fit`` on this recording."""
    motions = [e.motion for e in problem.exposures]
    if len({m.projection for m in motions}) > 1:
        return ()
    instrument = "accelerometer" if problem.unit == "m/s^2" else "gyro"
    if instrument == "accelerometer" and not _level(problem):
        return ()
    named = {t.effect.key for t in fit.model}
    own = term.effect.twins(motions[0])
    place = next(i for i, t in enumerate(fit.model) if t is term)
    size = float(np.abs(fit.theta[fit.design.term == place]).max(initial=0.0))
    able = (e for e in own if instrument in e.instruments and e.key not in named)
    return tuple(e for e in able if size <= problem.limits(e.linear[0])[1])


def twin_sentence(found: tuple[Effect, ...]) -> str:
    """A sentence on twins; empty where there are none."""
    return "; ".join(f"on this recording {e.key} is the same curve: {e.told_by} tells them apart" for e in found)


def rarer_sentence(keys: tuple[str, ...]) -> str:
    """A sentence on rarer effects that explain no better; empty where there are none."""
    return f"rarer, and nearly the same curve on this recording: {', '.join(keys)}" if keys else ""


def half_row_sentence(skews: Sequence[tuple[float, float]], row: float) -> str:
    """A sentence on a skew of half a ``row`` [s], which is what a reading that is a mean over its row has.

    Gyros of simulations are often differences of an angle, and attitudes of units the sum of their own rates.
    ``skews`` are values with standard deviations, of each run that has one [s].
    """
    if not skews or any(sd > HALF_ROW * row for _, sd in skews):
        return ""
    for sign, when, covers in (
        (1, "ends", ': covers = "interval" says so, and leaves no skew'),
        (-1, "begins", ", which no error of the instrument is"),
    ):
        if all(abs(c - 0.5 * sign * row) <= max(HALF_ROW * row, 3 * sd) for c, sd in skews):
            return f"it is half a row, as of readings that are means over the step that {when} at their time{covers}"
    return ""


def drift_sentence(drift: float, sd: float) -> str:
    """A sentence on what drifts beside a tilt of the base, with its deviation [m/s^3]; empty where nothing does."""
    if abs(drift) < LEANS_ON * sd:
        return ""
    return (
        "its drift is what a constant offset of the gyros leaves in the angle, a base that leans on, or a drift of the "
        "accelerometer: bias_drift is the same curve"
    )


def head_sentence(effect: Effect, c: float) -> str:
    """A sentence on a law of the square of gravity's turn, of size ``c`` [s^2/m], that an eccentric head makes as well.

    An error of its angle of c_1 cos(a) + s_1 sin(a) is f_p times that: what second order and cross-coupling follow.
    """
    if effect.id not in (AccelSecondOrder.id, AccelCrossCoupling.id):
        return ""
    size = f"{abs(c) * STANDARD_GRAVITY / ARCSEC:.2g} arcsec"
    return f"an eccentricity of {size} of the head's angle does the same: mounted anew, half a turn on, it tells"


def chord_sentence(c: float, sd: float, row: float) -> str:
    """A sentence on a cubic ``c`` [s^2/rad^2] that is what a rate made of attitudes a ``row`` [s] apart has.

    Rates of simulations are often twice the vector part of the turn of a row, or its sine, over its length:
    (2/dt) sin(u dt/2) = u - (dt^2/24) u^3, and sin(u dt)/dt = u - (dt^2/6) u^3.
    """
    for share in CHORDS:
        size = share * row**2
        if sd < NEAR_CHORD * size and abs(abs(c) - size) < max(3 * sd, NEAR_CHORD**2 * size):
            what, whose = ("chord" if share == CHORDS[0] else "sine"), ("reading" if c < 0 else "reference")
            return (
                f"it is the square of a row over {1 / share:.0f}, as of a {whose} that is the {what} of the turn over "
                "each row: made of attitudes, and no error of the gyro"
            )
    return ""


def half_step_sentence(lost: float, sd: float, step: float) -> str:
    """A sentence on a dead band that takes half a ``step`` of the readings: their numbers are cut towards zero.

    ``lost`` is what every reading beyond the threshold loses, with its standard deviation [rad/s].
    """
    half = 0.5 * step
    if not step or sd > NEAR_HALF * half or abs(lost - half) > max(NEAR_HALF * half, 2 * sd):
        return ""
    return (
        "it is half a step of the readings' numbers, as of numbers that are cut off towards zero and not rounded: "
        "from the first step on each is nearer to zero by that, and the width is no threshold"
    )


def _level(problem: Problem) -> bool:
    reading = [float(np.sum(e.y * e.count) / max(e.count.sum(), 1)) for e in problem.exposures]
    return all(abs(mean) < LEVEL * STANDARD_GRAVITY for mean in reading)
