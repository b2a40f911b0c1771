"""Which procedure would tell confounded effects apart."""

from __future__ import annotations

from insenv.identify.findings import Added, NextExperiment
from insenv.identify.problem import Problem

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


def propose(problem: Problem, added: tuple[Added, ...]) -> tuple[NextExperiment, ...]:
    """One procedure for every confounded set."""
    return tuple(
        NextExperiment((_key(one), *one.confounded_with), _procedure(_key(one), one.confounded_with), None)
        for one in added
        if one.confounded_with
    )


def _key(one: Added) -> str:
    return one.effect if one.order is None else f"{one.effect}:{one.order}"


def _procedure(key: str, rivals: tuple[str, ...]) -> str:
    traits = {_TRAITS.get(k.partition(":")[0], "other") for k in (key, *rivals)}
    if "encoder" in traits:
        return _REVERSE
    if {"angle", "earth"} & traits and "force" in traits:
        return _TILT
    if {"angle", "earth"} & traits:
        return _INDEX
    if "rate" in traits:
        return _STAIRCASE
    if {"temperature", "temperature_history"} <= traits or traits == {"temperature_history"}:
        return _THERMAL
    if "time" in traits and {"temperature", "temperature_history"} & traits:
        return _SOAK
    return _LONGER
