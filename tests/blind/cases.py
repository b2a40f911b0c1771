"""Cases by kind and seed: a folder with data file and manifest, and apart from it what is true."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from blind import parts
from blind.climate import KINDS as CLIMATES
from blind.files import channel_lines, manifest_text, write_table
from blind.kinds import confounded, realistic, strangers, student, triad
from blind.kinds.rivals import rivals
from blind.kinds.special import SPECIAL
from blind.parts import Part
from blind.plan import Plan, plan
from blind.record import kept, record, ruler, scaled
from blind.table import Floats, follow
from blind.world import GRAVITY
from blind.write import written

KINDS = ("null", "exact", "realistic", "pair", "unknown", "confounded", "triad", "student")


@dataclass(frozen=True)
class Truth:
    """One cause: its name, every name that does it justice, and its strength beside the declared model."""

    key: str
    accepted: tuple[str, ...]
    rivals: tuple[str, ...]
    strength: float


@dataclass(frozen=True)
class Case:
    """A recording and what is true of it.

    ``required`` names what a report must hold together where the procedure cannot tell; ``facts`` describe the test.
    """

    kind: str
    number: int
    manifest: str
    truths: tuple[Truth, ...]
    required: tuple[str, ...]
    scale_error: float | None
    facts: dict[str, object]


@dataclass(frozen=True)
class Made:
    """A case with what only its maker knows, row by row."""

    case: Case
    noise: Floats
    systematic: Floats
    rows: Floats
    run: NDArray[np.int64]


def draw(kind: str, number: int, seed: int, folder: Path, strength: float | None = None) -> Made:
    """Make case ``number`` of a kind in ``folder``; the same arguments give the same case."""
    rng = _generator(kind, number, seed)
    makers = {
        "null": _null,
        "exact": _single,
        "realistic": _single,
        "pair": _pair,
        "unknown": _unknown,
        "confounded": _confounded,
        "triad": _triad,
        "student": _student,
    }
    return makers[kind](_Job(kind, number, folder, strength), rng)


def _generator(kind: str, number: int, seed: int) -> np.random.Generator:
    digest = hashlib.sha256(f"{kind}/{number}/{seed}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))


@dataclass(frozen=True)
class _Job:
    kind: str
    number: int
    folder: Path
    strength: float | None


def _null(job: _Job, rng: np.random.Generator) -> Made:
    chosen = plan(rng, large=rng.uniform() < 0.05, several=True)
    return _made(job, chosen, chosen.declared, [], rng)


def _single(job: _Job, rng: np.random.Generator) -> Made:
    makers = parts.EXACT if job.kind == "exact" else realistic.REALISTIC
    names = [*sorted(makers), *(SPECIAL if job.kind == "exact" else ())]
    key = names[job.number % len(names)]
    strength = job.strength or float(rng.choice([10.0, 20.0, 40.0]))
    if key in SPECIAL:
        chosen, declared, part, size = SPECIAL[key](rng, strength)
        return _made(job, chosen, declared, [(part, size)], rng)
    while True:
        chosen = plan(rng, parts.PROCEDURES[key], CLIMATES, parts.needs_encoder(key), key in parts.THERMAL,
                      grades=parts.grades(key), several=True)  # fmt: skip
        declared = tuple(d for d in chosen.declared if d != key)
        part = makers[key](chosen.world, rng)
        size = scaled(part, strength, ruler(chosen, declared))
        if _believable(chosen, part, size):
            return _made(job, chosen, declared, [(part, size)], rng)


def _pair(job: _Job, rng: np.random.Generator) -> Made:
    """Two exact causes, each of the demanded strength beside the other."""
    strength = job.strength or float(rng.choice([12.0, 20.0]))
    while True:
        one, other = rng.choice(sorted(set(parts.EXACT) - {"scale_factor"}), 2, replace=False)
        common = sorted(set(parts.PROCEDURES[one]) & set(parts.PROCEDURES[other]))
        if not common:
            continue
        encoder = parts.needs_encoder(one) or parts.needs_encoder(other)
        chosen = plan(rng, common, ("chamber", "heater"), encoder, one in parts.THERMAL or other in parts.THERMAL,
                      grades=parts.grades(one, other), several=True)  # fmt: skip
        measure = ruler(chosen, chosen.declared)
        two = [parts.EXACT[key](chosen.world, rng) for key in (one, other)]
        curves = [part.addition(part.size) for part in two]
        told = [measure.beside(a, b) > 0.5 * measure.beside(a) for a, b in (curves, curves[::-1])]
        if not all(told):
            continue  # one explains the other: no test of two
        sizes = [scaled(p, strength, measure, c) for p, c in zip(two, curves[::-1], strict=True)]
        if all(_believable(chosen, p, s) for p, s in zip(two, sizes, strict=True)):
            return _made(job, chosen, chosen.declared, list(zip(two, sizes, strict=True)), rng)


def _unknown(job: _Job, rng: np.random.Generator) -> Made:
    names = sorted(strangers.STRANGERS)
    name = names[job.number % len(names)]
    maker, profiles = strangers.STRANGERS[name]
    chosen = plan(rng, profiles, encoder=name == "loose encoder", thermometer=name == "hot ripple", several=True)
    part = maker(chosen.world, rng)
    strength = job.strength or float(rng.choice([12.0, 20.0, 40.0]))
    size = scaled(part, strength, ruler(chosen, chosen.declared))
    return _made(job, chosen, chosen.declared, [(part, size)], rng, {"stranger": name})


@dataclass(frozen=True)
class _Setup:
    """A confounded test, ready to be run: the cause is the same whatever the table does."""

    name: str
    plan: Plan
    declared: tuple[str, ...]
    key: str
    seed: int
    size: float

    def part(self, chosen: Plan) -> Part:
        return confounded.SETS[self.name].part(chosen.world, self.key, np.random.default_rng(self.seed))


def _setup(job: _Job, rng: np.random.Generator) -> _Setup:
    name = sorted(confounded.SETS)[job.number % len(confounded.SETS)]
    procedure = confounded.SETS[name]
    while True:
        chosen = procedure.plan(rng)
        key = str(rng.choice(procedure.truths))
        declared = tuple(d for d in chosen.declared if d not in procedure.undeclared)
        seed = int(rng.integers(2**31))
        strength = job.strength or float(rng.choice([12.0, 20.0]))
        part = _Setup(name, chosen, declared, key, seed, 0.0).part(chosen)
        size = scaled(part, strength, ruler(chosen, declared))
        if _believable(chosen, part, size):
            return _Setup(name, chosen, declared, key, seed, size)


def _confounded(job: _Job, rng: np.random.Generator) -> Made:
    setup = _setup(job, rng)
    wrong = [(setup.part(setup.plan), setup.size)]
    required = confounded.SETS[setup.name].required
    return _made(job, setup.plan, setup.declared, wrong, rng, {"procedure": setup.name}, required)


def further_run(kind: str, number: int, seed: int, folder: Path, rates: list[tuple[float, float]],
                strength: float | None = None) -> Path:  # fmt: skip
    """The test of a confounded case again, the table now at ``rates`` [(rad/s, s)]; manifest of both runs."""
    rng = _generator(kind, number, seed)
    setup = _setup(_Job(kind, number, folder, strength), rng)
    first = written(folder, setup.plan, setup.declared, record(setup.plan, [(setup.part(setup.plan), setup.size)], rng))
    old = setup.plan.world
    way = follow(rates, old.trajectory)
    world = replace(old, n=int(sum(dwell for _, dwell in rates) / old.dt), profile="staircase", trajectory=way)
    extra = confounded.accelerometers(world, rng) if setup.plan.extra else ()
    plan = replace(setup.plan, world=world, extra=extra)
    recorded = record(plan, [(setup.part(plan), setup.size)], rng)
    second = written(folder / "further", plan, tuple(dict.fromkeys((*setup.declared, "scale_factor"))), recorded)
    text = second.read_text(encoding="utf-8")
    name = text.split('"')[1]
    before = first.read_text(encoding="utf-8").split('"')[1]
    both = text.replace(f'data = "{name}"', f'data = ["{before}", "further/{name}"]')
    path = folder / "both.toml"
    path.write_text(both, encoding="utf-8")
    return path


def _triad(job: _Job, rng: np.random.Generator) -> Made:
    """A unit at rest: nothing, one cause on one channel, or a base that sways."""
    what = ("", "base_tilt", *sorted(triad.CAUSES))[job.number % (len(triad.CAUSES) + 2)]
    target = "accel_x" if what == "base_tilt" else str(rng.choice(["accel_x", "accel_y", "gyro_x", "gyro_z"]))
    rig = triad.bench(rng, target)
    w = rig.world
    fitted = int(np.sum(w.rows - w.dt <= 0.6 * (w.n - 1) * w.dt))
    strength = job.strength or float(rng.choice([10.0, 20.0]))
    measure, addition = triad.measure(rig, fitted), np.zeros(w.n)
    if what == "base_tilt":
        rig = triad.tilting(rig, strength, fitted, rng)
    elif what:
        part = triad.CAUSES[what](w, rng)
        addition = part.addition(strength / measure.beside(part.addition(1.0)))
    columns, noise = triad.columns(rig, addition, rng)
    addition = addition - GRAVITY * rig.tilt * (target == "accel_x")
    channels = [f'time = {{ rate = "{1 / w.dt:g} Hz" }}', *channel_lines(columns, rig.layout)]
    job.folder.mkdir(parents=True, exist_ok=True)
    write_table(job.folder / "imu.csv", columns, rig.layout)
    tables = {"mounting": {"axes": '"RFU"'}, "model": {"target": f'"{target}"', "declared": '["bias"]'}}
    path = job.folder / "manifest.toml"
    path.write_text(manifest_text(["imu.csv"], channels, tables), encoding="utf-8")
    truths = (Truth(what, (what,), (), measure.beside(addition)),) if what else ()
    facts: dict[str, object] = {"rows": w.n, "rate_hz": 1 / w.dt, "target": target, "climate": w.climate.kind}
    case = Case(job.kind, job.number, str(path), truths, (), None, facts | {"instant": False})
    _keep(job.folder, case)
    return Made(case, noise, addition, w.rows, np.ones(w.n, np.int64))


def _student(job: _Job, rng: np.random.Generator) -> Made:
    """A cheap gyro beside a real encoder; every second one has an error more."""
    unit = student.drawn(rng, extra=job.number % 2 == 1)
    strength = job.strength or float(rng.choice([20.0, 40.0]))
    files = student.files_of(unit, strength, rng)
    job.folder.mkdir(parents=True, exist_ok=True)
    units = {"time": "s", "gyro": "rad/s", "table_rate": "rad/s", "table_angle": "rad"}
    data = [f"file_{number}.csv" for number in range(1, len(files) + 1)]
    for name, one in zip(data, files, strict=True):
        table = np.column_stack(list(one.columns.values()))
        np.savetxt(job.folder / name, table, "%.10g", ",", header=",".join(one.columns), comments="")
    channels = [f'{name} = {{ column = "{name}", unit = "{units[name]}" }}' for name in files[0].columns]
    path = job.folder / "manifest.toml"
    tables = {"model": {"target": '"gyro"', "declared": '["bias", "scale_factor"]'}}
    path.write_text(manifest_text(data, channels, tables), encoding="utf-8")
    truths = [Truth("timing_skew", ("timing_skew",), (), np.inf)]
    truths += [Truth("sample_hold", ("sample_hold",), (), np.inf)] if unit.hold > 1 else []
    truths += [Truth(unit.extra, (unit.extra,), (), strength)] if unit.extra else []
    facts: dict[str, object] = {"rate_hz": 1 / unit.dt, "runs": len(files), "instant": True, "logged": unit.logged}
    facts |= {"form": unit.form, "motion": list(unit.motion), "may": ["encoder_harmonic:1"] * (unit.eccentricity > 0)}
    case = Case(job.kind, job.number, str(path), tuple(truths), (), unit.gain - 1, facts)
    _keep(job.folder, case)
    rows = np.concatenate([one.columns["time"] for one in files])
    added = np.concatenate([one.added for one in files])
    run = np.repeat(np.arange(1, len(files) + 1), [len(one.added) for one in files])
    return Made(case, np.zeros(len(rows)), added, rows, run)


def _believable(chosen: Plan, part: Part, size: float) -> bool:
    """Whether such a size occurs: a cause that would need more is not one of this instrument."""
    w = chosen.world
    peak = float(np.abs(part.addition(size)).max())
    top = float(np.abs(w.u).max()) if w.turning else np.inf
    limits = {"scale_factor_anomaly": 0.01 * top, "lock_in": 0.05 * top, "timing_skew": 0.2 * top}
    return bool(np.isfinite(peak) and peak < min(limits.get(part.key, 0.02 * top), 0.5))


def _made(
    job: _Job,
    chosen: Plan,
    declared: tuple[str, ...],
    wrong: list[tuple[Part, float]],
    rng: np.random.Generator,
    more: dict[str, object] | None = None,
    required: tuple[str, ...] = (),
) -> Made:
    recorded = record(chosen, wrong, rng)
    manifest = written(job.folder, chosen, declared, recorded)
    measure = ruler(chosen, declared)
    truths = []
    for index, (part, size) in enumerate(wrong):
        addition = part.addition(size)
        others = [p.addition(c) for k, (p, c) in enumerate(wrong) if k != index]
        same = rivals(chosen, declared, addition) if part.key else {}
        names = tuple(dict.fromkeys((part.key, *part.also))) if part.key else ()
        truths.append(Truth(part.key, names, tuple(sorted(same)), measure.beside(addition, *others)))
    case = Case(
        job.kind,
        job.number,
        str(manifest),
        tuple(truths),
        required,
        chosen.scale_error if "scale_factor" in declared and chosen.world.turning else None,
        _facts(chosen) | (more or {}),
    )
    _keep(job.folder, case)
    w = chosen.world
    there, run = kept(chosen), np.repeat(np.arange(1, w.runs + 1), w.each)
    return Made(case, recorded.noise[there], recorded.systematic[there], w.rows[there], run[there])


def _facts(chosen: Plan) -> dict[str, object]:
    w = chosen.world
    return {
        "rows": w.n,
        "runs": w.runs,
        "gaps": len(chosen.gaps),
        "dropped": chosen.scattered,
        "rate_hz": 1 / w.dt,
        "duration_s": w.duration,
        "profile": w.profile,
        "climate": w.climate.kind,
        "grade": chosen.grade,
        "output": chosen.output,
        "reference": chosen.reference,
        "thermometer": bool(chosen.thermometer),
        "noise_declared": bool(chosen.declares_noise),
        "tilt_deg": round(float(np.rad2deg(w.tilt)), 3),
        "site": bool(chosen.site),
        "instant": bool(w.instant),
        "declared": list(chosen.declared),
    }


def _keep(folder: Path, case: Case) -> None:
    """The truth stands beside the folder, not in it."""
    folder.with_suffix(".truth.json").write_text(json.dumps(asdict(case), indent=1), encoding="utf-8")


__all__ = ["KINDS", "Case", "Made", "Truth", "draw"]
