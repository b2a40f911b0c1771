"""Campaigns of the published test of two fibre-optic gyros, simulated and evaluated by the plug-ins.

A campaign: seven power-ups with the ladder within 35 deg/s, seven within the full range, seven with six minutes at
rest. What is a mean over a dwell or over a second is played at 100 Hz or 10 Hz, for it is a sum of the same increments
of angle there; six minutes at rest are played at the instrument's own rate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from tqdm import tqdm

from estimators.at_rest.static_bias import StaticBias
from estimators.rate_table.rate_line import RateLine
from insenv.core.rate_test import LineFit, RateLineResult, StaticResult
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.units import DEG, DEG_PER_HOUR, PPM
from insenv.rig import Readings
from insenv.scenario import Scenario, load
from insenv.scenario import datasheet as told
from insenv.scenario.campaign import campaign

#: Scenarios, and how the paper calls them.
NAMES: Mapping[str, str] = {"b215": "B-215", "kvh13": "KVH-13"}
REPEATS, PREHEAT = 7, 1800.0
#: Rates of the paper, both directions, zero twice [deg/s].
LADDER = (0, 0.5, 0.8, 1, 2, 5, 8, 10, 15, 18, 19, 20, 21, 22, 25, 28, 30, 35)
#: Rates of the test over the full range, both directions [deg/s]: assumed, the paper tells none.
FULL: Mapping[str, Sequence[float]] = {
    "b215": (5, 10, 20, 50, 75, 100, 150, 200, 225, 250, 275, 300),
    "kvh13": (5, 10, 20, 50, 100, 150, 200, 250, 300, 325, 350, 375),
}
#: Time at each of them beside the time to get there, and of the rest before and after [s].
_FULL_DWELL, _REST = 10.0, 60.0
#: Rate at which the local fault lies, and the room that a dwell there may be off [rad/s].
FAULT, _ROOM = 20 * DEG, 0.1 * DEG
#: Time at rest of the paper's bias test, of its long test, and of that what a settled gyro leaves out [s].
SHORT, LONG, WARM_UP = 360.0, 27 * 3600.0, 3 * 3600.0
AVERAGING = (0.01, 1.0, 10.0, 100.0)
LONG_AVERAGING = (0.01, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
#: What the compensation leaves of the open loop's sine.
SINE = "undeclared.sine_response.c"
PROCESSES, _APART = 2, 100_000
_Out = TypeVar("_Out")


@dataclass(frozen=True)
class Line:
    """Scale-factor test of seven power-ups.

    Attributes
    ----------
    nonlinearity : mapping of str to float
        Largest of the seven with all points, by `insenv.core.rate_test.NORMALISATIONS`; ``without``: without the
        points at 20 deg/s, by the largest output; each a ratio.
    flagged : tuple of float
        Rates that the rule flags [rad/s].
    at_ends : bool
        Whether in each of the seven the largest residual is at the largest rate.
    rates, residuals, without_residuals : ndarray
        Shapes (M,), (Q, M), (Q, M') [rad/s]: with all points, and refitted without those at 20 deg/s.
    """

    nonlinearity: Mapping[str, float]
    without: float
    flagged: tuple[float, ...]
    scale_factor: float
    bent: float
    repeatability: float
    asymmetry: float
    at_ends: bool
    rates: Floats
    residuals: Floats
    without_rates: Floats
    without_residuals: Floats
    outputs: Floats


@dataclass(frozen=True)
class Campaign:
    """One instrument's campaign: the ladder, the full range, six minutes at rest and, at 10 Hz, 27 hours."""

    ladder: Line
    full: Line
    short: StaticResult
    long: StaticResult

    @property
    def bias(self) -> float:
        """Mean over the power-ups of the six minutes, with the Earth rate in it [rad/s]."""
        return self.short.bias.value

    def stability(self, averaging: float) -> float:
        """Of the six minutes [rad/s]."""
        return stability(self.short, averaging)


def stability(result: StaticResult, averaging: float, settled: bool = False) -> float:
    """Bias stability at one averaging time [rad/s]; ``settled``: after the warm-up."""
    found = min(result.stability, key=lambda s: abs(s.averaging - averaging))
    return (found.settled if settled else found.value).value


def campaigns(count: int) -> dict[str, list[Campaign]]:
    """Both instruments, each with seeds of its own, so that their noise has nothing in common."""
    jobs = [(name, _APART * k + seed) for seed in range(1, count + 1) for k, name in enumerate(NAMES)]
    played = each(_one, jobs, "campaign")
    return {name: played[k :: len(NAMES)] for k, name in enumerate(NAMES)}


def each(function: Callable[[Any], _Out], jobs: Sequence[Any], unit: str) -> list[_Out]:
    """What a function makes of the jobs, in their order, by several processes."""
    with ProcessPoolExecutor(PROCESSES) as pool:
        return list(tqdm(pool.map(function, jobs), total=len(jobs), unit=unit, leave=False))


def _one(job: tuple[str, int]) -> Campaign:
    name, seed = job
    ladder, full = both_ranges((name, seed, None))
    return Campaign(ladder, full, short_rest(name, seed), long_rest((name, seed, "10 Hz")))


def both_ranges(job: tuple[str, int, str | None]) -> tuple[Line, Line]:
    """Within 35 deg/s and within the full range; ``job``: instrument, seed, what is left of the sine if not as told."""
    name, seed, sine = job
    changes: dict[str, Any] = {"instrument.sampling": "100 Hz"} | ({SINE: sine} if sine else {})
    ladder = ladder_test(load(f"rate_table/{name}", changes), seed)
    return ladder, ladder_test(load(f"rate_table/{name}", changes | full_range(name)), seed)


def full_range(name: str) -> dict[str, Any]:
    """What makes the ladder one over the full range."""
    up = [*FULL[name]]
    seconds = [np.ceil(1.5 + max(360 / rate, _FULL_DWELL)) for rate in up]
    there = [[f"{s:g} s", f"{rate:g} deg/s"] for s, rate in zip(seconds, up, strict=True)]
    back = [[f"{s:g} s", f"{-rate:g} deg/s"] for s, rate in zip(reversed(seconds), reversed(up), strict=True)]
    still = [f"{_REST:g} s", "0 deg/s"]
    return {
        "profile.steps": [still, *there, *back, still],
        "table.max_rate": "400 deg/s",
        "table.max_acceleration": "1000 deg/s^2",
    }


def ladder_test(scenario: Scenario, seed: int) -> Line:
    """The scale-factor test as published: start and end at rest, mean of both taken off."""
    plugin = RateLine(told(scenario), zeros="ends")
    state = plugin.reset()
    for recording in _recordings(scenario, seed):
        state = plugin.update(state, recording)
    result = plugin.result(state)
    assert result is not None
    return _line(result)


def short_rest(name: str, seed: int, repeats: int = REPEATS) -> StaticResult:
    """Six minutes at rest after each power-up, axis up, at the instrument's own rate."""
    scenario = load(f"rate_table/{name}", {"profile.steps": [[f"{SHORT:g} s", "0 deg/s"]]})
    plugin = StaticBias(told(scenario), AVERAGING)
    state = plugin.reset()
    for recording in _recordings(scenario, seed, repeats):
        still = {n: c for n, c in recording.channels.items() if n != "table_angle"}
        state = plugin.update(state, Recording(recording.t, still))
    result = plugin.result(state)
    assert result is not None
    return result


def long_rest(job: tuple[str, int, str | None]) -> StaticResult:
    """27 hours at rest from the power-up on, level and towards east; with a sampling other than the instrument's."""
    name, seed, sampling = job
    scenario = load(f"rate_table/{name}_static", {"instrument.sampling": sampling} if sampling else {})
    plugin = StaticBias(told(scenario), LONG_AVERAGING, WARM_UP)
    state = plugin.reset()
    for readings in scenario.cast(seed, 1).stream(seed, scenario.samples):
        gyro = Channel(np.ravel(readings.outputs["gyro"]), "rad/s", "interval")
        state = plugin.update(state, Recording(readings.t, {"gyro": gyro}))
    result = plugin.result(state)
    assert result is not None
    return result


def envelope(job: tuple[str, int, int]) -> Floats:
    """Of 27 hours at 100 Hz, in so many parts: middle [s], least, mean and largest value [rad/s]; shape (4, parts)."""
    name, seed, parts = job
    scenario = load(f"rate_table/{name}_static", {"instrument.sampling": "100 Hz"})
    size = scenario.samples // parts
    found = []
    for readings in scenario.cast(seed, 1).stream(seed, size * parts, chunk=size):
        y = np.ravel(readings.outputs["gyro"])
        found.append((readings.t.mean(), y.min(), y.mean(), y.max()))
    return np.array(found).T


def raw_rest(name: str, seed: int) -> tuple[Floats, Floats]:
    """Time [s] and output [rad/s] of six minutes at rest at the instrument's own rate, each of shape (n,)."""
    scenario = load(f"rate_table/{name}", {"profile.steps": [[f"{SHORT:g} s", "0 deg/s"]]})
    parts = list(_recordings(scenario, seed, 1))
    y = np.concatenate([p.values("gyro", "rad/s") for p in parts])
    return np.arange(1, len(y) + 1) / scenario.rig.rate, y


def _recordings(scenario: Scenario, seed: int, repeats: int = REPEATS) -> Iterator[Recording]:
    for power_up, readings in campaign(scenario, seed, repeats, PREHEAT):
        yield _recording(power_up, readings)


def _recording(power_up: int, readings: Readings) -> Recording:
    n = len(readings.t)
    channels = {
        "gyro": Channel(np.ravel(readings.outputs["gyro"]), "rad/s", "interval"),
        "table_angle": Channel(np.ravel(readings.references["table_angle"].values), "rad"),
        "power": Channel(np.full(n, float(power_up)), "1"),
    }
    return Recording(readings.t, channels)


def _line(result: RateLineResult) -> Line:
    whole = result.of_each("all points")
    kept = [_refitted(fit) for fit in whole]
    outputs = np.array([(d.rate, d.output - d.zero) for d in result.dwells if d.power_up == 1])
    top = int(np.argmax(np.abs(whole[0].rates)))
    ends = np.abs(whole[0].rates) > 0.99 * np.abs(whole[0].rates[top])
    return Line(
        nonlinearity={key: max(f.nonlinearity[key].value for f in whole) for key in whole[0].nonlinearity},
        without=max(worst for worst, _, _ in kept),
        flagged=tuple(f.rate for f in result.flagged),
        scale_factor=float(np.mean([f.scale_factor.value for f in whole])),
        bent=float(np.mean([f.scale_factor.value - k for f, (_, k, _) in zip(whole, kept, strict=True)])),
        repeatability=result.repeatability["all points"].value,
        asymmetry=float(np.mean([f.asymmetry.value for f in whole])),
        at_ends=all(bool(ends[np.abs(f.residuals).argmax()]) for f in whole),
        rates=whole[0].rates,
        residuals=np.array([f.residuals for f in whole]),
        without_rates=whole[0].rates[_sound(whole[0].rates)],
        without_residuals=np.array([left for _, _, left in kept]),
        outputs=outputs,
    )


def _sound(rates: Floats) -> Any:
    return np.abs(np.abs(rates) - FAULT) > _ROOM


def _refitted(fit: LineFit) -> tuple[float, float, Floats]:
    """Nonlinearity by the largest output, K, and residuals of the line without the points at 20 deg/s."""
    good = _sound(fit.rates)
    x = fit.rates[good]
    y = (fit.residuals + fit.scale_factor.value * fit.rates + fit.offset.value)[good]
    k, f0 = np.polyfit(x, y, 1)
    left: Floats = y - k * x - f0
    return float(np.abs(left).max() / abs(y[np.abs(x).argmax()])), float(k), left


def exact_ladder() -> tuple[float, float, float, float]:
    """The 36 entries without noise.

    Returns
    -------
    tuple of float
        Sum of squared rates [deg^2/s^2]; nonlinearity and bias of K with the fault, and what is left without the points
        at 20 deg/s [ppm].
    """
    x = np.array([*LADDER, *(-rate for rate in LADDER[::-1])], float)
    y = x + 0.033718 * np.sign(x) * np.exp(-((np.abs(x) - 20) ** 2) / (2 * 0.22**2))
    k, f0 = np.polyfit(x, y, 1)
    good = np.abs(np.abs(x) - 20) > 0.1
    left = y[good] - np.polyval(np.polyfit(x[good], y[good], 1), x[good])
    worst = float(np.abs(y - k * x - f0).max() / y.max())
    return float((x**2).sum()), worst / PPM, (float(k) - 1) / PPM, float(np.abs(left).max() / y.max() / PPM)


def per_hour(value: float) -> float:
    """A rate in deg/h."""
    return value / DEG_PER_HOUR
