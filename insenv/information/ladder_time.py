r"""Dwells of a scale-factor test: what a table can do in the time that there is.

The table needs |change| / a from one rate to the next. A dwell of T_i tells the mean output with the variance

    N^2 / T_i + e^2,

with the random walk N of the gyro and an error e of each setting that no dwell averages out. So a few long dwells end
at e, and many short ones at the same rates do not. Over whole turns what depends on the angle averages out: a turn
takes 2 pi / |rate|, and one at each rate of a list spends most of the time at the low rates, which tell nothing of the
scale factor.

Source of the published list: Zhang, DOI 10.11857/j.issn.1674-5124.2016.12.001.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import DEG
from insenv.information.ladder import LadderDesign, covariance

TURN = 2 * np.pi
#: Magnitudes of the published list [rad/s], of which zero comes first and last.
PUBLISHED = tuple(rate * DEG for rate in (0, 0.5, 0.8, 1, 2, 5, 8, 10, 15, 18, 19, 20, 21, 22, 25, 28, 30, 35))


@dataclass(frozen=True)
class Dwells:
    """Rates [rad/s] in their order and how long each is held [s], both of shape (n,)."""

    rate: Floats
    time: Floats

    def slewing(self, acceleration: float) -> Floats:
        """Time that the table needs before each dwell [s], shape (n,); it is at rest before the first."""
        return np.abs(np.diff(self.rate, prepend=0.0)) / acceleration

    def duration(self, acceleration: float = np.inf) -> float:
        """Of all of it [s]."""
        return float(self.time.sum() + self.slewing(acceleration).sum())

    def covariance(self, model: str, top: float, noise: float, floor: float = 0.0, weighted: bool = True) -> Floats:
        """Covariance of the coefficients of a model, in rad/s, of the rate as a share of ``top``; shape (p, p).

        Parameters
        ----------
        model : str
            As of `insenv.information.ladder.MODELS`.
        top : float
            [rad/s]
        noise : float
            Angle random walk [rad/sqrt(s)].
        floor : float
            Error of each setting [rad/s].
        weighted : bool
            Else by plain least squares.
        """
        return covariance(model, self.rate / top, noise**2 / self.time + floor**2, weighted)

    def scale_factor_sd(self, model: str, noise: float, floor: float = 0.0, weighted: bool = True) -> float:
        """Standard deviation of the relative error of the scale factor."""
        top = float(np.abs(self.rate).max())
        return float(np.sqrt(self.covariance(model, top, noise, floor, weighted)[1, 1])) / top


def published(turns: int = 1, rest: float = 60.0) -> Dwells:
    """The published list of 36: rising counter-clockwise, falling clockwise; at rest for ``rest`` s at either end."""
    rate = np.array([*PUBLISHED, *(-w for w in reversed(PUBLISHED))]) + 0.0  # no minus zero
    return Dwells(rate, np.where(rate == 0, rest, turns * TURN / np.maximum(np.abs(rate), 1e-9)))


def dwells(
    design: LadderDesign,
    duration: float,
    acceleration: float = np.inf,
    visits: int = 8,
    *,
    whole_turns: bool = False,
    zero: float = 0.0,
) -> Dwells:
    """A design in so many rounds, falling and rising in turn, so that a steady drift falls out of the scale factor.

    Parameters
    ----------
    design : LadderDesign
    duration : float
        Of all of it, but for the rounding to whole turns [s].
    acceleration : float
        Of the table [rad/s^2].
    visits : int
        Rounds; the rate that ends one and begins the next is held for both.
    whole_turns : bool
        Round each dwell to whole turns, one at least.
    zero : float
        Time at rest before each round and after the last [s].

    Raises
    ------
    InputError
        If there is no round, or the table needs all the time to change its rate.
    """
    if visits < 1:
        raise InputError(f"rate ladder: {visits} visits given, wanted one or more")
    rest = np.zeros(int(zero > 0))
    rate, share = (
        np.concatenate([np.concatenate([rest, part[:: -1 if k % 2 == 0 else 1]]) for k in range(visits)] + [rest])
        for part in (design.rate, design.share / visits)
    )
    rate, share = _joined(rate, share)
    still = (share == 0) * zero
    spare = duration - still.sum() - Dwells(rate, still).slewing(acceleration).sum()
    if not 0 < spare < np.inf:
        raise InputError(f"rate ladder: {duration:g} s given, of which {spare:g} s are left to dwell; wanted more")
    time = share * spare + still
    if whole_turns:
        turn = TURN / np.maximum(np.abs(rate), 1e-9)
        time = np.where(rate == 0, time, turn * np.maximum(np.rint(time / turn), 1.0))
    return Dwells(rate, time)


def _joined(rate: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Dwells at the same rate that follow each other, as one."""
    group = np.concatenate([[0], np.cumsum(np.diff(rate) != 0)])
    first = np.unique(group, return_index=True)[1]
    total: Floats = np.bincount(group, share).astype(float)
    return rate[first], total
