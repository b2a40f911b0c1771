"""What may stand in place of an effect of the accelerometers: biases that walk from rest to rest, or do not repeat.

Every effect is tried beside both, and what is refused for one of them alone is said.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from insenv.core.recording import Floats
from insenv.data.manifest import Manifest
from insenv.effects.bias import BiasStep
from insenv.identify.positions.accelerometers.known import KnownAttitudes
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes, with_walk
from insenv.identify.positions.checks.bent import REPEATS, WORST
from insenv.identify.positions.model import TriadTerm
from insenv.identify.positions.part import SLOW
from insenv.identify.positions.rests import Rests
from insenv.identify.positions.search import INCREDIBLE, UNFORETOLD, Doubt, Outcome
from insenv.identify.positions.walk import NEARLY

#: Likelihood ratio beside scatter alone from which on accelerometers' biases are said to change: 1e-8 of three.
GONE = 40.0
_WALKING = "beside biases that walk as far as these rests allow"
_REPEATED = "beside biases that repeat from rest to rest no better than an accelerometer does at worst"
#: What explains a few rests nearly as well as an effect, and the p-value beside it up to which that is said: what is
#: refused beside the worst repeatability is significant beside the usual one.
_AS_WELL = (
    (_WALKING, "biases that walk from rest to rest", NEARLY),
    (_REPEATED, f"biases that repeat to {1e3 * WORST:g} mm/s^2 and no better", 1.0),
)


def walks(
    manifest: Manifest, problem: Magnitudes, terms: Sequence[TriadTerm], found: Rests
) -> tuple[Magnitudes | None, list[Doubt]]:
    """The problem with the walk that is likeliest beside ``terms``, None where none is told, and what to doubt."""
    if isinstance(problem, KnownAttitudes):
        return None, []
    runs = np.array([rest.run for rest in found.rests])
    anew, worst = _set_down_anew(manifest, found)
    most = with_walk(problem, terms, runs, anew)
    doubts = [Doubt(most, (), _WALKING)]
    if worst is not None:
        # What walks is a part of what does not repeat: beside the worst of the one the likeliest of the other.
        least = with_walk(problem, terms, runs, worst, 0.0)
        doubts = [Doubt(least, (), _REPEATED, least.scale), *doubts]
    return (None if most is problem else with_walk(problem, terms, runs, anew, 0.0)), doubts


def _set_down_anew(manifest: Manifest, found: Rests) -> tuple[Floats | None, Floats | None]:
    """Covariance that parts of one rest have in common, as it is stated or usual, and at its worst.

    None where each rest is a unit of its own: what changes from one to the next is then in their scatter.
    """
    if not found.in_parts:
        return None, None
    number = np.array([rest.number for rest in found.rests])
    one = (number[:, None] == number[None, :]).astype(float)
    stated = None if manifest.positions is None else manifest.positions.repeatability
    return (one * REPEATS**2, one * WORST**2) if stated is None else (one * stated**2, one * stated**2)


def unconfirmed(outcome: Outcome, alpha: float) -> tuple[str, ...]:
    """What is significant and refused, for want of a rest that others foretell or for being more than is credible.

    What is slow and more than credible is none: attitudes that go with time have such a drift from other errors.
    """
    why = {
        UNFORETOLD: "no rest is left that could refuse it: more attitudes would tell",
        INCREDIBLE: "is larger than is credible: check signs, axes and units",
    }
    as_well = tuple(said for doubt, by, least in _AS_WELL for said in _explained_by(outcome, doubt, by, least))
    return tuple(
        f"{one.effect} would explain these rests (p = {one.p_value:.1g}), and {why[one.reason]}"
        for one in outcome.rejected
        if one.reason in why and one.p_value < alpha and not (one.reason == INCREDIBLE and one.effect in SLOW)
    ) + (as_well or _gone(outcome))


def _gone(outcome: Outcome) -> tuple[str, ...]:
    """That biases go further from rest to rest than rests scatter, though a walk stands for it: the likeliest law."""
    laws = (*SLOW, BiasStep.id)
    slow = [one for one in outcome.rejected if one.effect in laws and one.reason == f"not significant {_WALKING}"]
    best = max(slow, key=lambda one: one.likelihood_ratio or 0.0, default=None)
    if best is None or (best.likelihood_ratio or 0.0) < GONE:
        return ()
    return (
        f"the biases change over these rests: {best.effect} explains them far better than scatter does (likelihood "
        f"ratio {best.likelihood_ratio:.3g}), and biases that walk from rest to rest as well: not decided; the same "
        "attitudes again, in another order, would tell",
    )


def _explained_by(outcome: Outcome, doubt: str, by: str, least: float) -> tuple[str, ...]:
    """What would explain the rests and is refused for a ``doubt``, that something else does so as well."""
    names = {
        one.effect: one.p_value
        for one in outcome.rejected
        if one.reason == f"not significant {doubt}" and one.p_value < least and one.effect not in SLOW
    }
    if not names:
        return ()
    return (
        f"{' or '.join(names)} would explain these rests, and {by} nearly as well (p = {min(names.values()):.1g} "
        "beside them): not decided; the same attitudes again, in another order, would tell",
    )
