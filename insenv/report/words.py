"""What verdicts and effects mean, in sentences that the text and the HTML report share."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import groupby

from insenv.identify.findings import Added, Estimate, Findings, HeldOut, NotTestable, TargetFindings
from insenv.report.quantities import number, p_value, percent, span, unit_for

#: Effect id -> its name in running text, and what it is physically in one line.
EFFECTS: dict[str, tuple[str, str]] = {
    "bias": ("bias", "a constant error"),
    "bias_drift": ("bias drift", "the bias moves in proportion to time"),
    "bias_warm_up": ("warm-up of the bias", "the bias settles exponentially after switch-on"),
    "bias_step": ("bias step", "the bias jumps once to another value and stays there"),
    "bias_temperature": ("bias over temperature", "the bias follows the temperature"),
    "bias_temperature_rate": (
        "bias over temperature rate",
        "the bias follows the speed of temperature change (in a fibre coil: the Shupe effect)",
    ),
    "bias_thermal_lag": (
        "thermal lag of the bias",
        "the part that makes the bias is warmed later than the thermometer, by a first-order lag",
    ),
    "scale_factor": ("scale factor", "the output is wrong in proportion to the input"),
    "scale_factor_drift": ("scale-factor drift", "the scale factor moves in proportion to time"),
    "scale_factor_warm_up": (
        "warm-up of the scale factor",
        "the scale factor settles exponentially after switch-on",
    ),
    "scale_factor_temperature": ("scale factor over temperature", "the scale factor follows the temperature"),
    "scale_factor_asymmetry": (
        "scale-factor asymmetry",
        "clockwise and anticlockwise have different scale factors",
    ),
    "scale_factor_cubic": ("cubic scale factor", "the scale factor changes with the square of the rate"),
    "scale_factor_anomaly": (
        "local scale-factor anomaly",
        "the output is wrong near one rate only, as by a resonance or a faulty stage",
    ),
    "lock_in": (
        "lock-in",
        "coupling of the two beams pulls a ring laser's frequency towards zero at low rates",
    ),
    "encoder_harmonic": (
        "encoder harmonic",
        "the reference is wrong: the table's encoder repeats an angle error every turn",
    ),
    "angle_locked_rate": (
        "rate locked to the table angle",
        "the gyro's error depends on where it points: magnetic field, heat or tilt",
    ),
    "earth_rate": ("Earth rate", "the Earth's rotation as the input axis sees it"),
    "timing_skew": ("timing skew", "gyro and reference are not sampled at the same time"),
    "sample_hold": ("sample and hold", "the output repeats its last value for a while"),
    "g_sensitivity": ("g-sensitivity", "the bias follows the specific force along an axis"),
    "cross_axis": ("cross-axis coupling", "the input axis sees a part of the rate about another axis"),
    "tone": ("tone", "a line at one frequency: dither, vibration, mains or a servo"),
    "base_tilt": (
        "base tilt",
        "the base turns, as the gyros show, and gravity leaks into the level accelerometers",
    ),
    "non_orthogonality": ("non-orthogonality", "the axes of the triad are not at right angles"),
    "accel_scale_factor": (
        "accelerometer scale factor",
        "the output is wrong in proportion to the specific force",
    ),
    "accel_bias": ("accelerometer bias", "a constant error of an accelerometer"),
    "spline_time": (
        "smooth curve over time",
        "generic: something that changes slowly with time, cause unknown",
    ),
    "spline_temperature": ("smooth curve over temperature", "generic: something that goes with temperature"),
    "spline_rate": ("smooth curve over rate", "generic: something that goes with the rate"),
    "spline_angle": ("smooth curve over angle", "generic: something that goes with the table angle"),
    "angle_random_walk": ("angle random walk", "white noise of the rate"),
    "bias_instability": ("bias instability", "flicker noise of the rate"),
    "rate_random_walk": ("rate random walk", "the rate's error wanders like a random walk"),
    "quantization": ("quantization", "noise from the finite step of the angle read-out"),
}

#: Words for the same noise on an accelerometer.
ON_ACCELEROMETER = {
    "angle_random_walk": "velocity random walk",
    "rate_random_walk": "acceleration random walk",
}

#: Verdict -> short label, tone of its banner ("good", "watch" or "plain").
LABELS: dict[str, tuple[str, str]] = {
    "effects-found": ("Explained", "good"),
    "effects-found-incomplete": ("Explained in part", "watch"),
    "confounded": ("Found, but ambiguous", "watch"),
    "generic-only": ("Described, not explained", "watch"),
    "unexplained-structure": ("Not explained", "watch"),
    "nothing-significant": ("Nothing significant", "plain"),
}


def name(key: str) -> str:
    """Name of an effect in running text, from "id" or "id:order"; an unknown id stands for itself."""
    effect, _, order = key.partition(":")
    title = EFFECTS.get(effect, (effect,))[0]
    return f"{title} (order {order})" if order else title


def meaning(key: str) -> str:
    """What the effect is physically, in one line; empty for an unknown id."""
    return EFFECTS.get(key.partition(":")[0], ("", ""))[1]


def key_of(added: Added) -> str:
    """Identifier with the order: "encoder_harmonic:1"."""
    return added.effect if added.order is None else f"{added.effect}:{added.order}"


def noise_name(effect: str, unit: str) -> str:
    """Name of a noise in running text; ``unit`` of its target tells a gyro from an accelerometer."""
    return ON_ACCELEROMETER.get(effect, name(effect)) if unit == "m/s^2" else name(effect)


def listing(items: Iterable[str], last: str = "and") -> str:
    """Join items as in a sentence: "a", "a and b", "a, b and c"."""
    words = list(items)
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def headline(target: TargetFindings, who: str = "") -> str:
    """The verdict on one target (or on ``who``, targets alike) in one or two plain sentences."""
    who = who or target.target
    found = listing(name(key_of(a)) for a in target.added)
    rivals = listing(
        dict.fromkeys(name(key) for a in target.added for key in (key_of(a), *a.confounded_with)), "or"
    )
    return {
        "effects-found": f"The declared model of {who} lacked {found}.",
        "effects-found-incomplete": f"The declared model of {who} lacked {found}, and that is not all.",
        "confounded": f"The declared model of {who} lacks something, "
        f"and this recording cannot tell what: {rivals}.",
        "generic-only": f"The declared model of {who} lacks something that no physical effect explains; "
        f"what describes it is generic: {found or 'a smooth curve'}.",
        "unexplained-structure": f"The residual of {who} is not noise, and no effect explains it.",
        "nothing-significant": f"Nothing significant is missing from the declared model of {who}.",
    }.get(target.verdict, f"{who}: {target.verdict}.")


def sureness(target: TargetFindings, alpha: float) -> list[str]:
    """How sure the verdict is: sentences with the figures that stand behind it."""
    said = [*map(_chance, target.added), *map(_sentence, target.reasons)]
    said.append(_outcome(target.held_out, bool(target.added)))
    if target.verdict == "nothing-significant":
        said.append(
            f"A false alarm of the whole search was allowed in {percent(alpha)} of recordings; "
            "an effect too weak for this recording, or not testable with it, would not show."
        )
    if target.verdict == "effects-found-incomplete":
        said.append(f"The residual still exceeds its noise: {_over_floor(target.held_out)} on held-out data.")
    return said


def _sentence(text: str) -> str:
    """``text`` with a capital and a full stop, unless it opens with an identifier."""
    text = text.strip()
    first = text.split(" ", 1)[0]
    opened = text if "_" in first or ":" in first else text[:1].upper() + text[1:]
    return opened if opened.endswith((".", "!", "?")) else opened + "."


def _chance(added: Added) -> str:
    title = name(key_of(added))
    imitation = f"noise alone would imitate it with probability p {p_value(added.p_value)}"
    return f"{title[:1].upper()}{title[1:]}: {imitation}."


def _over_floor(held_out: HeldOut) -> str:
    ratio = held_out.after / held_out.noise_floor if held_out.noise_floor > 0 else math.nan
    return f"{number(ratio)} times the noise floor"


def _outcome(held_out: HeldOut, added: bool) -> str:
    """What happened on the data that no fit saw."""
    unit = unit_for(held_out.unit, held_out.before, held_out.after)
    before, after, floor = (unit.show(x) for x in (held_out.before, held_out.after, held_out.noise_floor))
    means = f"means over {span(held_out.averaging)}"
    if not added:
        return (
            f"On data that no fit saw, {means} scatter by {after} rms; the fitted noise alone leaves {floor}."
        )
    return (
        f"On data that no fit saw, the error of {means} went from {before} to {after} rms "
        f"({change(held_out)}); the fitted noise alone leaves {floor}."
    )


def change(held_out: HeldOut) -> str:
    """Relative change of the held-out error: "-94%"."""
    share = held_out.after / held_out.before - 1 if held_out.before > 0 else math.nan
    if not math.isfinite(share):
        return "—"
    return ("-" if share < 0 else "+") + percent(abs(share))


def overall(findings: Findings) -> str:
    """The verdicts on all targets, one sentence for targets that share one."""
    alike: dict[tuple[object, ...], list[TargetFindings]] = {}
    for target in findings.targets:
        kind = (target.verdict, *((key_of(a), a.confounded_with) for a in target.added))
        alike.setdefault(kind, []).append(target)
    return " ".join(headline(group[0], listing(t.target for t in group)) for group in alike.values())


def rival_sets(target: TargetFindings) -> list[tuple[str, ...]]:
    """Sets of effects that this recording cannot tell apart, each once."""
    sets: dict[frozenset[str], tuple[str, ...]] = {}
    for added in target.added:
        rivals = (key_of(added), *added.confounded_with)
        if added.confounded_with:
            sets.setdefault(frozenset(rivals), rivals)
    return list(sets.values())


def by_need(target: TargetFindings) -> list[tuple[str, list[str]]]:
    """What could not be tested, grouped by what it would need."""

    def need(item: NotTestable) -> str:
        return f"needs {listing(item.needs)}" if item.needs else item.reason or "no reason given"

    ordered = sorted(target.not_testable, key=need)
    return [(key, [item.effect for item in group]) for key, group in groupby(ordered, key=need)]


def shift(before: Estimate, after: Estimate | None) -> float:
    """By how many of its own standard deviations the first answer was off; NaN where that cannot be said."""
    if after is None or not before.sd > 0:
        return math.nan
    return (after.value - before.value) / before.sd


def paired(before: Sequence[Estimate], after: Sequence[Estimate]) -> list[tuple[Estimate, Estimate | None]]:
    """Estimates before and after of the same parameter, in the order of ``before``."""
    later = {(e.effect, e.parameter): e for e in after}
    return [(e, later.get((e.effect, e.parameter))) for e in before]


#: How the figures came about, a paragraph each; holds for every report.
METHOD = (
    "The declared model was fitted to the part of the recording that is not held out, by generalised "
    "least squares: coefficients and noise (white, flicker, random walk, quantisation) together, the "
    "noise by restricted maximum likelihood in the cosine-transform domain, where it is nearly "
    "uncorrelated. Each effect of the catalogue was then tried on the residual with its own shape "
    "parameters fitted, and its likelihood ratio turned into a p-value that accounts for the shapes "
    "tried and for the number of candidates. The best one was added and everything refitted jointly, "
    "until nothing significant was left or the next effect made the held-out error worse.",
    "Held-out data were never fitted, except that a run held out whole may keep a bias of its own. "
    "Standard deviations are one sigma and include the fitted noise. Spectral densities are two-sided: "
    "white noise of coefficient N has density N² and Allan deviation N/√τ, so that the flat part of the "
    "root spectral density is N itself. The band about an Allan deviation is a 68 % confidence "
    "interval.",
)
