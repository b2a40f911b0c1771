"""What of a calibration holds for a recording.

==========================================  =============================  ==================================
a term                                      on the recordings it was made  on another recording
                                            from (by their fingerprints)
==========================================  =============================  ==================================
of the instrument                           taken out                      taken out
confounded with another effect              taken out                      left: the other may be the true one
of its run: a bias where runs have their    taken out, with the run's own  left: another power-up
own
of the run's clock: a step, a drift, a      taken out                      left: time and phase are the run's
warm-up, a tone
of the reference: an encoder's error,       the reference is corrected,    left: another table, or another zero
timing                                      not the reading
of the place: what goes with the angle of   taken out                      left: another place
a table
a true input: Earth rate, tilt of a base    left: no error                 left
a curve without a cause, a line without a   left: nobody knows what it is  left
steady phase
==========================================  =============================  ==================================
"""

from __future__ import annotations

from insenv.calibration.contents import Term
from insenv.data.exposure import CHANNEL_OF, Exposure
from insenv.effects.base import Effect

#: Whose error a term is, where it is not the instrument's: why another recording does not have it.
_ELSEWHERE = {
    "reference": "an error of the reference that it was made with",
    "place": "belongs to the place and the table that it was made at",
}


def why_kept(term: Term, effect: Effect, run: int | None, exposure: Exposure) -> str:
    """Why a term is left in the readings of run ``run`` (None: another recording); empty where it is taken out."""
    always = _why_always(term, effect)
    if always:
        return always
    return _why_elsewhere(term, effect, exposure) if run is None else _why_here(term, run)


def _why_always(term: Term, effect: Effect) -> str:
    if effect.belongs == "input":
        return "a true input, no error"
    if term.generic:
        return "a curve whose cause is not known"
    if not term.fitted:
        return "no residual shows it: its least size alone is known"
    if term.is_line and not any(p.name == "phase" for p in term.parameters):
        return "a line that wanders, or of several runs: no phase to take it out with"
    return "" if term.parameters else "the recording did not tell its parameters"


def _why_here(term: Term, run: int) -> str:
    if term.runs and run not in term.runs:
        return f"not found in run {run}"
    if term.run_dependent and not any(p.run == run for p in term.parameters):
        return f"no fit saw run {run}, which has its own"
    return ""


def _why_elsewhere(term: Term, effect: Effect, exposure: Exposure) -> str:
    if effect.belongs != "instrument":
        return _ELSEWHERE[effect.belongs]
    if term.run_dependent:
        return "changes from one power-up to the next"
    if effect.of_time or term.is_line:
        return "goes by the clock of the run that it was found in"
    if term.confounded_with:
        return f"could not be told from {', '.join(term.confounded_with)}"
    missing = sorted({CHANNEL_OF.get(n.partition(".")[0], n) for n in effect.missing(exposure.motion)})
    return f"needs the channel {', '.join(missing)}" if missing else ""
