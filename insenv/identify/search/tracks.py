"""The state of the search on one target: what was added, what was refused, and the fit that it has come to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from insenv.identify.findings import FoundFormula, NotTestable
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.heldout import Score
from insenv.identify.fit.problem import Model, Problem
from insenv.identify.prepare.problems import Prepared
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.earth_rate import Level
from insenv.identify.search.rivals import Rivalry
from insenv.identify.search.scan import Hit

#: Effects added to one target at most.
MOST_ADDED = 8

#: Told what is being done.
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Step:
    """An effect that was added.

    Attributes
    ----------
    hit : Hit
    before, after : Score
        Held-out scores without and with it.
    p_value : float
        Of the evidence on all targets that it was added to.
    together : tuple of str
        The targets, where one cause was added to several.
    """

    hit: Hit
    before: Score
    after: Score
    p_value: float
    together: tuple[str, ...] = ()


@dataclass(frozen=True)
class Refusal:
    """A hit that was significant, by itself or on other targets, and was not added; ``reason`` in words.

    ``fails`` says that it was so by itself, and that held-out data speak against it, ``unsized`` that its size, or what
    it goes with, is not told, ``of_box`` that it is a drift of several axes of the unit together, ``fails_together``
    that it is one cause on several targets, and that held-out data of this one speak against it, ``displaced`` that
    what was added after it explained as much.
    """

    hit: Hit
    reason: str
    fails: bool = False
    unsized: bool = False
    of_box: bool = False
    fails_together: bool = False
    displaced: bool = False


@dataclass(frozen=True)
class Track:
    """The state of the search on one target.

    ``level`` is the horizontal Earth rate that is due, where it is declared and can be checked. ``instead`` are the
    noise terms that would explain as well what was added, where the noise is held to what was declared. ``finer`` is
    the length of means that held vibration, and were merged (`insenv.identify.prepare.vibration`) [s]; else 0.
    ``folded`` are frequencies that these held and that do not keep their phase: longer means see them folded [Hz].
    ``loudest`` is the frequency of the loudest vibration that the longer means no longer resolve [Hz]; else 0.
    ``one_mounting`` says that no run was mounted otherwise than the others; ``labels`` are the runs' own. ``few_waves``
    are effects of the table's angle that are never named, for it turns by too little beside a reference that comes
    late; ``local`` are faults at one rate, which such a reference hides, and which may be what another law of the rate
    is taken for. ``law`` is a product of what was recorded that what is left follows, and ``behind`` are effects that
    had been added and explain less than it does (`insenv.identify.formula`). ``in_common`` says in words with which
    other channels what is left wanders, ``apart`` that each run has a bias of its own where one for all was taken.
    ``wanders`` says that the maker's noise has a flicker or a walk.
    """

    prepared: Prepared
    candidates: tuple[Candidate, ...]
    not_testable: tuple[NotTestable, ...]
    fit: Fit
    score: Score
    tones: bool = True
    steps: tuple[Step, ...] = ()
    refusals: tuple[Refusal, ...] = ()
    hits: tuple[Hit, ...] | None = None
    last_physical: tuple[Hit, ...] = ()
    rivalries: tuple[Rivalry, ...] = ()
    level: Level | None = None
    instead: tuple[str, ...] = ()
    finer: float = 0.0
    folded: tuple[float, ...] = ()
    loudest: float = 0.0
    one_mounting: bool = True
    labels: tuple[str, ...] = ()
    few_waves: tuple[Candidate, ...] = ()
    local: tuple[Candidate, ...] = ()
    law: FoundFormula | None = None
    behind: tuple[str, ...] = ()
    in_common: str = ""
    apart: tuple[str, ...] = ()
    wanders: bool = False

    @property
    def problem(self) -> Problem:
        """The bins that the search works on."""
        return self.prepared.problem

    @property
    def family(self) -> int:
        """Tests of the whole search: its candidates, a tone, and the magnitude of the Earth rate where it is known.

        Unusual ones have further looks of their own; all of them together count for no more than one.
        """
        usual = sum(not c.effect.unusual for c in self.candidates)
        return usual + (usual < len(self.candidates)) + 1 + (self.level is not None)

    @property
    def added(self) -> Model:
        """Terms beyond the declared ones."""
        return self.fit.model[len(self.prepared.model) :]
