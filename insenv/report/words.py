"""Names of effects and verdicts and what they mean, for the text and the HTML report alike."""

from __future__ import annotations

from collections.abc import Iterable

from insenv.identify.findings import Added

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
    "lock_in_wander": ("wander of the lock-in", "the lock-in threshold wanders at random"),
    "rate_lock": (
        "lock to a rate",
        "cross-coupling pulls a closed loop to one rate, and near it the output stands still",
    ),
    "sine_response": ("sine response", "an open loop puts out the sine of the phase, not the phase"),
    "compensation_ripple": (
        "ripple of the compensation",
        "what a compensation leaves of a curved response swings over the range of rates",
    ),
    "encoder_harmonic": (
        "encoder harmonic",
        "the reference is wrong: the table's encoder repeats an angle error every turn",
    ),
    "angle_locked_rate": (
        "rate locked to the table angle",
        "the gyro's error depends on where it points on its base: a magnet, heat or tilt",
    ),
    "magnetic_field": (
        "magnetic field of the place",
        "the field of the place makes a rate that stands with the Earth, as the Earth's own rate does",
    ),
    "wobble": ("wobble of the table's axis", "the axis of the table tilts as it turns, and the gyro with it"),
    "earth_rate": ("Earth rate", "the Earth's rotation as the input axis sees it"),
    "timing_skew": ("timing skew", "gyro and reference are not sampled at the same time"),
    "sample_hold": ("sample and hold", "the output repeats its last value for a while"),
    "saturation": ("saturation", "beyond a largest or smallest value nothing more is read"),
    "g_sensitivity": ("g-sensitivity", "the bias follows the specific force along an axis"),
    "cross_axis": ("cross-axis coupling", "the input axis sees a part of the rate about another axis"),
    "tone": ("tone", "a line at one frequency: dither, vibration, mains or a servo"),
    "base_tilt": (
        "base tilt",
        "the base turns, as the gyros show, and gravity leaks into the level accelerometers",
    ),
    "base_settling": ("settling of the base", "the base under the unit tilts to its place after it was set down"),
    "encoder_backlash": (
        "backlash of the encoder",
        "the reference is wrong: play in the encoder's coupling, taken up after each reversal",
    ),
    "scale_factor_hysteresis": (
        "hysteresis of the scale factor",
        "the output depends on whether a rate was reached from below or from above",
    ),
    "dead_band": ("dead band", "below a threshold nothing is read"),
    "output_bandwidth": (
        "bandwidth of the output",
        "the output comes through a low-pass: fast motion is late and too small",
    ),
    "self_heating": ("self-heating", "the bias follows the heat that driving left, later than the rate"),
    "settling_after_turn": (
        "settling after turns",
        "after each turn of the table something comes to rest exponentially: base, support or fluid",
    ),
    "centripetal_acceleration": (
        "centripetal acceleration",
        "off the table's axis the bias follows the square of the rate (order 2: its fourth power), through a "
        "sensitivity to acceleration; a response that is bent evenly looks the same",
    ),
    "lever_arm": ("lever arm", "off the axis of the table the accelerometer feels the turn itself"),
    "vibration_rectification": ("vibration rectification", "the bias follows the mean square of the vibration"),
    "non_orthogonality": ("non-orthogonality", "the axes of the triad are not at right angles"),
    "misalignment": ("misalignment", "the triad as a whole is turned against the one that shows the attitude"),
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
