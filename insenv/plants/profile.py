r"""Rate profiles as data: a sequence of pieces.

In each of them the commanded rate is

    W(s) = r + A sin(2 pi f s),    s the time since the piece began.

A constant rate, a staircase, reversals and rests are pieces with A = 0; a sine is one piece.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

Profile = tuple["Piece", ...]


@dataclass(frozen=True)
class Piece:
    """A stretch of a profile.

    Attributes
    ----------
    duration : float
        [s]
    rate : float
        Commanded rate [rad/s].
    amplitude : float
        Amplitude of the sine on top [rad/s].
    frequency : float
        Its frequency [Hz].
    """

    duration: float
    rate: float = 0.0
    amplitude: float = 0.0
    frequency: float = 0.0


def constant(rate: float, duration: float) -> Profile:
    """One rate [rad/s] all the time."""
    return (Piece(duration, rate),)


def rest(duration: float) -> Profile:
    """The table stands still."""
    return (Piece(duration),)


def staircase(rates: Sequence[float], dwell: float) -> Profile:
    """Each of ``rates`` [rad/s] for ``dwell`` [s]."""
    return tuple(Piece(dwell, rate) for rate in rates)


def reversal(rate: float, dwell: float, cycles: int = 1) -> Profile:
    """``+rate`` and ``-rate`` [rad/s], ``dwell`` [s] each, ``cycles`` times."""
    return cycles * (Piece(dwell, rate), Piece(dwell, -rate))


def sine(amplitude: float, frequency: float, duration: float, rate: float = 0.0) -> Profile:
    """An oscillation of ``amplitude`` [rad/s] at ``frequency`` [Hz] about ``rate`` [rad/s]."""
    return (Piece(duration, rate, amplitude, frequency),)


def duration(profile: Profile) -> float:
    """Length of a profile [s]."""
    return sum(piece.duration for piece in profile)
