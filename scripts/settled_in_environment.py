"""How often the experiments that the loop proposes settle what its first run leaves confounded, and what it is worth.

python scripts/settled_in_environment.py --seeds 20 --cases encoder angle
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import beta

from insenv.core.errors import InputError
from insenv.core.units import ARCSEC
from insenv.identify.findings import TargetFindings
from insenv.identify.story import Story
from insenv.settle import settle


@dataclass(frozen=True)
class Case:
    """A scenario with one undeclared effect, and the set that its first run leaves (nothing: settled at once)."""

    scenario: str
    effect: str
    target: str
    undeclared: Mapping[str, Any] | None = None
    confounded: tuple[str, ...] = ()
    changes: Mapping[str, Any] | None = None


#: Where the eccentricity stands at 45 deg to the Earth rate.
_THERE: Mapping[str, Any] = {"table.azimuth": "65 deg"}
#: A table that leans, with an accelerometer. Elsewhere a lean mixes in the vertical Earth rate, which to a gyro with
#: sensitivity to g is more of the same: w sin(latitude) cos(tilt) / g.
_LEANING: Mapping[str, Any] = {
    **_THERE,
    "site.latitude": "0 deg",
    "table.level_error": ["-0.8 deg", "0.5 deg"],
    "instrument.accel": {"noise": {"velocity_random_walk": "20 ug/sqrt(Hz)"}},
    "declared.bias": [{"targets": "gyro", "c": "+- 0.005 deg/h"}, {"targets": "accel_x", "c": "+- 50 ug"}],
}
CASES: Mapping[str, Case] = {
    "encoder": Case(
        "north_finder/undeclared",
        "encoder_harmonic:1",
        "gyro",
        confounded=("encoder_harmonic:1", "angle_locked_rate:1"),
        changes=_THERE,
    ),
    "angle": Case(
        "north_finder/undeclared",
        "angle_locked_rate:1",
        "gyro",
        {"angle_locked_rate:1": {"c": "0.1 deg/h", "s": "0.05 deg/h"}},
        ("encoder_harmonic:1", "angle_locked_rate:1"),
        _THERE,
    ),
    "gravity": Case(
        "north_finder/undeclared",
        "g_sensitivity",
        "gyro",
        {"g_sensitivity": {"targets": "gyro", "c_x": "10 deg/h/g", "c_y": "0 deg/h/g", "c_z": "0 deg/h/g"}},
        ("encoder_harmonic:1", "angle_locked_rate:1", "g_sensitivity"),
        _LEANING,
    ),
    "gyro": Case("two_position/undeclared", "bias_warm_up", "gyro_x"),
    "accelerometer": Case(
        "two_position/undeclared",
        "bias_warm_up",
        "accel_y",
        {"bias_warm_up": {"targets": "accel_y", "c": "20 ug", "tau": "200 s"}},
    ),
    "turn": Case(
        "two_position/undeclared",
        "scale_factor",
        "gyro_z",
        {"scale_factor": {"targets": "gyro_z", "c": "100 ppm"}},
        ("scale_factor", "scale_factor_asymmetry"),
    ),
    "asymmetry": Case("rate_table/undeclared", "scale_factor_asymmetry", "gyro"),
}
#: What a quantity is told in, and how much of it that is.
UNITS = {"rad": ("arcsec", ARCSEC), "1": ("ppm", 1e-6)}


@dataclass(frozen=True)
class Told:
    """One story in figures: whether the first run left the whole set, whether it was settled with the right name."""

    seed: int
    runs: int
    whole_set: bool
    settled: bool
    named: bool
    raw: float
    errors: tuple[float, ...]
    sd: float
    time: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    given = parser.parse_args()
    try:
        for name in given.cases:
            for line in _study(name, range(given.first, given.first + given.seeds)):
                print(line, flush=True)
    except InputError as error:
        sys.exit(f"settled_in_environment: {error}")


def _study(name: str, seeds: Sequence[int]) -> Iterator[str]:
    case, told = CASES[name], []
    for seed in seeds:
        changes = dict(case.changes or {})
        if case.undeclared is not None:
            changes["undeclared"] = dict(case.undeclared)
        story = settle(case.scenario, seed=seed, changes=changes)
        told.append(_told(case, story, seed))
        yield f"{name} {told[-1]}"
    unit, _ = UNITS[story.wanted.unit if story.wanted else "1"]
    raw, last = (np.sqrt(np.mean(np.square(x))) for x in ([t.raw for t in told], [t.errors[-1] for t in told]))
    yield (
        f"{name}: first run leaves the whole set {_share([t.whole_set for t in told])}, settled "
        f"{_share([t.settled for t in told])}, settled and named {_share([t.named for t in told])}, "
        f"{np.mean([t.runs for t in told]):.2g} runs on average; error {raw:.4g} -> {last:.4g} {unit} "
        f"(root mean square; the estimator tells {np.mean([t.sd for t in told]):.3g})"
    )


def _told(case: Case, story: Story, seed: int) -> Told:
    first, last = (_target(c.found.targets, case.target) for c in (story.chapters[0], story.chapters[-1]))
    _, unit = UNITS[story.wanted.unit if story.wanted else "1"]
    sets = [{_key(a.effect, a.order), *a.confounded_with} for a in first.added]
    named = {_key(a.effect, a.order) for a in last.added}
    settled = story.ending == "settled"
    assert story.raw is not None
    return Told(
        seed,
        len(story.chapters),
        not case.confounded or any(set(case.confounded) <= keys for keys in sets),
        settled,
        settled and named == {case.effect},
        round(story.raw.error / unit, 2),
        tuple(round(c.answer.error / unit, 2) for c in story.chapters if c.answer is not None),
        round(story.raw.sd / unit, 2),
        story.chapters[-1].elapsed,
    )


def _target(targets: Sequence[TargetFindings], name: str) -> TargetFindings:
    return next(t for t in targets if t.target == name)


def _key(effect: str, order: int | None) -> str:
    return effect if order is None else f"{effect}:{order}"


def _share(hits: Sequence[bool]) -> str:
    """Count with the exact 95 % interval (Clopper and Pearson)."""
    n, k = len(hits), sum(hits)
    low = beta.ppf(0.025, k, n - k + 1) if k else 0.0
    high = beta.ppf(0.975, k + 1, n - k) if k < n else 1.0
    return f"{k}/{n} [{100 * low:.0f}, {100 * high:.0f} %]"


if __name__ == "__main__":
    main()
