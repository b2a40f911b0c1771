"""A threshold of the input: below it nothing is read, beyond it the scale factor is another one, or it is at zero.

    dead_band           -c clip(u / d, -1, 1)           what is below d is lost, and as much of what is above (c = d)
                        -c u / d for |u| < d            only what is below d is lost
    scale_factor_knee   c sign(u) max(|u| - d, 0)       beyond d the scale factor is another one
    bias_direction      c sign(u)                       the bias has a part that goes with the sense of rotation

Of rates that are all above the threshold the first form is a jump at zero, -c sign u, and tells c alone. The third
beside a scale factor is the first with c and d of their own: of three rates it is a cubic as well. The fourth is the
first one's opposite, c > 0: what is against the rotation at all rates is a threshold. The Earth's rate, which turns the
gyro on a table that rests, is none of a motor's, nor need it be below a threshold (`of_table`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self, final

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, CurveEffect, LinearEffect, Param
from insenv.effects.forms import columns
from insenv.effects.rate.scale import LEAST_RATE, rates_run

#: Thresholds that a scan tries, and the share of the least rates that counts as none.
THRESHOLDS, LEAST_SHARE = 10, 0.02
#: A share of the largest rate below which the table stands.
STANDS = 1e-5
#: Rate up to which a table stands [rad/s]: the Earth turns the gyro on it, and no motor does.
STILL = 1.02 * EARTH_RATE

#: Share of a threshold over which a jump at it is blurred, and shares of what is below it that are all of it.
SECANT, ALL = 0.05, (0.8, 1.25)
#: Knees that a scan tries, as shares of the largest rate; the share of it within which rates are one.
KNEES, LEVEL = tuple(0.05 * k for k in range(2, 19)), 0.02
#: Least share of what is below a threshold that is lost: numbers cut off towards zero lose half of a step.
CUT_OFF = 0.25


@final
@dataclass(frozen=True)
class DeadBand(CurveEffect):
    """A threshold: below it nothing is read.

    Attributes
    ----------
    whole : bool
        Whether all of a rate above the threshold is read, and not what exceeds it.
    of_table : bool
        Whether it is of the table's rate alone: at rest nothing is lost of the Earth's.
    """

    whole: bool = False
    of_table: bool = False

    id = "dead_band"
    title = "dead band"
    meaning = "below a threshold nothing is read"
    linear = (Param("c", OUTPUT, sd=0.01, bound=0.2, per_rate=True, low=0.0),)
    shapes = (Param("d", OUTPUT, sd=0.01, low=1e-4),)
    source = "IEEE Std 952-1997: dead band and threshold; Slotine and Li, Applied Nonlinear Control, section 5.1"
    instruments = ("gyro",)
    of_rate = True
    local = True
    unusual = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """What is lost, shape (..., n)."""
        u = np.where(np.abs(u) > STILL, u, 0.0) if self.of_table else u
        share = u / theta[..., 1, None]
        lost = np.where(np.abs(share) < 1.0, share, 0.0) if self.whole else np.clip(share, -1.0, 1.0)
        return np.asarray(-theta[..., 0, None] * lost)

    def jacobian(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Derivative of the addition to c and d, shape (..., n, 2).

        The whole form jumps at the threshold, by which d is known, and a jump has no derivative: the secant over
        `SECANT` of the threshold stands for it.
        """
        found = super().jacobian(u, motion, theta)
        if not self.whole:
            return found
        low, high = (theta * np.array([1.0, 1.0 + side]) for side in (-SECANT, SECANT))
        change = self.curve(u, motion, high) - self.curve(u, motion, low)
        return np.stack([found[..., 0], change / (2 * SECANT * theta[..., 1, None])], axis=-1)

    def contradiction(self, theta: Floats) -> str:
        """Of the whole form, c = d: all below the threshold is lost, and what loses a part is another bend.

        The first form may lose less: numbers cut off towards zero lose half a step on average. What loses a hundredth
        is a gain that is another one from a rate on.
        """
        share = float(theta[0] / theta[1])
        low, high = ALL if self.whole else (CUT_OFF, np.inf)
        if low <= share <= high:
            return ""
        least = "all of them" if self.whole else "all of them, or half where numbers are cut off"
        return f"it would lose {100 * share:.2g} % of the rates below its threshold, and a dead band loses {least}"

    def consistent(self, theta: Floats) -> tuple[float, ...]:
        """Of the first form the threshold of which so much would be lost: of few rates below it c alone is told."""
        return () if self.whole else (float(theta[0]) / CUT_OFF,)

    def variants(self, motion: Motion) -> tuple[Self, ...]:
        """Both forms; that of the table's rate, where the Earth's is another, comes before what is the same of it."""
        rate = np.abs(motion.rate)
        earth = bool(np.any((rate > 0) & (rate <= STILL)))
        return (*((replace(self, of_table=True),) if earth else ()), self, replace(self, whole=True))

    def grid(self, motion: Motion) -> Floats:
        """Thresholds from below the least rate that was run to half of the largest, shape (g, 1)."""
        magnitude = np.abs(motion.rate).ravel()
        largest = float(magnitude.max(initial=0.0))
        if largest < LEAST_RATE:
            return np.empty((0, 1))
        least = float(np.quantile(magnitude[magnitude > STANDS * largest], LEAST_SHARE))
        return np.geomspace(max(0.5 * least, 1e-4 * largest), 0.5 * largest, THRESHOLDS)[:, None]


@final
@dataclass(frozen=True)
class ScaleFactorKnee(CurveEffect):
    """A scale factor that is another one beyond a rate: a second range, a stage that compresses, a loop at its end."""

    id = "scale_factor_knee"
    title = "knee of the scale factor"
    meaning = "beyond a rate the scale factor is another one, as of a second range or a stage that compresses"
    linear = (Param("c", "1", sd=0.05, bound=0.5),)
    shapes = (Param("d", OUTPUT, sd=0.05, low=1e-4),)
    becomes = ("scale_factor",)
    source = "IEEE Std 952-1997: scale factor non-linearity; two straight lines"
    hides = "rate"
    instruments = ("gyro",)
    of_rate = True
    bend = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """What is read beyond the knee, shape (..., n)."""
        c, knee = (theta[..., j, None] for j in range(2))
        return np.asarray(c * np.sign(u) * np.maximum(np.abs(u) - knee, 0.0))

    def grid(self, motion: Motion) -> Floats:
        """Knees between the rates that were run, shape (g, 1)."""
        run = _run(motion)
        largest = float(run.max(initial=0.0))
        if largest < LEAST_RATE:
            return np.empty((0, 1))
        knees = (share * largest for share in KNEES)
        return np.array([[knee] for knee in knees if run[0] * (1 + LEVEL) < knee < run[-1]]).reshape(-1, 1)

    def unseen(self, motion: Motion, shape: tuple[float, ...]) -> str:
        """Up to the least rate that was run a knee is a jump at zero, and beyond the largest nothing."""
        run = _run(motion)
        seen = run.size > 1 and run[0] * (1 + LEVEL) < shape[0] < run[-1]
        return "" if seen else "no rates lie on both sides of the knee"


@final
@dataclass(frozen=True)
class BiasDirection(LinearEffect):
    """A bias with the sense of rotation, whatever the rate: the current of a motor against friction, or its field."""

    id = "bias_direction"
    title = "bias over direction"
    meaning = "a part of the bias goes with the sense of rotation, as a motor's current against friction does"
    linear = (Param("c", OUTPUT, sd=0.01, bound=0.2, per_rate=True, low=0.0),)
    source = "Coulomb friction: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083"
    instruments = ("gyro",)
    of_rate = True
    local = True
    unusual = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Sense of the rate, shape (..., n, 1); 0 where the table stands."""
        return columns(u, np.where(np.abs(u) > STILL, np.sign(u), 0.0))


def _run(motion: Motion) -> Floats:
    """Magnitudes of the rate that were run, rest not counted and those within a fiftieth of the largest as one."""
    magnitude = np.abs(motion.rate).ravel()
    cell = LEVEL * float(magnitude.max(initial=0.0))
    if not cell:
        return np.empty(0)
    which, mean = rates_run(magnitude, cell)
    return mean[which > 0]
