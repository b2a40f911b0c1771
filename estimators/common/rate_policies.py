"""Table rates by the clock: one direction, half of the time each way, or a profile that was proposed.

An action is (rate [rad/s], stop), shape (..., 2); the time is that of the rows recorded so far. Each asks to stop once
its duration is over.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG, quantity
from insenv.information.table_motion import Course, back_and_forth, one_way

#: The rate of the published procedure [rad/s].
PUBLISHED_RATE = 10 * DEG


class Clockwork:
    """A policy that follows a course, whatever is measured.

    Parameters
    ----------
    course : Course
    duration : float
        [s]
    sampling : float
        [Hz]; a command counts from the sample that it is nearest to.
    """

    def __init__(self, course: Course, duration: float, sampling: float) -> None:
        self.course, self.duration, self.sampling = course, duration, sampling

    def reset(self, batch: int | None = None) -> Floats:
        """Time passed [s], for every run."""
        return np.zeros(() if batch is None else batch)

    def act(self, state: Floats, chunk: Recording | None, estimate: Estimate | None = None) -> tuple[Floats, Floats]:
        """Rate of the course and whether its time is over, shape (..., 2); the time passed."""
        t = 0.0 if chunk is None or not len(chunk) else float(chunk.t[-1])
        near = t + 0.5 / self.sampling
        action = np.array([self.course.command(near), float(near >= self.duration)])
        return np.broadcast_to(action, (*np.shape(state), 2)).copy(), np.full(np.shape(state), t)


class ConstantRate(Clockwork):
    """One rate [rad/s] in one direction; a negative one is clockwise."""

    def __init__(self, datasheet: Datasheet, rate: float = PUBLISHED_RATE) -> None:
        super().__init__(one_way(checked_rate(datasheet, rate)), datasheet.duration, datasheet.sampling)


class Bidirectional(Clockwork):
    """Half of the time each way; the time that the table needs to turn over is shared by both halves."""

    def __init__(self, datasheet: Datasheet, rate: float = PUBLISHED_RATE, reversals: int = 1) -> None:
        rate = checked_rate(datasheet, rate)
        course = back_and_forth(rate, datasheet.duration, reversals, datasheet.limits.acceleration)
        super().__init__(course, datasheet.duration, datasheet.sampling)


class Proposed(Clockwork):
    """A profile with its quantities as texts, as closing the loop proposes it for the next experiment.

    Parameters
    ----------
    datasheet : Datasheet
    profile : mapping
        Keys of a scenario's ``[profile]``: ``{"kind": "reversal", "rate": "10 deg/s", "dwell": "150 s"}`` or
        ``{"kind": "staircase", "rates": ["10 deg/s", "5 deg/s"], "dwell": "50 s"}``, or "steps" of time and rate.

    Raises
    ------
    InputError
        If it is of another kind, lacks a key, has a wrong quantity, or asks for a rate that the table has not.
    """

    def __init__(self, datasheet: Datasheet, profile: Mapping[str, Any]) -> None:
        dwells = [(quantity(time, "time", "profile: dwell"), way, text) for time, way, text in _dwells(profile)]
        rates = [checked_rate(datasheet, way * quantity(text, "rate", "profile: rate")) for _, way, text in dwells]
        times = [time for time, _, _ in dwells]
        if not rates or not min(times) > 0:
            shortest = min(times, default=0.0)
            raise InputError(
                f"profile: {len(rates)} rates for {shortest:g} s each given, wanted one or more for some time"
            )
        starts = np.cumsum([0.0, *times])
        super().__init__(Course(tuple(starts[:-1].tolist()), tuple(rates)), float(starts[-1]), datasheet.sampling)


def _dwells(profile: Mapping[str, Any]) -> list[tuple[Any, float, Any]]:
    """How long each rate is held, its sign, and its text."""
    kind = profile.get("kind")
    needed = {"reversal": ("rate", "dwell"), "staircase": ("rates", "dwell"), "steps": ("steps",)}
    if kind not in needed:
        raise InputError(f"profile: kind {kind!r} given, wanted {', '.join(needed)}")
    for key in needed[kind]:
        if key not in profile:
            raise InputError(f"profile: a {kind} without {key!r} given, wanted it")
    if kind == "steps":
        return [(time, 1.0, rate) for time, rate in profile["steps"]]
    given, dwell = profile[needed[kind][0]], profile["dwell"]
    if kind == "staircase":
        return [(dwell, 1.0, text) for text in given]
    return int(profile.get("cycles", 1)) * [(dwell, 1.0, given), (dwell, -1.0, given)]


def checked_rate(datasheet: Datasheet, rate: float) -> float:
    """The rate, if the table has it.

    Raises
    ------
    InputError
        If it does not.
    """
    if not abs(rate) <= datasheet.limits.rate * (1 + 1e-9):
        raise InputError(
            f"a table rate of {rate / DEG:g} deg/s given; wanted at most {datasheet.limits.rate / DEG:g} deg/s"
        )
    return rate
