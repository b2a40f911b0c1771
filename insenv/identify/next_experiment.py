"""Which procedure would tell confounded effects apart, and what a table would have to run for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats, Recording
from insenv.identify.findings import Added, NextExperiment

#: What separates a pair, by what the two effects depend on.
_REVERSE = "turn the table both ways: half of the time at the same rate in the other direction"
_STAIRCASE = "a staircase of rates: the present rate, half of it and twice it, both ways"
_THERMAL = "a thermal cycle: soak, ramp up, soak, ramp down, so that temperature and its history come apart"
_SOAK = "a soak at constant temperature after power-up: what goes on changing follows time, not temperature"
_LONGER = "a longer recording at rest, several times the time constant in question"
_TILT = "tilt the axis by a few degrees and level it again, at the same rate"
#: The same for a vehicle, or another triad, that rests and turns.
_BACK = "turn back by the same angle and rest again"
_RESTS = "longer rests, several times the time constant in question: a warm-up ends, a drift goes on, noise wanders"
_PARK = "park at another heading and repeat: what follows the Earth stays, what follows the turn angle turns"
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


#: A table that moved by less in all is at rest [rad].
LEAST_TURN = 0.1


@dataclass(frozen=True)
class Turning:
    """What the table did: its usual rate while it moved [rad/s] and the time of all runs together [s].

    ``rests`` has the angles [rad] and the times [s] of the rests of a triad that rests and turns, else nothing.
    """

    rate: float
    duration: float
    rests: tuple[tuple[float, float], ...] = ()

    @classmethod
    def of(cls, recordings: tuple[Recording, ...]) -> Turning | None:
        """From the commanded rate, else from the angle; None where no table turned."""
        rates = [np.abs(_table_rates(r)) for r in recordings]
        moving = np.concatenate([r[r > 0.5 * r.max(initial=0.0)] for r in rates])
        duration = float(sum(len(r) * r.dt for r in recordings))
        rate = float(np.median(moving)) if len(moving) else 0.0
        rests = _rests(recordings[0]) if recordings[0].mounting.table_axis else ()
        return cls(rate, duration, rests) if rate * duration > LEAST_TURN else None


def _table_rates(recording: Recording) -> Floats:
    """The commanded rate, else slopes of the angle over stretches long enough not to show the encoder's noise."""
    if "table_rate" in recording.channels:
        return recording.channels["table_rate"].values
    if "table_angle" in recording.channels:
        rows = slice(None, None, max(1, len(recording) // 1000))
        return np.diff(recording.channels["table_angle"].values[rows]) / np.diff(recording.t[rows])
    return np.zeros(0)


def _rests(recording: Recording) -> tuple[tuple[float, float], ...]:
    """Angle [rad] and duration [s] of each stretch in which the table stands still."""
    if "table_angle" not in recording.channels:
        return ()
    angle = recording.channels["table_angle"].values
    still = np.abs(np.diff(angle)) < 1e-9
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    spans = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return tuple((float(angle[a]), (b - a) * recording.dt) for a, b in spans if (b - a) * recording.dt > 1.0)


def propose(
    added: tuple[Added, ...],
    declared: tuple[str, ...],
    collinear: tuple[str, ...],
    turning: Turning | None = None,
    separation: Mapping[str, float] | None = None,
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
    turning : Turning, optional
        What the table did, from which it would have to do something else.
    separation : mapping of str to float, optional
        Key of an added effect to the separation that its procedure promises [standard deviations], where known.
    """
    sets = [(_key(one), *one.confounded_with) for one in added if one.confounded_with]
    # Turning the table the other way leaves the Earth and what is locked to the angle together.
    known = {key for keys in sets for key in keys if not (_trait(key) == "angle" and _procedure(keys) == _REVERSE)}
    hidden = [key for key in collinear if _trait(key) in _HIDDEN_BY and key not in known]
    for trait in dict.fromkeys(_trait(key) for key in hidden):
        hiding = [key for key in declared if _trait(key) in _HIDDEN_BY[trait]]
        if hiding:
            sets.append((*hiding, *(key for key in hidden if _trait(key) == trait)))
    expected = separation or {}
    return tuple(_experiment(keys, expected.get(keys[0]), turning) for keys in sets)


def _experiment(keys: tuple[str, ...], sigma: float | None, turning: Turning | None) -> NextExperiment:
    procedure = _procedure(keys)
    if turning is not None and len(turning.rests) > 1:
        return _at_rest(keys, procedure, sigma, turning.rests)
    if turning is None or procedure not in (_REVERSE, _STAIRCASE):
        return NextExperiment(keys, procedure, sigma)
    rate = np.rad2deg(turning.rate)
    if procedure == _REVERSE:
        dwell = f"{turning.duration / 2:.4g} s"
        profile = {"kind": "reversal", "rate": f"{rate:.4g} deg/s", "dwell": dwell}
        return NextExperiment(keys, f"{procedure} ({dwell} at +{rate:.4g} deg/s, {dwell} back)", sigma, profile)
    rates = [f"{sign * share * rate:.4g} deg/s" for sign in (1, -1) for share in (1, 0.5, 2)]
    dwell = f"{turning.duration / len(rates):.4g} s"
    return NextExperiment(keys, procedure, sigma, {"kind": "staircase", "rates": rates, "dwell": dwell})


def _at_rest(
    keys: tuple[str, ...], procedure: str, sigma: float | None, rests: tuple[tuple[float, float], ...]
) -> NextExperiment:
    """The procedure in terms of rests and turns."""
    if procedure in (_REVERSE, _STAIRCASE):
        turn, rest = np.rad2deg(rests[1][0] - rests[0][0]), rests[0][1]
        dwell = f"{rest:.0f} s"
        turns = [[dwell, f"{sign * turn:.4g} deg"] for sign in (1, -1)]
        angles = f"0, {turn:.4g}, 0 deg, {dwell} each"
        return NextExperiment(keys, f"{_BACK} ({angles})", sigma, {"kind": "turns", "turns": turns})
    return NextExperiment(keys, {_LONGER: _RESTS, _INDEX: _PARK}.get(procedure, procedure), sigma)


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
