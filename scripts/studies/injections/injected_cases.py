"""Cases drawn with a seed: a recording, a target, an effect, its size; the altered files and what is true of them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from altered_files import Kept, Run, held, read, renewed, written
from injected_laws import ABSOLUTE, IN_ATTITUDES, RESTED, TURNED, Exposure, Floats, G, Law, Triads, UnitLaw
from injected_sizes import Scale, scale_of, size_for

#: Sizes in standard deviations.
STRENGTH = (5.0, 30.0)
#: What another curve leaves of a size that nobody could tell.
ALIKE = 3.0
#: A rest of a unit in attitudes: this long [s], its means scatter with those of the quietest ones.
REST = 1.0
#: Laws after which readings are numbers of the instrument as they were.
WHOLE = ("saturation", "sample_hold")
#: Fewest turns from rest to rest that show an effect of the gyros.
FEWEST_TURNS = 6
#: A reference that the reading follows at least so well.
FOLLOWS = 0.9
#: By a factor between these.
FACTOR = (0.5, 2.0)


@dataclass(frozen=True)
class Truth:
    """What was put in: by which names it is right, its coefficient, and what nobody could tell from it."""

    recording: str
    kind: str
    law: str
    target: str
    size: float
    strength: float
    names: tuple[str, ...]
    alike: tuple[str, ...]
    parameter: str = ""
    value: float = 0.0


class UnfitError(Exception):
    """A recording into which no case can be put, and why."""


def drawn(path: Path, name: str, kind: str, wanted: Sequence[str], seed: Sequence[int], folder: Path) -> Truth:
    """Put the first of the wanted laws that the recording can show into it, and write it.

    Raises
    ------
    UnfitError
        Where none of them could be seen at a credible size.
    """
    kept, rng = read(path), np.random.default_rng(seed)
    strength = float(STRENGTH[0] * (STRENGTH[1] / STRENGTH[0]) ** rng.uniform())
    put = {"reference": _turned, "attitudes": _in_attitudes, "rest": _rested}[kind]
    for law in wanted:
        found = put(kept, law, strength, rng)
        if found is not None:
            altered, truth = found
            folder.mkdir(parents=True, exist_ok=True)
            written(altered, folder)
            truth = replace(truth, recording=name, kind=kind)
            (folder / "truth.json").write_text(json.dumps(asdict(truth), indent=1), encoding="utf-8")
            return truth
    raise UnfitError(f"none of {', '.join(wanted)} shows at a credible size")


# --- beside a reference -----------------------------------------------------------------------------------------------


def _turned(kept: Kept, law: str, strength: float, rng: np.random.Generator) -> tuple[Kept, Truth] | None:
    name = "table_angle" if "table_angle" in kept.channels else "table_rate"
    target, rows = _follower(kept, name)
    each = TURNED[law]
    if not set(each.needs) <= set(kept.channels) or ("temperature" in each.needs and not _heated(rows)):
        return None
    terms = [r.u_of_reference[:, None] if law != "scale_factor" else np.zeros((len(r.e.t), 0)) for r in rows]
    usual = [_usual(r.u_of_reference, r.e.dt) for r in rows]
    exposures = [r.e for r in rows]
    scale = scale_of([e.y for e in exposures], terms, usual, _rows_of(exposures, each))
    shape = rng.uniform(size=3)
    top = (
        1.0
        if law in ABSOLUTE or "temperature" in each.needs or (each.low >= 1e-6 and law not in ("dead_band", "lock_in"))
        else exposures[0].top
    )
    found = _sized(each, exposures, scale, strength, shape, top)
    if found is None:
        return None
    size, effect = found
    alike = tuple(_alike(law, TURNED, exposures, scale, effect, rng))
    runs = [
        _put(kept, run, e, each.of(e, size, shape), target, name, law in WHOLE)
        for run, e in zip(kept.runs, exposures, strict=True)
    ]
    parameter, value = _value(each, exposures[0], size, shape)
    truth = Truth("", "", law, target, size, strength, each.names, alike, parameter, value)
    return replace(kept, runs=tuple(runs)), truth


@dataclass(frozen=True)
class _Row:
    e: Exposure
    u_of_reference: Floats


def _follower(kept: Kept, name: str) -> tuple[str, list[_Row]]:
    """The target that follows the reference best, and what its runs were exposed to."""
    best: tuple[float, str, list[tuple[Floats, Floats, Floats]], float] | None = None
    for target in (t for t in kept.targets if t.startswith("gyro")):
        rows = []
        for run in kept.runs:
            t, y, reference = kept.time(run), kept.si(run, target), _whole(kept, kept.si(run, name), name)
            rows.append((t, y, np.gradient(reference, t) if name == "table_angle" else reference))
        gain, follows, shift = _gain([(_smooth(y, t), _smooth(u, t)) for t, y, u in rows])
        if best is None or follows > best[0]:
            best = (follows, target, [(t, y, _later(u, shift)) for t, y, u in rows], gain)
    if best is None:
        raise UnfitError("no gyro is asked for")
    follows, target, given, gain = best
    if follows < FOLLOWS:
        raise UnfitError(f"no target follows the reference (correlation {follows:.2f})")
    if not FACTOR[0] < abs(gain) < FACTOR[1]:
        raise UnfitError(f"the reading is {gain:.2g} times the reference: another unit or axis")
    top = float(np.percentile(np.concatenate([np.abs(gain * u) for _, _, u in given]), 98))
    longest = int(np.argmax([len(t) for t, *_ in given]))
    out = []
    for k, (run, (t, y, u)) in enumerate(zip(kept.runs, given, strict=True)):
        reference = _whole(kept, kept.si(run, name), name)
        angle = (
            reference
            if name == "table_angle"
            else np.concatenate([[0.0], np.cumsum(0.5 * (u[1:] + u[:-1]) * np.diff(t))])
        )
        bias = float(np.mean(y - gain * u))
        kelvin = kept.si(run, "temperature") if "temperature" in kept.channels else None
        e = Exposure(t, y, _smooth(y - bias, t), reference, name == "table_angle", angle, kelvin, top, k == longest)
        out.append(_Row(e, u))
    return target, out


def _whole(kept: Kept, reference: Floats, name: str) -> Floats:
    return np.unwrap(reference) if name == "table_angle" and kept.manifest.channels[name].wrapped else reference


def _smooth(x: Floats, t: Floats) -> Floats:
    """Means over up to five rows, as many as lie within 50 ms."""
    n = int(np.clip(0.05 / float(np.median(np.diff(t))), 1, 5)) // 2 * 2 + 1
    return np.convolve(np.pad(x, n // 2, mode="edge"), np.ones(n) / n, mode="valid")


def _later(u: Floats, rows: int) -> Floats:
    return np.roll(u, rows) if abs(rows) < len(u) else u


def _gain(pairs: Sequence[tuple[Floats, Floats]]) -> tuple[float, float, int]:
    """Gain, correlation and delay in rows of readings beside a reference, each run with its mean."""
    best = (0.0, -1.0, 0)
    reach = min(40, min(len(y) for y, _ in pairs) // 4)
    for shift in range(-reach, reach + 1, 1 if reach < 20 else 2):
        y = np.concatenate([a - a.mean() for a, _ in pairs])
        u = np.concatenate([_later(b, shift) - b.mean() for _, b in pairs])
        follows = float(y @ u) / max(float(np.linalg.norm(y) * np.linalg.norm(u)), 1e-300)
        if abs(follows) > best[1]:
            best = (float(y @ u) / max(float(u @ u), 1e-300), abs(follows), shift)
    return best


def _usual(u: Floats, dt: float) -> Floats:
    """What real tests have anyway: a reference that is late, and one that is filtered."""
    first = np.gradient(u, dt)
    return np.column_stack([u, first, np.gradient(first, dt)])


def _heated(rows: Sequence[_Row]) -> bool:
    return all(r.e.kelvin is not None and np.ptp(r.e.kelvin) > 2.0 for r in rows)


def _rows_of(exposures: Sequence[Exposure], law: Law) -> int:
    """Rows in a mean: a few hundred means of all, of fast effects means of some rows."""
    total, dt = sum(e.length for e in exposures), exposures[0].dt
    return max(int((0.04 if law.fast else np.clip(total / 500.0, 0.1, 60.0)) / dt), 1)


def _sized(
    law: Law, exposures: Sequence[Exposure], scale: Scale, strength: float, shape: Floats, top: float
) -> tuple[float, list[Floats]] | None:
    def effect(size: float) -> list[Floats]:
        return [_as_reading(e, law.of(e, size, shape)) for e in exposures]

    high = law.high * top
    size = size_for(strength, lambda s: scale.size(effect(s)), law.low * top, high)
    return None if size is None else (size, effect(size))


def _as_reading(e: Exposure, given: tuple[Floats, Floats]) -> Floats:
    """What an effect comes to as an error of the reading."""
    y, reference = given
    gained = reference - e.reference
    return np.asarray((y - e.y) - (np.gradient(gained, e.t) if e.is_angle else gained))


def _alike(
    own: str,
    laws: Mapping[str, Law],
    exposures: Sequence[Exposure],
    scale: Scale,
    effect: list[Floats],
    rng: np.random.Generator,
) -> Iterator[str]:
    """Names of other laws that leave less of the effect than anybody could tell."""
    for name, law in laws.items():
        if (
            name == own
            or ("temperature" in law.needs and any(e.kelvin is None for e in exposures))
            or set(law.names) & set(laws[own].names)
        ):
            continue
        size = law.high * 0.1 * exposures[0].top
        for shape in ([0.1, 0.2, 0.5], [0.5, 0.7, 0.5], [0.9, 0.2, 0.5]):
            curve = [_as_reading(e, law.of(e, size, np.array(shape))) for e in exposures]
            if any(np.any(c) for c in curve) and scale.size(effect, [curve]) < ALIKE:
                yield from law.names
                break


def _put(
    kept: Kept, run: Run, e: Exposure, given: tuple[Floats, Floats], target: str, reference: str, whole: bool
) -> Run:
    """The run with a reading and a reference altered; what is held is renewed when it was."""
    y, logged = given
    altered = {}
    if y is not e.y:
        at = renewed(run.values[target]) if held(run.values[target]) else slice(None)
        altered[target] = y[at]
    if logged is not e.reference:
        at = renewed(run.values[reference]) if held(run.values[reference]) else slice(None)
        gained = logged - e.reference
        altered[reference] = kept.si(run, reference) + gained[at]
    return kept.with_si(run, altered, whole)


def _value(law: Law, e: Exposure, size: float, shape: Floats) -> tuple[str, float]:
    return (law.value[0], law.value[1](e, size, shape)) if law.value else ("", 0.0)


# --- at rest ----------------------------------------------------------------------------------------------------------


def _rested(kept: Kept, law: str, strength: float, rng: np.random.Generator) -> tuple[Kept, Truth] | None:
    target = str(rng.choice(kept.targets))
    each, shape = RESTED[law], rng.uniform(size=3)
    longest = int(np.argmax([len(r) for r in kept.runs]))
    exposures = []
    for k, run in enumerate(kept.runs):
        t, y = kept.time(run), kept.si(run, target)
        kelvin = kept.si(run, "temperature") if "temperature" in kept.channels else None
        exposures.append(Exposure(t, y, 0.0 * t, 0.0 * t, False, 0.0 * t, kelvin, 1.0, k == longest))
    if each.needs and any(e.kelvin is None or np.ptp(e.kelvin) < 2.0 for e in exposures):
        return None
    nothing = [np.zeros((len(e.t), 0)) for e in exposures]
    total, dt = sum(e.length for e in exposures), exposures[0].dt
    rows = max(int((total / 300.0) / dt), 1) if not each.fast else max(int(0.5 / dt), 1) if law == "burst" else 1
    if law in ("tone", "common_line"):
        low, high = 10.0 / exposures[0].length, min(0.2 / dt, 5.0)
        rows = max(int(0.2 / (low * (high / low) ** shape[0]) / dt), 1) if high > low else 1
    scale = scale_of([e.y for e in exposures], nothing, nothing, rows)
    found = _sized(each, exposures, scale, strength, shape, 1.0)
    if found is None:
        return None
    size, effect = found
    alike = tuple(_alike(law, RESTED, exposures, scale, effect, rng)) if not each.fast else ()
    alike += tuple(n for n in ("bias_temperature",) if each.needs)
    prefix = target.partition("_")[0]
    shared = [n for n in kept.targets if n.startswith(prefix)] if law == "common_line" else [target]
    runs = []
    for run, gained in zip(kept.runs, effect, strict=True):
        given = {}
        for name in shared:
            at = renewed(run.values[name]) if held(run.values[name]) else slice(None)
            given[name] = kept.si(run, name) + gained[at]
        runs.append(kept.with_si(run, given))
    parameter, value = _value(each, exposures[longest], size, shape)
    truth = Truth("", "", law, target, size, strength, each.names, alike, parameter, value)
    return replace(kept, runs=tuple(runs)), truth


# --- in attitudes -----------------------------------------------------------------------------------------------------


def _in_attitudes(kept: Kept, law: str, strength: float, rng: np.random.Generator) -> tuple[Kept, Truth] | None:
    each = IN_ATTITUDES[law]
    names = [n for n in kept.channels if n.startswith(("accel_", "gyro_"))]
    gyros = [n for n in kept.targets if n.startswith("gyro_")]
    accels = [n for n in kept.targets if n.startswith("accel_")]
    kind = gyros if each.gyro else accels
    if len(kind) < 3 or (law == "bias_drift" and len(kept.runs) > 1):
        return None
    target, other = rng.choice(kind, 2, replace=False)
    each_row = kept.manifest.segment_is_row
    triads = [
        Triads(kept.time(r), {n: kept.si(r, n) for n in names}, str(target), str(other), each_row) for r in kept.runs
    ]
    if each.drawn is not None:
        size = float(rng.uniform(*each.drawn)) * (1.0 if law in ("flipped", "exchanged") else rng.choice([-1.0, 1.0]))
    else:
        found = (_size_of_turns if each.of_turns else _size_of_rests)(each, triads, strength)
        if found is None:
            return None
        size = found
    runs = tuple(kept.with_si(r, each.of(x, size)) for r, x in zip(kept.runs, triads, strict=True))
    parameter, value = (each.value[0], each.value[1] * size) if each.value else ("", 0.0)
    truth = Truth("", "", law, str(target), size, strength, each.names, (), parameter, value)
    return replace(kept, runs=runs), truth


def _size_of_rests(law: UnitLaw, triads: Sequence[Triads], strength: float) -> float | None:
    """The size at which means of rests show an effect so clearly: of |f| beside six constants, or of a gyro's bias."""
    before = [_rest_means(x, x.values) for x in triads]
    force = np.vstack([np.column_stack([b[a] for a in triads[0].accels]) for b in before])
    if len(force) < 10:
        return None
    unit = force / np.linalg.norm(force, axis=1, keepdims=True)
    if law.gyro:
        X, left = np.ones((len(force), 1)), np.concatenate([b[triads[0].target] for b in before])
    else:
        skewed = np.column_stack([unit[:, i] * unit[:, j] for i, j in ((0, 1), (0, 2), (1, 2))])
        X = np.hstack([unit, G * unit**2, *(() if law.names[0] == "non_orthogonality" else (G * skewed,))])
        left = np.linalg.norm(force, axis=1) - G
    q, _ = np.linalg.qr(X)
    sd = float(np.linalg.norm(left - q @ (q.T @ left)) / np.sqrt(max(len(left) - X.shape[1], 1)))

    def shown(size: float) -> float:
        after = [_rest_means(x, {**x.values, **law.of(x, size)}, x.values) for x in triads]
        gained = np.concatenate([a[triads[0].target] - b[triads[0].target] for a, b in zip(after, before, strict=True)])
        along = gained if law.gyro else gained * unit[:, triads[0].accels.index(triads[0].target)]
        left = along if law.declared else along - q @ (q.T @ along)
        return float(np.linalg.norm(left) / sd)

    return size_for(strength, shown, 1e-7, law.high)


def _size_of_turns(law: UnitLaw, triads: Sequence[Triads], strength: float) -> float | None:
    """The size at which directions of gravity after turns show an effect of the gyros so clearly; it is linear."""
    missed, moved, tried = [], [], 0.01
    for x in triads:
        altered = {**x.values, **law.of(x, tried)}
        for begin, end in pairwise(_rests(x, x.values)):
            rows = slice(begin[1], end[0])
            force = [np.array([f[slice(*rest)].mean() for f in x.forces]) for rest in (begin, end)]
            before, after = (f / np.linalg.norm(f) for f in force)
            gyros = [n for n in x.values if n.startswith("gyro_")]
            bias = np.array([x.values[n][slice(*begin)].mean() for n in gyros])
            told, other = (
                _turned_back(np.column_stack([v[n][rows] for n in gyros]) - bias, x.t[rows], before)
                for v in (x.values, altered)
            )
            missed.append(told - after)
            moved.append(other - told)
    if len(missed) < FEWEST_TURNS:
        return None
    sd = 1.4826 * float(np.median(np.abs(np.concatenate(missed))))
    size = tried * strength * sd / max(float(np.linalg.norm(np.concatenate(moved))), 1e-300)
    return size if size < law.high else None


def _turned_back(rate: Floats, t: Floats, direction: Floats) -> Floats:
    """A direction that stays, in axes that turn at these rates, shape (n, 3)."""
    out, dt = direction, float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    for w in rate * dt:
        angle = float(np.linalg.norm(w))
        if angle > 0.0:
            axis = -w / angle
            cross = np.array(
                [
                    axis[1] * out[2] - axis[2] * out[1],
                    axis[2] * out[0] - axis[0] * out[2],
                    axis[0] * out[1] - axis[1] * out[0],
                ]
            )
            out = out * np.cos(angle) + cross * np.sin(angle) + axis * (axis @ out) * (1 - np.cos(angle))
    return out


def _rest_means(x: Triads, values: Mapping[str, Floats], of: Mapping[str, Floats] | None = None) -> dict[str, Floats]:
    """Means over the rests of ``of``."""
    if x.each:
        return dict(values)
    rests = _rests(x, of or values)
    return {name: np.array([v[a:b].mean() for a, b in rests]) for name, v in values.items()}


def _rests(x: Triads, values: Mapping[str, Floats]) -> list[tuple[int, int]]:
    """Rows of rests: seconds, two and more, in which the accelerometers scatter little."""
    rows = max(int(REST / float(np.median(np.diff(x.t)))), 2)
    n = x.t.size // rows
    rough = np.sum([values[a][: n * rows].reshape(n, rows).var(axis=1) for a in x.accels], axis=0)
    quiet = rough < 9.0 * float(np.percentile(rough, 15))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(int)))
    return [(a * rows, b * rows) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 2]
