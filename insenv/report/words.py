"""Names of verdicts and of effects, and what they mean, for the text and the HTML report alike."""

from __future__ import annotations

from collections.abc import Iterable

from insenv.effects.catalogue import described
from insenv.identify.findings import Added

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
    title = described(effect)[0] or effect
    return f"{title} (order {order})" if order else title


def names(keys: Iterable[str]) -> list[str]:
    """Names of several effects in running text, orders of one together: "bias over temperature (orders 1, 2)"."""
    orders: dict[str, list[str]] = {}
    for key in keys:
        effect, _, order = key.partition(":")
        orders.setdefault(effect, []).extend([order] if order else [])
    return [
        name(f"{effect}:{found[0]}" if found else effect)
        if len(found) < 2
        else f"{name(effect)} (orders {', '.join(sorted(found))})"
        for effect, found in orders.items()
    ]


def meaning(key: str) -> str:
    """What the effect is physically, in one line; empty for an unknown id."""
    return described(key.partition(":")[0])[1]


def key_of(added: Added) -> str:
    """Identifier with the order: "encoder_harmonic:1"."""
    return added.effect if added.order is None else f"{added.effect}:{added.order}"


def noise_name(effect: str, unit: str) -> str:
    """Name of a noise in running text; ``unit`` of its target tells a gyro from an accelerometer."""
    return unit == "m/s^2" and described(effect)[2] or name(effect)


def listing(items: Iterable[str], last: str = "and") -> str:
    """Join items as in a sentence: "a", "a and b", "a, b and c"; "a, and b and c" if one has an "and"."""
    words = list(items)
    comma = "," if any(f" {inner} " in word for word in words for inner in ("and", "or")) else ""
    return f"{comma} {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


#: How the figures of a recording in several positions came about, a paragraph each.
METHOD_OF_POSITIONS = (
    "Rests were found where all channels of the triads scatter little more than in their quietest windows, or "
    "taken from the labels of the recording. Accelerometers: at rest the magnitude of specific force is that of "
    "gravity, in whatever attitude; attitudes are not needed and not fitted. Gyros: the rotation integrated from "
    "one rest to the next, less the bias that the gyros show in either, must carry the direction of gravity from "
    "the one to the other; g-sensitivity is told by the means of the gyros at rest.",
    "The declared model was fitted to the rests that are not held out, by least squares; each further effect was "
    "added to it and the change of the residual judged by Fisher's F. The noise is the scatter from rest to rest "
    "that the fit itself leaves, with its freedom, not the white noise of the samples. The held-out rests tell by "
    "themselves whether their residual moves as the fitted effect foretells; both are joined as a normal deviate, "
    "and the probability is multiplied by the number of effects that were tried.",
    "An effect was refused where the error on held-out rests got worse; several effects at once were tried where "
    "none alone was accepted. An added effect is ambiguous where, with another in its place, it is no longer "
    "significant. Nothing was fitted to held-out rests. Standard deviations are one sigma, of all parameters "
    "together, widened by the variance of Student's t.",
)

#: How the figures came about, a paragraph each; holds for every report.
METHOD = (
    "The samples were averaged in bins, and the effects with them, so that the model of the bins is that of "
    "the samples. The declared model was fitted to the part of the recording that is not held out: "
    "coefficients by generalised least squares; noise (white, flicker, random walk, quantisation) by "
    "restricted maximum likelihood in the domain of the discrete cosine transform, where it is all but "
    "uncorrelated. Lines above the rate of the bins were looked for in the samples, with a false alarm in "
    "0.01 % of recordings: steady ones were subtracted, wandering ones rejected by weighting each bin with a "
    "Hann window. The error after is then that of these bins, the error before that of plain means.",
    "Each effect of the catalogue was then added to the model, its own shape parameters fitted and the noise "
    "fitted anew. The likelihood ratio became a probability by Fisher's F, with as many degrees of freedom "
    "as the noise is known with where the effect lives, times the number of independent looks (shapes and "
    "effects tried), which was counted on simulated noise of this recording. The held-out data tell by "
    "themselves whether their residual moves as the fitted effect foretells; their evidence is joined as a "
    "normal deviate. A coefficient beyond what is credible takes an effect out.",
    "Of the significant effects the one with the largest likelihood ratio, less what its freedom gains by "
    "chance, was added and everything refitted jointly, until nothing significant was left. An effect was "
    "refused where its error on held-out data got worse (plain by more than 1 % and also weighted by the "
    "noise, or plain by more than 2 %), and dropped again where later ones made it superfluous. Smooth "
    "curves without a cause were tried "
    "last. Effects cannot be told apart where, with one in the other's place, the other is no longer "
    "significant. At the end the residual was tested against the fitted noise and, where a maker's figures "
    "are declared, against these with a tolerance of 15 %. Where the horizontal Earth rate was fitted, its "
    "magnitude was compared with that of latitude and tilt, taken as known to 0.01 and 0.02 degrees.",
    "Nothing was fitted to held-out data, except that a run held out whole may keep a bias of its own. "
    "Standard deviations are one sigma, of all parameters and shapes together, and include the fitted noise. "
    "Spectral densities are two-sided: "
    "white noise of coefficient N has density N² and Allan deviation N/√τ, so that the flat part of the "
    "root spectral density is N itself. The band about an Allan deviation is a 68 % confidence "
    "interval.",
)
