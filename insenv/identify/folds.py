"""Other folds of the rows, where those that are held out hold what tells of an effect.

A staircase of rates that rises is fastest at its end, and the last 40 % of the time are held out: of a cubic of which
all rows tell by ten deviations the fitted ones tell nothing, and what they do not tell cannot be named by them. Where
all rows tell an effect beyond doubt beside all that was named (`insenv.identify.search.followers.surest`), and the
manifest leaves open what is held out, the search is made twice more, with the first 40 % of the time held out and with
the 40 % in its middle. Each judges what it names by rows that its fit has not seen, as the first did. The second search
stands in the place of the first where both name that effect, by itself or as a rival, and lose nothing that the first
one named.

Both, for one alone is not enough: of 27 such effects in real and in simulated recordings whose cause was known eleven
were named by both, ten rightly, and of four that one of them named alone two were wrong.

Where the rows that are held out do not tell what is declared, because the fitted ones hold no such temperature or rate,
they can refuse nothing: a cubic of a temperature between 15 and 25 degC says nothing of 65. Then the fold is taken
whose rows do, if there is one and it loses nothing that was named.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from insenv.core.errors import InputError
from insenv.data.split import RowUse
from insenv.identify.fit.gls import solve
from insenv.identify.fit.heldout import held_out_score
from insenv.identify.loop import Outcome
from insenv.identify.search.followers import surest
from insenv.identify.search.scan import Hit
from insenv.identify.search.tracks import Progress, Track
from insenv.identify.stated import told

Uses = tuple[RowUse, ...]

#: Times the noise by which coefficients leave held-out data uncertain, from which on those do not judge a model.
CARRIED_ON = 2.0


def by_other_folds(
    outcome: Outcome,
    folds: Sequence[Uses],
    searched: Callable[[Uses], Outcome],
    progress: Progress = lambda text: None,
) -> tuple[Outcome, tuple[str, ...]]:
    """The search that names what only all rows told, with a sentence of what is held out; else the one given.

    Parameters
    ----------
    outcome : Outcome
        Of the rows that `insenv.data.split.split` holds out.
    folds : sequence of tuple of RowUse
        Of `insenv.data.split.other_folds`; the first that names it is taken.
    searched : callable
        The same search with other rows held out.
    progress : callable
        Told what is being done.
    """
    if not folds:
        return outcome, ()
    named = _stated(outcome)
    if _is_carried_on(outcome) and (found := _told_by_others(named, folds, searched, progress)) is not None:
        return found, (
            "the last 40 % of the time, which are held out by default, hold temperatures or rates that the other rows "
            "do not, so that these tell nothing of them: others are held out here. [held_out] can name other rows",
        )
    wanted = {track.problem.target: hit for track in named if (hit := surest(track)) is not None}
    if not wanted:
        return outcome, ()
    others = []
    for fold in folds:
        progress("all rows tell an effect that the fitted ones do not: other rows are held out")
        try:
            others.append(searched(fold))
        except InputError:  # too few rows are left to be fitted
            return outcome, ()
        if not _name(_stated(others[-1]), named, wanted):
            return outcome, ()
    what = ", ".join(f"{hit.candidate.effect.key} on {target}" for target, hit in wanted.items())
    return others[0], (
        f"the last 40 % of the time, which are held out by default, hold what tells of {what}: the first 40 % are held "
        "out here, and with the 40 % in the middle held out it is found as well. [held_out] can name other rows",
    )


def _is_carried_on(outcome: Outcome) -> bool:
    """Whether what is declared is carried on, in some target, beyond what the fitted rows tell of it."""
    for track in outcome.tracks:
        score = held_out_score(track.problem, solve(track.problem, track.prepared.model, track.fit.noise.power))
        if score.foretold > CARRIED_ON * score.floor > 0:
            return True
    return False


def _told_by_others(
    named: Sequence[Track], folds: Sequence[Uses], searched: Callable[[Uses], Outcome], progress: Progress
) -> Outcome | None:
    """The search by the first fold whose fitted rows tell what is declared; None where none does."""
    for fold in folds:
        progress("the fitted rows do not tell what is declared on the others: other rows are held out")
        try:
            found = searched(fold)
        except InputError:  # too few rows are left to be fitted
            continue
        if not _is_carried_on(found) and _name(_stated(found), named, {}):
            return found
    return None


def _stated(outcome: Outcome) -> list[Track]:
    """The tracks with what is stated of them in the end: a law that holds nothing as well is taken out."""
    return [told(track, outcome.seed)[0] for track in outcome.tracks]


def _name(others: Sequence[Track], first: Sequence[Track], wanted: dict[str, Hit]) -> bool:
    """Whether tracks of another search name what is wanted, and all that the first ones named."""
    for track, old in zip(others, first, strict=True):
        physical = (r for s, r in zip(track.steps, track.rivalries, strict=True) if not s.hit.candidate.generic)
        names = _named(track) | {key.partition(":")[0] for one in physical for key in one.rivals}
        hit = wanted.get(track.problem.target)
        if (hit is not None and hit.candidate.effect.id not in names) or not _named(old) <= names:
            return False
    return True


def _named(track: Track) -> set[str]:
    """Identifiers of the effects that were added; a curve without a cause is none."""
    return {step.hit.candidate.effect.id for step in track.steps if not step.hit.candidate.generic}
