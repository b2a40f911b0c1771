r"""Errors that depend on the way by which a value was reached: play in the reference, hysteresis of the scale factor.

    encoder_backlash          projection d/dt [c/2 s(a)]      the encoder stays behind by the play c after each reversal
    scale_factor_hysteresis   c s(u)                          or, closed at the largest rate U, c s(u) (1 - u^2 / U^2),
                                                              of another scale on the way up, c s(|u|) u / U

with s(x) = (x - P(x)) / r between -1 and 1, P the play operator of radius r,

    P_k = min(max(P_{k-1}, x_k - r), x_k + r),    P_0 = x_0:

s is 1 where x was last raised by more than r, -1 where it was lowered, and in between on the way from the one to the
other after each turning point. Of a play that starts at rest the noise of the angle would go to and fro in s, and is
the reference's own error with a sign: a goes through a play of its own first, within which noise moves nothing.

Source: M. Brokate and J. Sprekels, Hysteresis and Phase Transitions (1996), chapter 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, Self, final

import numpy as np

from insenv.core.motion import Motion, interval_slope, reading_noise
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, MemoryEffect, Param
from insenv.effects.forms import SET, known, play, reversals, spread, turning_points
from insenv.effects.rate.scale import LEAST_RATE

#: Radius of the play by which a reversal is told from the noise of an angle: unasked [rad], in deviations of that
#: noise, and the least [rad]; and the largest that is tried, half of a play.
REVERSED, BEYOND, LEAST, WIDEST = 1e-3, 10.0, 1e-8, 0.05
#: Share of the least radius within which an angle moves by its noise alone.
STILL = 0.5
#: Share of a way that a play must be at least which is taken up over it: radii are tried in steps of some four.
TAKEN_UP = 0.1
#: Ratio of two radii of which reversals are compared, one that goes with the noise is none by the larger one; and how
#: many are tried of those that see as many.
RATIO, RADII_OF_PLAY = 4.0, 5
#: Change of a rate that holds from one interval to the next, as a share of the largest, and the share of the time that
#: it must hold.
HOLDS, LEAST_HOLD = 1e-3, 0.3
#: Radii of a hysteresis that a scan tries, as shares of the largest rate, and the least, in deviations of the noise of
#: one reading of the rate: that of which a loop is taken has less, for it is smoothed. Of 48 noisy references without a
#: hysteresis none shows one, radii of that size tried.
RADII, LEAST_RADIUS = (0.01, 0.05, 0.15, 0.3, 0.6), 2.0

#: Share of the largest rate that is a change of it; share of that which is clearly on one side; fewest rows of a rate
#: that was reached from one side.
SIDES, CLEARLY, REACHED = 0.05, 0.5, 3

Form = Literal["open", "closed", "share"]


def _from_both_sides(rate: Floats, largest: float) -> bool:
    """Whether some rate of a run, shape (n,), is reached from below and from above, by a part of the largest."""
    radius = SIDES * largest
    if not radius:
        return False
    side = (rate - play(rate, np.array(radius), np.array(0.0))) / radius
    level = np.rint(rate / radius).astype(int)
    below, above = (
        np.bincount(level[side * way > CLEARLY] - level.min(), minlength=np.ptp(level) + 1) for way in (1, -1)
    )
    return bool(np.any(np.minimum(below, above) >= REACHED))


def _ladder(high: float, low: float) -> list[float]:
    """Radii from a high one down to a low one, each `RATIO` times less."""
    steps = int(np.log(high / low) / np.log(RATIO))
    return [high * RATIO**-k for k in range(steps + 1)]


@final
@dataclass(frozen=True)
class EncoderBacklash(MemoryEffect):
    """An encoder on a coupling with play: after each reversal it stays behind by c.

    Attributes
    ----------
    radius : float
        Of the play by which a reversal is told: beyond the noise of the angle [rad].
    still : float
        Radius within which the angle moves by its noise alone [rad].
    """

    radius: float = REVERSED
    still: float = 0.0

    id = "encoder_backlash"
    title = "backlash of the encoder"
    meaning = "the reference is wrong: play in the encoder's coupling, taken up after each reversal"
    linear = (Param("c", "rad", sd=1e-4, bound=0.1, low=0.0),)
    needs = ("angle",)
    source = "Play operator: Brokate and Sprekels, Hysteresis and Phase Transitions (1996), section 2.1"
    instruments = ("gyro",)
    belongs = "reference"
    unusual = True

    def over(self, motion: Motion) -> Self:
        """The effect with the least radius that sees reversals of the table alone (`variants`)."""
        return self.variants(motion)[0]

    def variants(self, motion: Motion) -> tuple[Self, ...]:
        """With a radius beyond the noise of the angle, and larger ones: a play is taken up over a way of twice one.

        No smooth motion is left in fourth differences; but an angle that was smoothed has its noise in longer waves: a
        radius that sees more reversals than a larger one sees those of noise. Larger ones are tried that see as many.
        """
        if motion.angle is None:
            return (self,)
        least = min(max(BEYOND * reading_noise(motion.angle), LEAST), REVERSED)
        angle = turning_points(motion.angle.reshape(-1, motion.angle.shape[-1])[0])
        radius, count = least, 0
        for smaller in _ladder(REVERSED, least):
            seen = reversals(angle, smaller)
            if count and seen > count:
                break
            radius, count = smaller, seen
        widest = next((r for r in _ladder(WIDEST, radius) if r > radius and reversals(angle, r) == count > 0), None)
        radii = [radius] if widest is None else np.geomspace(radius, widest, RADII_OF_PLAY).tolist()
        return tuple(replace(self, radius=r, still=STILL * radius) for r in radii)

    def contradiction(self, theta: Floats) -> str:
        """That a play is taken up over a way that is far longer, where no noise of the angle asks for so long a one."""
        if self.radius <= REVERSED or float(theta[0]) >= TAKEN_UP * 2 * self.radius:
            return ""
        return f"its play would be {float(theta[0]):.2g} rad, and taken up over {2 * self.radius:.2g} rad"

    def begin(self, motion: Motion, theta: Floats) -> Floats:
        """Where the coupling is, in the middle of its play, and the angle beyond its noise, shape (..., 2)."""
        first = known(motion, "angle", self.id)[..., 0, None]
        return np.broadcast_to(first, (*np.broadcast_shapes(first.shape[:-1], np.shape(theta)[:-1]), 2)).copy()

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """What the reference lacks while the play is taken up, shape (..., n), and where both are, (..., 2)."""
        coupling, moved = np.moveaxis(np.asarray(state), -1, 0)
        angle = play(known(motion, "angle", self.id), self.still, moved)
        angle[..., 0] = moved
        behind = play(angle, self.radius - self.still, coupling)
        behind[..., 0] = coupling
        side = (angle - behind) / (self.radius - self.still)
        rate = 0.5 * motion.projection * motion.gain * interval_slope(side, motion.dt)
        return spread(u, theta[..., 0, None] * rate), np.stack([behind[..., -1], angle[..., -1]], axis=-1)

    def blind(self, motion: Motion) -> str:
        """Nothing of it is in a rest, nor where the table never reverses."""
        if motion.stands:
            return SET
        both = float(motion.rate.min(initial=0.0)) < 0 < float(motion.rate.max(initial=0.0))
        return "" if both else "the table never reverses"

    def grid(self, motion: Motion) -> Floats:
        """No shape: one row without columns, where the table reverses."""
        return np.empty((1, 0))


@final
@dataclass(frozen=True)
class ScaleFactorHysteresis(MemoryEffect):
    """An output that depends on whether a rate was reached from below or from above.

    Attributes
    ----------
    form : "open", "closed" or "share"
        c s(u); c s(u) (1 - u^2 / U^2), closed at the largest rates; c s(abs u) u / U, another scale on the way up.
    top : float
        The largest rate U [rad/s].
    least : float
        Radius below which the noise of the reference alone goes to and fro in the play [rad/s].
    """

    form: Form = "open"
    top: float = 1.0
    least: float = 0.0

    id = "scale_factor_hysteresis"
    title = "hysteresis of the scale factor"
    meaning = "the output depends on whether a rate was reached from below or from above"
    linear = (Param("c", OUTPUT, sd=0.01, bound=0.1, per_rate=True),)
    shapes = (Param("r", OUTPUT, sd=0.1, low=1e-3),)
    source = "Stop operator: Brokate and Sprekels, Hysteresis and Phase Transitions (1996), section 2.1"
    instruments = ("gyro",)
    of_rate = True
    unusual = True

    def variants(self, motion: Motion) -> tuple[Self, ...]:
        """All forms, with the largest rate of ``motion`` and radii beyond the noise of the reference."""
        top = float(np.abs(motion.rate).max(initial=0.0)) or 1.0
        fitted = replace(self, top=top, least=LEAST_RADIUS * motion.rate_noise)
        return (fitted, replace(fitted, form="closed"), replace(fitted, form="share"))

    def begin(self, motion: Motion, theta: Floats) -> Floats:
        """The first rate was reached from rest: shape (...)."""
        return np.zeros(np.broadcast_shapes(motion.rate.shape[:-1], np.shape(theta)[:-1]))

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """The loop, shape (..., n), and what follows the rate through the play, shape (...)."""
        radius = np.maximum(theta[..., 1, None], self.least)
        x = np.abs(u) if self.form == "share" else u
        x = np.broadcast_to(x, np.broadcast_shapes(x.shape, radius.shape))
        behind = play(x, radius, np.asarray(state))
        side = (x - behind) / radius
        if self.form == "closed":
            side = side * (1.0 - (u / self.top) ** 2)
        elif self.form == "share":
            side = side * u / self.top
        return spread(u, theta[..., 0, None] * side), behind[..., -1].copy()

    def blind(self, motion: Motion) -> str:
        """Where the rate never holds, as the phase of a servo that lags, or none is reached from both sides."""
        largest = float(np.abs(motion.rate).max(initial=0.0))
        holds = np.abs(np.diff(motion.rate, axis=-1)) < HOLDS * largest + BEYOND * reading_noise(motion.rate)
        if not holds.size or float(np.mean(holds)) < LEAST_HOLD:
            return "the rate hardly ever holds: a table that lags behind looks the same"
        if not any(_from_both_sides(rate, largest) for rate in motion.rate.reshape(-1, motion.n)):
            return "no rate is reached from below and from above: it is a curve of the rate there"
        return ""

    def grid(self, motion: Motion) -> Floats:
        """Radii of the play, shape (g, 1)."""
        largest = float(np.abs(motion.rate).max(initial=0.0))
        radii = np.array(RADII) * largest
        radii = radii[radii > LEAST_RADIUS * motion.rate_noise]
        return radii[:, None] if largest > LEAST_RATE else np.empty((0, 1))
