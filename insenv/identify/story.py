"""How a confounded recording was settled, experiment by experiment: plain frozen results. All numbers are SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from insenv.identify.findings import Findings

#: How a story ends: nothing is confounded any more; the time is spent; nothing that was proposed can be played.
Ending = Literal["settled", "budget", "no-procedure"]


@dataclass(frozen=True)
class FirstRun:
    """What an estimator makes of the first run: its error against the truth, and the standard deviation it tells."""

    error: float
    sd: float


@dataclass(frozen=True)
class Wanted:
    """The quantity that the user wants, in SI ``unit``, and the ``estimator`` that finds it."""

    name: str
    unit: str
    demanded: float
    estimator: str


@dataclass(frozen=True)
class Chapter:
    """An experiment, and what all runs so far tell.

    Attributes
    ----------
    procedure : str
        What was done.
    separates : tuple of str
        Effects that it was to tell apart; empty for the first run.
    expected_sigma : float, optional
        Separation that was expected.
    profile, changes : mapping
        Of the scenario.
    duration, elapsed : float
        Instrument time of this run, and of all runs so far [s].
    found : Findings
        On all runs so far.
    answer : FirstRun, optional
        On the first run, with what was found taken out of it.
    own : FirstRun, optional
        The same quantity as the loop's own fit of all runs tells it, where it does.
    """

    procedure: str
    separates: tuple[str, ...]
    expected_sigma: float | None
    profile: Mapping[str, Any]
    changes: Mapping[str, Any]
    duration: float
    elapsed: float
    found: Findings
    answer: FirstRun | None
    own: FirstRun | None


@dataclass(frozen=True)
class Story:
    """The whole of it; ``raw`` is the answer on the first run as it was measured."""

    scenario: str
    title: str
    seed: int
    budget: float
    wanted: Wanted | None
    raw: FirstRun | None
    chapters: tuple[Chapter, ...]
    ending: Ending

    @property
    def verdict(self) -> str:
        """Of the last experiment."""
        return self.chapters[-1].found.verdict
