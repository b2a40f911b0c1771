"""Recordings with causes that are in no catalogue, pairs of them with ordinary ones, controls and nulls.

    python generate.py FOLDER

writes a folder for each case (CSV and manifest) and `truth.json` with what is true of all. Nothing of insenv is
imported.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from causes import (
    Cause,
    backlash,
    backlash_soft,
    bandwidth,
    bandwidth_second,
    centripetal,
    dead_band,
    dead_band_soft,
    dead_zone,
    hysteresis_loop,
    hysteresis_stop,
    hysteresis_wen,
    ordinary,
    self_heating,
    self_heating_two,
    settling,
    settling_after_moves,
    wobble,
)
from files import written, written_unit
from procedures import Test, positions, rest, table
from units import (
    ACCELS,
    GYROS,
    Unit,
    accelerometer,
    at_rest,
    attitudes,
    rest_strength,
    strength,
    turned,
    vibrating,
)
from world import DEG, GRAVITY, Grade, Rng

STRENGTHS = (8.0, 15.0, 30.0)
#: Causes that need an angle, by how their labels begin.
OF_THE_ANGLE = ("wobble", "backlash", "bandwidth")


@dataclass(frozen=True)
class Truth:
    """What is true of a case.

    Attributes
    ----------
    name : str
        Of the folder.
    family : str
        "unknown", "pair", "control" or "null".
    causes : tuple of tuple of str
        For each cause the names that do it justice; none of a null.
    cause : str
        That the page counts it under.
    strength : float
    targets : dict
        For each target the causes (by number) that show on it; a target that is neither here nor in `faint` has none.
    faint : dict
        For each target the causes (by number) that act on it, and less than anybody must see: no fault if named.
    beside : tuple of str
        Names that are no fault beside the right ones.
    alike : tuple of str
        Names whose best curve leaves less than `ALIKE` of the strength: nobody could tell.
    """

    name: str
    family: str
    cause: str
    strength: float
    causes: tuple[tuple[str, ...], ...]
    targets: Mapping[str, tuple[int, ...]]
    beside: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()
    faint: Mapping[str, tuple[int, ...]] = field(default_factory=dict)


def _rng(name: str, seed: int) -> Rng:
    digest = hashlib.sha256(f"{name}/{seed}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))


# Cases.


@dataclass(frozen=True)
class Plan:
    """A case before it is made: ``make`` writes its files and returns its truth."""

    name: str
    make: Callable[[Path, Rng], Truth]


def _on_table(
    name: str,
    family: str,
    setup: Callable[[Rng], Test],
    causes: Callable[[Test, Rng], tuple[Cause, ...]],
    wanted: float,
) -> Plan:
    def make(folder: Path, rng: Rng) -> Truth:
        test = setup(rng)
        chosen = causes(test, rng)
        sized = [(cause, test.sized(cause, wanted)) for cause in chosen]
        written(folder, test, sized, rng)
        beside = tuple(n for cause in chosen for n in cause.harmless)
        label = chosen[0].name if chosen else "null"
        accepted = tuple(c.accepted for c in chosen)
        told = [c for c in chosen if c.name not in ("wobble", "base_settling") and family == "unknown"]
        alike = tuple(n for c in told for n in test.alike(c, dict(zip(chosen, (s for _, s in sized), strict=True))[c]))
        strong = min((test.strength(c, x) for c, x in sized), default=0.0)
        return Truth(name, family, label, strong, accepted, {"gyro": tuple(range(len(chosen)))}, beside, alike)

    return Plan(name, make)


def _tops(test: Test) -> float:
    return max(float(np.abs(run.fine).max()) for run in test.runs)


#: Cause, grades and programmes; at 15 once for each programme, at 8 and 30 for the first.
_TABLE: dict[str, tuple[tuple[str, ...], tuple[str, ...], float, Callable[[Test, Rng], tuple[Cause, ...]]]] = {
    "backlash": (("fibre", "laser"), ("reversal", "ladder"), 90.0, lambda t, r: (backlash(),)),
    "hysteresis-stop": (("fibre", "laser"), ("loop", "ladder"), 90.0, lambda t, r: (hysteresis_stop(_tops(t)),)),
    "hysteresis-loop": (("mems", "fibre"), ("loop", "swing"), 90.0, lambda t, r: (hysteresis_loop(_tops(t)),)),
    "dead-band": (("mems", "fibre"), ("fine", "fine"), 90.0, lambda t, r: (dead_band(),)),
    "dead-zone": (("mems", "fibre"), ("fine", "ladder"), 90.0, lambda t, r: (dead_zone(),)),
    "bandwidth": (("mems", "fibre"), ("swing", "reversal"), 90.0, lambda t, r: (bandwidth(),)),
    "wobble-1": (("laser", "fibre"), ("ladder", "reversal"), 30.0, lambda t, r: (
        wobble(2, True, 30 * DEG, float(r.uniform(0, 6))),)),
    "wobble-2": (("laser", "fibre"), ("ladder", "loop"), 30.0, lambda t, r: (
        wobble(1, False, 30 * DEG, float(r.uniform(0, 6))),)),
    "self-heating": (("fibre", "mems"), ("stops", "loop"), 90.0, lambda t, r: (
        self_heating(float(r.uniform(60, 200)), 2.0),)),
    "self-heating-friction": (("laser", "fibre"), ("stops", "stops"), 90.0, lambda t, r: (
        self_heating(float(r.uniform(60, 200)), 1.0),)),
    "centripetal": (("mems", "fibre"), ("ladder", "loop"), 90.0, lambda t, r: (centripetal(2),)),
    "centripetal-squared": (("mems", "laser"), ("ladder", "swing"), 90.0, lambda t, r: (centripetal(4),)),
    "backlash-soft": (("fibre", "laser"), ("reversal", "ladder"), 90.0, lambda t, r: (backlash_soft(),)),
    "hysteresis-wen": (("fibre", "mems"), ("loop", "ladder"), 90.0, lambda t, r: (hysteresis_wen(_tops(t)),)),
    "dead-band-soft": (("mems", "fibre"), ("fine", "fine"), 90.0, lambda t, r: (dead_band_soft(),)),
    "bandwidth-second": (("mems", "fibre"), ("swing", "swing"), 90.0, lambda t, r: (bandwidth_second(),)),
    "self-heating-two": (("fibre", "mems"), ("stops", "stops"), 90.0, lambda t, r: (
        self_heating_two(float(r.uniform(20, 50)), float(r.uniform(150, 300))),)),
}  # fmt: skip


def _table_plans() -> list[Plan]:
    plans = []
    for label, (grades, kinds, _, causes) in _TABLE.items():
        other = label.endswith(("-soft", "-wen", "-second", "-two"))
        for wanted in STRENGTHS[1:] if other else STRENGTHS:
            for which in (0, 1) if wanted == 15.0 else (0,):

                def setup(rng: Rng, g: str = grades[which], k: str = kinds[which], n: str = label) -> Test:
                    runs = 2 if k in ("ladder", "reversal") and rng.uniform() < 0.3 else 1
                    test = table(
                        k, g, rng, runs=runs, tilt=_TABLE[n][2] * DEG, climate=str(rng.choice(["room", "warm-up"]))
                    )
                    return replace(test, angle=True) if n.startswith(OF_THE_ANGLE) else test

                name = f"{label}-{wanted:g}-{which}"
                plans.append(_on_table(name, "unknown", setup, causes, wanted))
    for wanted in STRENGTHS:
        plans.append(_on_table(f"settling-after-moves-{wanted:g}", "unknown", lambda r: positions("fibre", r),
                               lambda t, r: (settling_after_moves(float(r.uniform(8, 25))),), wanted))  # fmt: skip
        plans.append(_on_table(f"settling-static-{wanted:g}", "unknown", lambda r: rest("fibre", r),
                               lambda t, r: (settling(float(r.uniform(200, 500))),), wanted))  # fmt: skip
    return plans


_ORDINARY = {
    "scale_factor_asymmetry": "ladder",
    "scale_factor_cubic": "ladder",
    "scale_factor_temperature": "ladder",
    "encoder_harmonic": "reversal",
    "bias_temperature": "stops",
    "bias_drift": "reversal",
    "timing_skew": "swing",
    "tone": "reversal",
    "bias_step": "loop",
    "scale_factor_drift": "ladder",
}


def _control_plans() -> list[Plan]:
    plans = []
    for label, kind in _ORDINARY.items():
        for wanted in (15.0, 30.0):

            def setup(rng: Rng, k: str = kind, n: str = label) -> Test:
                climate = "chamber" if "temperature" in n else "warm-up"
                test = table(k, str(rng.choice(["laser", "fibre", "mems"])), rng, climate=climate)
                return replace(test, angle=True) if n == "encoder_harmonic" else test

            def causes(test: Test, rng: Rng, n: str = label) -> tuple[Cause, ...]:
                return (ordinary(n, test.runs[0], rng),)

            plans.append(_on_table(f"control-{label}-{wanted:g}", "control", setup, causes, wanted))
    for label in ("bias_drift", "bias_warm_up", "bias_temperature"):

        def still(rng: Rng, n: str = label) -> Test:
            return rest("fibre", rng, climate="chamber" if n == "bias_temperature" else "room", hours=1.5)

        def one(test: Test, rng: Rng, n: str = label) -> tuple[Cause, ...]:
            return (ordinary(n, test.runs[0], rng),)

        plans.append(_on_table(f"control-static-{label}-20", "control", still, one, 20.0))
    return plans


_PAIRS = (
    ("backlash", "scale_factor_asymmetry"),
    ("hysteresis-stop", "bias_temperature"),
    ("hysteresis-loop", "bias_drift"),
    ("dead-zone", "bias_temperature"),
    ("bandwidth", "scale_factor_asymmetry"),
    ("self-heating", "scale_factor_cubic"),
    ("self-heating-friction", "bias_temperature"),
    ("centripetal", "scale_factor_cubic"),
    ("centripetal-squared", "bias_drift"),
    ("wobble-1", "scale_factor_asymmetry"),
    ("dead-band", "bias_drift"),
    ("backlash", "encoder_harmonic"),
)


def _pair_plans() -> list[Plan]:
    plans = []
    for label, other in _PAIRS:
        grades, kinds, tilt, causes = _TABLE[label]

        def setup(
            rng: Rng, g: str = grades[0], k: str = kinds[0], t: float = tilt, n: str = label, o: str = other
        ) -> Test:
            climate = "chamber" if "temperature" in o else "room"
            test = table(k, g, rng, tilt=t * DEG, climate=climate)
            return replace(test, angle=True) if n.startswith(OF_THE_ANGLE) else test

        def both(
            test: Test, rng: Rng, c: Callable[[Test, Rng], tuple[Cause, ...]] = causes, o: str = other
        ) -> tuple[Cause, ...]:
            return (*c(test, rng), ordinary(o, test.runs[0], rng))

        plans.append(_on_table(f"pair-{label}-{other}", "pair", setup, both, 20.0))
    return plans


def _null_plans(count: int) -> list[Plan]:
    kinds = ("ladder", "reversal", "loop", "swing", "stops", "fine", "constant", "rest", "positions")
    plans = []
    for number in range(count):

        def setup(rng: Rng, k: str = kinds[number % len(kinds)]) -> Test:
            grade = str(rng.choice(["laser", "fibre", "mems"]))
            if k == "rest":
                return rest(grade, rng, climate=str(rng.choice(["room", "chamber"])))
            if k == "positions":
                return positions(str(rng.choice(["laser", "fibre"])), rng)
            tilt = float(rng.choice([90.0, 30.0]))
            climate = str(rng.choice(["room", "warm-up", "chamber"]))
            test = table(k, grade, rng, runs=1 + int(rng.uniform() < 0.3), tilt=tilt * DEG, climate=climate)
            return replace(test, declared=("bias", *test.declared[2:])) if k == "constant" else test

        plans.append(_on_table(f"null-{number}", "null", setup, lambda t, r: (), 0.0))
    return plans


# Units.


def _settling_unit(name: str, wanted: float, family: str, creep: bool, duration: float = 1500.0) -> Plan:
    """A base that settles, or creeps, under a unit: gyros and accelerometers feel it together."""

    def make(folder: Path, rng: Rng) -> Truth:
        unit = at_rest("fibre", duration, 0.1, rng)
        tau = duration * float(rng.uniform(0.08, 0.15))
        shape = -np.log1p(unit.t / (0.1 * tau)) if creep else np.exp(-unit.t / tau)
        way = float(rng.uniform(0, 2 * np.pi))
        theta = shape[:, None] * np.array([np.cos(way), np.sin(way)])
        own = strength(unit.grade, unit.dt, GRAVITY * shape, True)
        unit = unit.tilted(theta * wanted / own)
        targets = ("accel_x", "accel_y")
        written_unit(folder, unit, targets, "", ("bias",))
        accepted = ("base_tilt", "base_settling")
        seen = {t: (0,) for t, s in zip(targets, (np.sin(way), np.cos(way)), strict=True) if abs(s) * wanted > 5}
        faint = {t: (0,) for t in targets if t not in seen}
        cause = "base_creep" if creep else "base_settling_unit"
        return Truth(name, family, cause, wanted, (accepted,), seen, accepted, faint=faint)

    return Plan(name, make)


def _rectification(name: str, wanted: float, family: str, channel: str) -> Plan:
    """A bias with the square of the vibration, on a gyro or an accelerometer."""

    def make(folder: Path, rng: Rng) -> Truth:
        unit = at_rest("mems", 600.0, 0.02, rng)
        unit, squared = vibrating(unit, rng, 0.5)
        accel = channel.startswith("accel")
        own = strength(unit.grade if not accel else _shaken(unit), unit.dt, squared, accel)
        gyros, accels = unit.gyros.copy(), unit.accels.copy()
        if accel:
            accels[:, 0] += squared * wanted / own
        else:
            gyros[:, 0] += squared * wanted / own
        written_unit(folder, replace(unit, gyros=gyros, accels=accels), (channel,), "", ("bias",))
        accepted = (("vibration_rectification",),)
        return Truth(name, family, "vibration_rectification", wanted, accepted, {channel: (0,)})

    return Plan(name, make)


def _shaken(unit: Unit) -> Grade:
    """The grade with white noise as loud as the accelerometer's in this vibration."""
    own = unit.accels[:, 0]
    return replace(unit.grade, accel=float(np.std(np.diff(own)) / np.sqrt(2) * np.sqrt(unit.dt)))


def _turning(name: str, wanted: float, family: str, what: str) -> Plan:
    """A unit on a table: a lever arm that the accelerometers feel, or a unit that leans."""

    def make(folder: Path, rng: Rng) -> Truth:
        dt = 0.05
        rates = table("ladder", "mems", rng).runs[0].rate * 0.5
        plain = turned("mems", rates, dt, rng, 0.0, 0.0)
        targets: tuple[str, ...] = ("accel_x",)
        accepted: tuple[str, ...] = ("lever_arm",)
        if what == "lever_arm":
            size = wanted / strength(plain.grade, dt, rates**2, True)
            unit = turned("mems", rates, dt, rng, size, 0.0)
        else:
            size = wanted / strength(plain.grade, dt, rates, False)
            unit = turned("mems", rates, dt, rng, 0.0, size)
            targets, accepted = ("gyro_x", "gyro_y"), ("cross_axis", "misalignment", "lean")
        written_unit(folder, unit, targets, 'table_axis = "U"', ("bias",))
        return Truth(name, family, what, wanted, (accepted,), {targets[0]: (0,)})

    return Plan(name, make)


def _attitudes(name: str, wanted: float, family: str, what: str) -> Plan:
    """Rests of an accelerometer triad: a square, a magnitude or a threshold of the specific force."""

    def make(folder: Path, rng: Rng) -> Truth:
        unit, force, segment = attitudes("mems", 24, 12.0, 0.05, rng)
        shapes = {"accel_square": force**2, "accel_magnitude": np.abs(force), "accel_cubic": force**3 / GRAVITY}
        accels = unit.accels
        if what:
            added = shapes[what] * np.array([1.0, 0.4, -0.7])
            white = accelerometer(unit.grade).n
            added = added * wanted / rest_strength(added, force, segment, white, unit.dt)
            accels = accels + added
        declared = ("accel_bias", "accel_scale_factor", "non_orthogonality")
        written_unit(folder, replace(unit, accels=accels), ACCELS, "", declared)
        accepted = ((what, "accel_quadratic", "accel_nonlinearity"),) if what else ()
        return Truth(name, family, what or "null", wanted, accepted, {t: (0,) for t in ACCELS} if what else {})

    return Plan(name, make)


def _unit_plans() -> list[Plan]:
    plans = []
    for wanted in STRENGTHS:
        plans.append(_settling_unit(f"unit-settling-{wanted:g}", wanted, "unknown", False))
        plans.append(_settling_unit(f"unit-creep-{wanted:g}", wanted, "unknown", True))
        plans.append(_rectification(f"rectification-gyro-{wanted:g}", wanted, "unknown", "gyro_x"))
        plans.append(_rectification(f"rectification-accel-{wanted:g}", wanted, "unknown", "accel_x"))
        plans.append(_turning(f"lever-arm-{wanted:g}", wanted, "unknown", "lever_arm"))
        plans.append(_turning(f"lean-{wanted:g}", wanted, "unknown", "lean"))
        for what in ("accel_square", "accel_magnitude", "accel_cubic"):
            plans.append(_attitudes(f"{what.replace('_', '-')}-{wanted:g}", wanted, "unknown", what))
    return plans


def _unit_nulls() -> list[Plan]:
    def still(folder: Path, rng: Rng, name: str) -> Truth:
        unit = at_rest(str(rng.choice(["fibre", "mems"])), 1200.0, 0.1, rng)
        written_unit(folder, unit, (*GYROS, *ACCELS), "", ("bias",))
        return Truth(name, "null", "null", 0.0, (), {})

    def shaken(folder: Path, rng: Rng, name: str) -> Truth:
        # Its accelerometers are louder while the motor runs, which is true; its gyros have nothing.
        unit, _ = vibrating(at_rest("mems", 600.0, 0.02, rng), rng, 0.5)
        written_unit(folder, unit, ("gyro_x",), "", ("bias",))
        return Truth(name, "null", "null", 0.0, (), {})

    def table_null(folder: Path, rng: Rng, name: str) -> Truth:
        rates = table("ladder", "mems", rng).runs[0].rate * 0.5
        unit = turned("mems", rates, 0.05, rng, 0.0, 0.0)
        written_unit(folder, unit, ("gyro_x", "accel_x"), 'table_axis = "U"', ("bias",))
        return Truth(name, "null", "null", 0.0, (), {})

    plans = []
    for number in range(4):
        for label, maker in (("still", still), ("shaken", shaken), ("table", table_null)):
            name = f"null-unit-{label}-{number}"
            plans.append(Plan(name, partial(maker, name=name)))
        plans.append(_attitudes(f"null-attitudes-{number}", 0.0, "null", ""))
    return plans


def plans(nulls: int = 45) -> list[Plan]:
    """All cases."""
    return [*_table_plans(), *_unit_plans(), *_pair_plans(), *_control_plans(), *_null_plans(nulls), *_unit_nulls()]


def made(plan: Plan, folder: Path, seed: int) -> Truth:
    """Write one case into ``folder``/its name."""
    return plan.make(folder / plan.name, _rng(plan.name, seed))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    truths = [asdict(made(plan, given.folder, given.seed)) for plan in plans()]
    (given.folder / "truth.json").write_text(json.dumps(truths, indent=1), encoding="utf-8")
    print(f"{len(truths)} cases in {given.folder}")


if __name__ == "__main__":
    main()
