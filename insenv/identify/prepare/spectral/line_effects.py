"""What was found in the samples themselves as found effects: lines, an output that is held, rails at which it clips.

One entry per line, the runs in which it was seen together.
"""

from __future__ import annotations

import math

import numpy as np

from insenv.effects.noise import Quantization
from insenv.effects.timing import SampleHold
from insenv.effects.tone import Tone
from insenv.identify.clean.holds import Hold
from insenv.identify.clean.rails import Rail
from insenv.identify.findings import Added, Estimate
from insenv.identify.fit.problem import Problem
from insenv.identify.prepare.spectral.lines import SAME_LINE, Line, folds

#: To which share a rail is known at best: it is told by one value.
KNOWN = 1e-4
#: What is said of a hold that was not taken out.
LEFT_IN = "not subtracted: from one renewal to the next nothing tells the motion well enough"
#: Lines of less than so many cycles in a bin are lines of the bins.
IN_BINS = 0.5


def line_effects(
    lines: tuple[Line, ...], problem: Problem, before: float, after: float, finer: float = 0.0
) -> tuple[Added, ...]:
    """A found ``tone`` for every line; held-out errors as plain means and with all lines taken out.

    ``finer`` is the length of the bins in which lines were looked for, where those of the problem are longer [s].
    """
    width = finer or problem.bins.width
    return tuple(_effect(group, problem, before, after, width) for group in merged(lines))


def hold_effect(hold: Hold, before: float, after: float) -> Added:
    """A found ``sample_hold``; held-out errors as plain means and with it taken out."""
    parameters = (
        Estimate(SampleHold.id, "c", hold.share, hold.share_sd, "1"),
        Estimate(SampleHold.id, "hold", hold.hold, hold.hold_sd, "s"),
        *(
            Estimate(SampleHold.id, "phase" if len(hold.phases) == 1 else f"phase[{run}]", phase, hold.hold_sd, "s")
            for run, phase in enumerate(hold.phases, start=1)
        ),
    )
    return Added(
        effect=SampleHold.id,
        order=None,
        parameters=parameters,
        p_value=hold.p_value,
        likelihood_ratio=-2 * math.log(max(hold.p_value, 1e-300)),
        confounded_with=(),
        held_out_before=before,
        held_out_after=after,
        remark="seen in the samples, from one to the next; " + ("subtracted" if hold.taken else LEFT_IN),
    )


def saturation_effect(rails: tuple[Rail, ...], problem: Problem, losses: str, before: float, after: float) -> Added:
    """A found ``saturation``: the range that is read; held-out errors with the clipped rows and without them.

    ``losses`` says what is not known for it.
    """
    rows = sum(rail.rows for rail in rails)
    repeats = max(*(rail.share for rail in rails), 1 / max(sum(len(e.cell_of_row) for e in problem.exposures), 1))
    log_p = (rows - len(rails)) * math.log(min(repeats, 0.99))
    ends = tuple(
        Estimate(
            "saturation",
            "high" if rail.high else "low",
            rail.value,
            max(rail.step, KNOWN * abs(rail.value)),
            problem.unit,
        )
        for rail in rails
    )
    value = " or the ".join("largest" if rail.high else "smallest" for rail in rails)
    more = "more than the other end" if any(rail.over for rail in rails) else "more"
    text = (
        f"{rows} rows have exactly the {value} value, and {more} was to be read; "
        "they and what lies between are left out"
    )
    return Added(
        effect="saturation",
        order=None,
        parameters=ends,
        p_value=max(math.exp(max(log_p, -690.0)), 1e-300),
        likelihood_ratio=-2 * max(log_p, -690.0),
        confounded_with=(),
        held_out_before=before,
        held_out_after=after,
        remark=f"{text}; {losses}" if losses else text,
    )


def rounding_effect(step: float, p_value: float, problem: Problem, before: float, after: float) -> Added:
    """A found ``quantization``: rounding that the noise of the readings does not blur."""
    return Added(
        effect=Quantization.id,
        order=None,
        parameters=(Estimate(Quantization.id, "step", step, KNOWN * step, problem.unit),),
        p_value=max(p_value, 1e-300),
        likelihood_ratio=-2 * math.log(max(p_value, 1e-300)),
        confounded_with=(),
        held_out_before=before,
        held_out_after=after,
        remark="readings are rounded to this step, and their noise does not blur it; nothing was subtracted",
    )


def merged(lines: tuple[Line, ...]) -> tuple[tuple[Line, ...], ...]:
    """Lines of several runs that are one line, strongest first; at most one per run."""
    groups: list[list[Line]] = []
    for line in sorted(lines, key=lambda x: -x.amplitude):
        for group in groups:
            if abs(group[0].frequency - line.frequency) < SAME_LINE and all(g.run != line.run for g in group):
                group.append(line)
                break
        else:
            groups.append([line])
    return tuple(tuple(group) for group in groups)


def _effect(group: tuple[Line, ...], problem: Problem, before: float, after: float, width: float) -> Added:
    strongest = group[0]
    frequencies = [line.frequency for line in group]
    spread = max(max(frequencies) - min(frequencies), strongest.frequency_sd)
    parameters = [
        Estimate(Tone.id, "f", float(np.mean(frequencies)), spread, "Hz"),
        Estimate(Tone.id, "amplitude", strongest.amplitude, strongest.amplitude_sd, problem.unit),
    ]
    if strongest.steady and len(group) == 1:
        sd = strongest.amplitude_sd / strongest.amplitude
        parameters.append(Estimate(Tone.id, "phase", strongest.phase, sd, "rad"))
    return Added(
        effect=Tone.id,
        order=None,
        parameters=tuple(parameters),
        p_value=strongest.p_value,
        likelihood_ratio=-2 * math.log(max(strongest.p_value, 1e-300)),
        confounded_with=(),
        held_out_before=before,
        held_out_after=after,
        remark=_remark(group, width),
        runs=tuple(sorted(line.run + 1 for line in group)),
    )


def _remark(group: tuple[Line, ...], width: float) -> str:
    where = ", ".join(f"{x.frequency:.3f} Hz in run {x.run + 1}" for x in sorted(group, key=lambda x: x.run))
    what = f"{group[0].share:.1%} of the variance of the samples"
    slow = all(line.frequency < IN_BINS / width for line in group)
    fast = "" if slow else " above the bin rate"
    if group[0].averaged and folds(group[0], width):
        return f"a line just above the bin rate: {where}; {what}; damped where the means fold it to"
    if group[0].averaged:
        return f"a line above the bin rate: {where}; {what}; left to the means, which are long beside it"
    if all(line.steady for line in group):
        return f"a steady line{fast}: {where}; {what}; subtracted"
    if slow:
        return f"a line whose phase does not hold: {where}; {what}; damped in the bins to the noise beside it"
    return f"a line above the bin rate whose frequency wanders: {where}; {what}; rejected by the weights of the bins"
