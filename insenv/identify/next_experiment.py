"""Which procedure would tell confounded effects apart."""

from __future__ import annotations

from insenv.identify.findings import Added, NextExperiment

#: What separates a pair, by what the two effects depend on.
_REVERSE = "turn the table both ways: half of the time at the same rate in the other direction"
_STAIRCASE = "a staircase of rates: the present rate, half of it and twice it, both ways"
_THERMAL = "a thermal cycle: soak, ramp up, soak, ramp down, so that temperature and its history come apart"
_SOAK = "a soak at constant temperature after power-up: what goes on changing follows time, not temperature"
_LONGER = "a longer recording at rest, several times the time constant in question"
_TILT = "tilt the axis by a few degrees and level it again, at the same rate"
_INDEX = "turn the base by 180 degrees and repeat: what follows the Earth stays, what follows the table turns"

_TRAITS = {
    "encoder_harmonic": "encoder",
    "angle_locked_rate": "angle",
    "earth_rate": "earth",
    "g_sensitivity": "force",
    "bias_temperature": "temperature",
    "bias_temperature_rate": "temperature_history",
    "bias_thermal_lag": "temperature_history",
    "bias": "bias",
    "bias_drift": "time",
    "bias_warm_up": "time",
    "bias_step": "time",
    "scale_factor": "rate",
    "scale_factor_asymmetry": "rate",
    "scale_factor_cubic": "rate",
    "scale_factor_anomaly": "rate",
    "lock_in": "rate",
    "timing_skew": "rate",
    "sample_hold": "rate",
}

#: Which declared effects can hide an effect on a recording that cannot tell them apart.
_HIDDEN_BY = {"encoder": ("earth", "angle"), "angle": ("earth",), "rate": ("rate", "bias")}


def propose(
    added: tuple[Added, ...], declared: tuple[str, ...], collinear: tuple[str, ...]
) -> tuple[NextExperiment, ...]:
    """One procedure for every confounded set.

    Parameters
    ----------
    added : tuple of Added
    declared : tuple of str
        Keys of the declared effects.
    collinear : tuple of str
        Keys of effects that this recording cannot tell from the declared ones: what one of them does is now in the
        declared parameters, and no residual shows it.
    """
    sets = [(_key(one), *one.confounded_with) for one in added if one.confounded_with]
    hidden = [key for key in collinear if _trait(key) in _HIDDEN_BY and key not in {k for s in sets for k in s}]
    for trait in dict.fromkeys(_trait(key) for key in hidden):
        hiding = [key for key in declared if _trait(key) in _HIDDEN_BY[trait]]
        if hiding:
            sets.append((*hiding, *(key for key in hidden if _trait(key) == trait)))
    return tuple(NextExperiment(keys, _procedure(keys), None) for keys in sets)


def _trait(key: str) -> str:
    return _TRAITS.get(key.partition(":")[0], "other")


def _key(one: Added) -> str:
    return one.effect if one.order is None else f"{one.effect}:{one.order}"


#: Procedures in order of preference: what the confounded effects must have among their traits, any of each group.
_PROCEDURES: tuple[tuple[tuple[set[str], ...], str], ...] = (
    (({"encoder"},), _REVERSE),
    (({"angle", "earth"}, {"force"}), _TILT),
    (({"angle", "earth"},), _INDEX),
    (({"rate"},), _STAIRCASE),
    (({"time"}, {"temperature", "temperature_history"}), _SOAK),
    (({"temperature", "temperature_history"},), _THERMAL),
)


def _procedure(keys: tuple[str, ...]) -> str:
    traits = {_trait(key) for key in keys}
    for groups, procedure in _PROCEDURES:
        if all(group & traits for group in groups):
            return procedure
    return _LONGER
