"""Whether the loop names an error of a fibre-optic gyro that is not declared in a campaign on the rate table.

A campaign is a ladder of rates as the published one, of four power-ups; the last is held out. What was measured is
written with a manifest that declares the rest, read back, and `insenv.close` is asked. Beside the verdict: the error on
the held-out power-up, and that of the scale factor at low rates in the middle of a ladder, before and after.

In the folder scripts: python -m studies.rate_table.undeclared --seeds 3
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

# Each process has a core of its own; threads of theirs would wait for each other.
for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from studies.fog_test.campaigns import PREHEAT, each, full_range, per_hour
from studies.result_page import Section, table

from insenv.close import close
from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Mounting, Recording
from insenv.core.units import DEG, PPM, quantity
from insenv.data.manifest import HeldOut, Model
from insenv.data.save import save
from insenv.effects.catalogue import by_key
from insenv.identify.findings import Added, Findings
from insenv.rig import Readings
from insenv.scenario import Scenario, load
from insenv.scenario.campaign import campaign

#: Power-ups of a campaign, of which the last is held out; rate at which it is played.
REPEATS, SAMPLING = 4, "10 Hz"
#: Rate at which the scale factor is compared [rad/s], and the effects that make it.
LOW = 1 * DEG
_RESPONSE = ("scale_factor", "compensation_ripple", "sine_response")
_DECLARED = ("scale_factor", "scale_factor_temperature")


@dataclass(frozen=True)
class Case:
    """An undeclared error.

    Attributes
    ----------
    words : str
    key : str
        Effect that should be named; empty where there is none.
    undeclared : mapping
        Table of the scenario.
    scenario, preheat, full : str, float, bool
        Of the campaign: name below ``rate_table``, time switched on before it [s], over the full range.
    """

    words: str
    key: str = ""
    undeclared: Mapping[str, Any] = field(default_factory=dict)
    scenario: str = "b215"
    preheat: float = PREHEAT
    full: bool = False


_RIPPLE = {"compensation_ripple": {"c": "0.09 deg/s", "m": "15", "u_m": "375 deg/s"}}
_MAGNETIC = "angle_locked_rate"
CASES: Mapping[str, Case] = {
    "none": Case("nothing"),
    "anomaly": Case(
        "local fault at 20 deg/s",
        "scale_factor_anomaly",
        {"scale_factor_anomaly": {"c": "0.033718 deg/s", "u0": "20 deg/s", "s": "0.22 deg/s"}},
    ),
    "asymmetry": Case(
        "the senses differ by 60 ppm", "scale_factor_asymmetry", {"scale_factor_asymmetry": {"c": "30 ppm"}}
    ),
    "ripple": Case("ripple of the compensation, within 35 deg/s", "compensation_ripple", _RIPPLE, "kvh13"),
    "ripple-full": Case("the same over its range of 375 deg/s", "compensation_ripple", _RIPPLE, "kvh13", full=True),
    "warm-up": Case(
        "bias warms up by 20 deg/h in 2 min, not preheated",
        "bias_warm_up",
        {"bias_warm_up": {"c": "-20 deg/h", "tau": "120 s"}},
        preheat=0.0,
    ),
    "scale-warm-up": Case(
        "scale factor warms up by 0.5 % in 200 s, not preheated",
        "scale_factor_warm_up",
        {"scale_factor_warm_up": {"c": "-0.5 %", "tau": "200 s"}},
        preheat=0.0,
    ),
    "magnetic": Case(
        "magnetic field, 0.5 deg/h once a turn",
        f"{_MAGNETIC}:1",
        {f"{_MAGNETIC}:1": {"c": "0.5 deg/h", "s": "0 deg/h"}},
    ),
    "magnetic-2": Case(
        "the same twice a turn", f"{_MAGNETIC}:2", {f"{_MAGNETIC}:2": {"c": "0.5 deg/h", "s": "0 deg/h"}}
    ),
}


@dataclass(frozen=True)
class Told:
    """What closing the loop made of one campaign.

    ``held_out`` are error before, after, and what the noise alone would leave [rad/s]; ``scale_factor`` the relative
    error of K before and after, not a number where a curve without a name is part of the model; ``reasons`` why the
    verdict is not that all was found.
    """

    verdict: str
    named: tuple[str, ...]
    rivals: tuple[str, ...]
    held_out: tuple[float, float, float]
    averaging: float
    scale_factor: tuple[float, float]
    reasons: tuple[str, ...] = ()


def played(scenario: Scenario, seed: int, preheat: float) -> tuple[Recording, ...]:
    """A recording of each power-up."""
    parts: dict[int, list[Readings]] = {}
    for power_up, readings in campaign(scenario, seed, REPEATS, preheat):
        parts.setdefault(power_up, []).append(readings)
    return tuple(_recording(number, several) for number, several in parts.items())


def _recording(number: int, parts: Sequence[Readings]) -> Recording:
    channels = {
        "gyro": Channel(np.concatenate([np.ravel(p.outputs["gyro"]) for p in parts]), "rad/s", "interval"),
        "table_angle": Channel(_reference(parts, "table_angle"), "rad"),
        "temperature": Channel(_reference(parts, "temperature"), "K"),
    }
    t = np.concatenate([p.t for p in parts])
    return Recording(t, channels, mounting=Mounting(np.pi / 2), label=f"power-up {number}")


def _reference(parts: Sequence[Readings], name: str) -> Floats:
    return np.concatenate([np.ravel(p.references[name].values) for p in parts])


def told(job: tuple[str, int], steps: Sequence[Sequence[str]] = ()) -> Told:
    """Play a campaign, write it with its manifest, close the loop on that.

    ``job``: name of the case, seed; ``steps``: of the profile, if not the scenario's.
    """
    name, seed = job
    case = CASES[name]
    changes: dict[str, Any] = {"instrument.sampling": SAMPLING, "undeclared": dict(case.undeclared)}
    changes |= {"profile.steps": [*steps]} if steps else {}
    scenario = load(f"rate_table/{case.scenario}", changes | (full_range(case.scenario) if case.full else {}))
    recordings = played(scenario, seed, case.preheat)
    reference = quantity(scenario.table.instrument.reference_temperature, "temperature", "reference_temperature")
    declared = scenario.declared_of(("gyro",))
    with TemporaryDirectory() as folder:
        manifest = Path(folder) / "campaign.toml"
        model = Model(("gyro",), declared, reference_temperature=reference)
        save(manifest, recordings, model, held_out=HeldOut(runs=(REPEATS,)))
        found = close(manifest)
    low = _low(recordings[0], reference)
    return _told(found, _true_slope(scenario, seed, low), low)


def _told(found: Findings, truth: float, low: Motion) -> Told:
    target = found.targets[0]
    held = target.held_out
    rivals = tuple(dict.fromkeys(key for added in target.added for key in added.confounded_with))
    before, after = (
        sum(_slope(e.effect, np.array([e.value]), low) for e in estimates if e.effect in _DECLARED)
        for estimates in (target.estimates_before, target.estimates_after)
    )
    after += sum(_slope_of(a, low) for a in target.added)
    return Told(
        found.verdict,
        tuple(map(_key, target.added)),
        rivals,
        (held.before, held.after, held.noise_floor),
        held.averaging,
        (before - truth, after - truth),
        target.reasons,
    )


def _key(added: Added) -> str:
    return added.effect if added.order is None else f"{added.effect}:{added.order}"


def _true_slope(scenario: Scenario, seed: int, low: Motion) -> float:
    """Relative error of K at low rates, mean of the power-ups that are fitted."""
    return float(np.mean([
        sum(_slope(p.effect.key, np.array(p.values), low) for p in scenario.truth(seed, number).planted)
        for number in range(1, REPEATS)
    ]))  # fmt: skip


def _slope_of(added: Added, low: Motion) -> float:
    """What a found effect adds to K at low rates."""
    if added.generic:
        return float("nan")
    values = {p.parameter: p.value for p in added.parameters}
    key = _key(added)
    return _slope(key, np.array([values.get(p.name, 0.0) for p in by_key(key).params]), low)


def _low(recording: Recording, reference: float) -> Motion:
    """A low rate either way in the middle of the ladder, where the high rates are, and at its temperature."""
    middle = 0.5 * float(np.ptp(recording.t)) + np.arange(3.0)
    warmth = np.full(3, recording.channels["temperature"].values[len(recording) // 2])
    return Motion(t=middle, rate=np.array([LOW, -LOW]), temperature=warmth, reference_temperature=reference)


def _slope(key: str, theta: Floats, low: Motion) -> float:
    """Difference of what an effect adds at a low rate either way, over that of the rates."""
    if not key.startswith(_RESPONSE):
        return 0.0
    added = by_key(key).apply(low.rate, low, theta)[0]
    return float((added[0] - added[1]) / (2 * LOW))


def undeclared(seeds: int) -> Section:
    """All cases, with some seeds each."""
    jobs = [(name, seed) for name in CASES for seed in range(1, seeds + 1)]
    found = each(told, jobs, "campaign")
    by_case = {name: found[k * seeds : (k + 1) * seeds] for k, name in enumerate(CASES)}
    head = ("undeclared", "verdict", "named", "rivals", "found", "held out [deg/h]", "error of K [ppm]")
    return Section(
        "One error undeclared",
        (
            f"Campaigns of {REPEATS} power-ups with the published ladder, the last held out, written with a manifest "
            "that declares bias, scale factor and what the temperature does to them; `insenv close-loop` is asked what "
            "is missing. Of each case seed 1; found: in how many seeds the effect is named, itself or among "
            "what is said to be not told from it. Held out: root mean square on the last power-up before, after, and "
            "what noise would leave. K: at low rates, before and after.",
            "",
            *table(head, [_row(CASES[name], several) for name, several in by_case.items()]),
        ),
        _verdict(by_case),
    )


def named(case: Case, one: Told) -> bool:
    """Whether the effect is named, or nothing where there is none."""
    return case.key in (*one.named, *one.rivals) if case.key else not one.named


def _row(case: Case, several: Sequence[Told]) -> tuple[str, ...]:
    one = several[0]
    right = sum(named(case, each_one) for each_one in several)
    held = " / ".join(f"{per_hour(value):.2f}" for value in one.held_out)
    slope = " / ".join("-" if np.isnan(value) else f"{value / PPM:+.1f}" for value in one.scale_factor)
    keys = (", ".join(f"`{key}`" for key in keys) for keys in (one.named, one.rivals))
    return (case.words, one.verdict, *keys, f"{right} of {len(several)}", held, slope)


def _verdict(by_case: Mapping[str, Sequence[Told]]) -> str:
    real = {name: several for name, several in by_case.items() if CASES[name].key}
    alone = sum(one.named == (CASES[name].key,) and not one.rivals for name, v in real.items() for one in v)
    right = sum(named(CASES[name], one) for name, v in real.items() for one in v)
    count = sum(map(len, real.values()))
    worse = sum(one.held_out[1] > one.held_out[0] for v in by_case.values() for one in v)
    false = sum(bool(one.named) for one in by_case["none"])
    return (
        f"In {right} of {count} campaigns the effect is named, in {alone} of them alone and without a rival; the error "
        f"on the held-out power-up grows in {worse}. Where nothing is undeclared something is named in {false} of "
        f"{len(by_case['none'])}. A tenth of its range shows so little of a ripple that it is nearly a cubic. "
        "A field once a turn is what an axis that leans sees of the "
        "Earth rate: no ladder tells them apart."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3, help="campaigns of each case")
    given = parser.parse_args()
    if given.seeds < 1:
        parser.error(f"--seeds {given.seeds} given; wanted one or more")
    section = undeclared(given.seeds)
    print("\n".join((*section.lines, "", section.verdict)))


if __name__ == "__main__":
    main()
