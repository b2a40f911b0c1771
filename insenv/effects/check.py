"""Whether an effect keeps the contract of `insenv.effects.base`: what fails, in sentences.

An effect of another package is asked this when it is loaded. It is tried on a swinging table that warms up, 120 samples
at 10 Hz, with half the standard deviation of each of its linear parameters.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from typing import Any, get_args

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import (
    Belongs,
    CurveEffect,
    DrivenEffect,
    Effect,
    Instrument,
    LinearEffect,
    Param,
    central_differences,
    combine,
)
from insenv.effects.own import ALL

#: Intervals and their length [s].
_N, _DT = 120, 0.1
#: When its table stops, and how long it stands [s].
_STOPS, _STANDS = 7.0, 1.5
#: Fields of `Motion` that a recording may lack, and what they are where it does.
_LACKING: dict[str, Any] = {
    **dict.fromkeys(("angle", "rate_edges", "turn_rate", "temperature", "base_tilt", "across")),
    "force": {},
    "vibration": {},
    "cross_rate": {},
    "body_rate": {},
}
#: Rounding, as a share of the largest value.
_ROUNDING = 1e-9
#: Share by which a difference may be off the derivative of a curve.
_CURVED = 1e-2


def check_effect(effect: object) -> list[str]:
    """What is wrong with an effect: one sentence for each fault, none where it is sound.

    Its declaration is looked at first; only if that is sound is it computed with, and a fault that makes all else
    meaningless (an exception, a wrong shape) ends the list.
    """
    if isinstance(effect, type):
        return [f"{effect.__name__} is a class; wanted an effect made of it"]
    if not isinstance(effect, Effect):
        return [f"{type(effect).__name__} is no effect; wanted a class derived from insenv.effects.base.Effect"]
    kinds = (LinearEffect, CurveEffect, DrivenEffect)
    if not isinstance(effect, kinds):
        return ["it is of no known kind; wanted a LinearEffect, CurveEffect, MemoryEffect, DrivenEffect or NoiseEffect"]
    said: list[str] = []
    for look in (_identity, _parameters, _declared):
        said += look(effect)
    if said:
        return said
    try:
        with np.errstate(all="ignore"):
            said += _computed(effect)
    except _FaultError as fault:
        said.append(str(fault))
    except Exception as error:  # whatever another author's code raises
        said.append(f"it ends with {type(error).__name__}: {error}; wanted an addition on every exposure that it needs")
    return said


class _FaultError(Exception):
    """A fault that makes what follows meaningless."""


def _identity(effect: Effect) -> Iterator[str]:
    if not (isinstance(effect.id, str) and re.fullmatch(r"[a-z][a-z0-9_]*", effect.id)):
        yield f"its id is {effect.id!r}; wanted lower-case letters, digits and underscores, as 'bias_hysteresis'"
    elif any(own.id == effect.id and type(own) is not type(effect) for own in ALL):
        yield f"its id {effect.id!r} is that of an effect of insenv; wanted another"
    if not (isinstance(effect.source, str) and effect.source.strip()):
        yield "it has no source; wanted the paper, standard or formula that describes it"
    try:
        alike = hash(effect) == hash(replace(effect)) and effect == replace(effect)
    except TypeError:
        alike = False
    if not alike:
        yield "two of a kind are not equal or not hashable; wanted a frozen dataclass, or no fields at all"


def _parameters(effect: Effect) -> Iterator[str]:
    for name in ("linear", "shapes"):
        params = getattr(effect, name)
        if not (isinstance(params, tuple) and all(isinstance(p, Param) for p in params)):
            yield f"{name} is {params!r}; wanted a tuple of Param"
            return
    if not effect.linear:
        yield "it has no linear parameter; wanted at least one, the size of the effect"
    names = [p.name for p in effect.params]
    if len(set(names)) < len(names):
        yield f"its parameters are {', '.join(names)}; wanted each name once"
    if effect.shapes and isinstance(effect, LinearEffect):
        yield "a LinearEffect has shapes; wanted a CurveEffect, which is given them"
    for p in effect.params:
        yield from _parameter(p)


def _parameter(p: Param) -> Iterator[str]:
    if not (p.name.isidentifier() and p.unit):
        yield f"the parameter {p.name!r} has the unit {p.unit!r}; wanted a name such as 'c' and an SI unit"
    if not 0 < p.sd < np.inf:
        yield f"{p.name}: sd = {p.sd:g}; wanted the standard deviation that is expected of it, above zero"
    elif not (p.per_rate or p.per_run or p.sd <= p.bound):
        yield f"{p.name}: sd = {p.sd:g} beyond bound = {p.bound:g}; wanted at most the largest credible magnitude"
    elif 0 < p.low <= 1e-3 * p.sd:
        yield f"{p.name}: low = {p.low:g} is a step of a difference from zero; wanted 0, or more than sd / 1000"


def _declared(effect: Effect) -> Iterator[str]:
    known = {f.name for f in fields(Motion)}
    for need in effect.needs:
        if need.partition(".")[0] not in known:
            yield f"it needs {need!r}, which no exposure has; wanted fields of insenv.core.motion.Motion"
    if not effect.instruments or not set(effect.instruments) <= set(get_args(Instrument)):
        yield f"instruments = {effect.instruments!r}; wanted some of {', '.join(map(repr, get_args(Instrument)))}"
    if effect.belongs not in get_args(Belongs):
        yield f"belongs = {effect.belongs!r}; wanted one of {', '.join(map(repr, get_args(Belongs)))}"


def _computed(effect: Effect) -> Iterator[str]:
    motion = _motion()
    effect = effect.over(motion)
    theta = _theta(effect, motion)
    if isinstance(effect, LinearEffect):
        _shaped("the basis", effect.basis(motion.rate, motion), (motion.n, len(theta)))
    whole = _shaped("the addition", _addition(effect, motion, theta), (motion.n,))
    if not np.any(whole):
        yield "it adds nothing with any of its parameters; wanted what it does to the output"
    for look in (_zero, _parts, _rows, _flags, _needs):
        yield from look(effect, motion, theta, whole)
    if not isinstance(effect, DrivenEffect):
        yield from _derivative(effect, motion, theta, whole)


def _theta(effect: Effect, motion: Motion) -> Floats:
    """Half a standard deviation of the linear parameters, and shapes from the middle of the grid."""
    linear = [0.5 * p.sd for p in effect.linear]
    if not isinstance(effect, CurveEffect):
        return np.array([*linear, *(0.5 * p.sd for p in effect.shapes)])
    grid = np.asarray(effect.grid(motion), float)
    if grid.ndim != 2 or grid.shape[1] != len(effect.shapes) or not len(grid):
        raise _FaultError(
            f"grid has the shape {grid.shape}; wanted (shapes to try, {len(effect.shapes)}), and at least one"
        )
    if not np.isfinite(grid).all() or any(p.low >= 0 and (grid[:, j] <= 0).any() for j, p in enumerate(effect.shapes)):
        raise _FaultError(
            "grid has values that are not finite, or not above zero where low says so; wanted possible shapes"
        )
    return np.concatenate([linear, grid[len(grid) // 2]])


def _addition(effect: Effect, motion: Motion, theta: Floats, u: Floats | None = None) -> Floats:
    u = motion.rate if u is None else u
    return effect.apply(u, motion, theta, effect.begin(motion, theta), _normals(effect, motion.n, u.shape[:-1]))[0]


def _normals(effect: Effect, n: int, batch: tuple[int, ...] = ()) -> Floats | None:
    if not isinstance(effect, DrivenEffect):
        return None
    return np.random.default_rng(1).standard_normal((*batch, effect.draws, n))


def _shaped(what: str, value: Floats, shape: tuple[int, ...]) -> Floats:
    found = np.shape(value)
    if found != shape:
        raise _FaultError(f"{what} has the shape {found}; wanted {shape}, for an input of {_N} samples")
    if not np.isfinite(value).all():
        raise _FaultError(f"{what} is not finite; wanted a number for every sample")
    return value


def _near(a: Floats, b: Floats, share: float = _ROUNDING) -> bool:
    scale = max(float(np.abs(a).max(initial=0.0)), float(np.abs(b).max(initial=0.0)))
    return bool(np.abs(a - b).max(initial=0.0) <= share * scale)


def _zero(effect: Effect, motion: Motion, theta: Floats, whole: Floats) -> Iterator[str]:
    none = theta.copy()
    none[: len(effect.linear)] = 0.0
    if np.any(_addition(effect, motion, none)):
        yield "with its linear parameters at zero it still adds something; wanted nothing"


def _parts(effect: Effect, motion: Motion, theta: Floats, whole: Floats) -> Iterator[str]:
    """A run that is computed in two parts."""
    z, state, parts = _normals(effect, motion.n), effect.begin(motion, theta), []
    for a, b in ((0, 47), (47, motion.n)):
        noise = None if z is None else z[..., a:b]
        part, state = effect.apply(motion.rate[a:b], motion.interval(a, b), theta, state, noise)
        parts.append(part)
    if not _near(np.concatenate(parts), whole):
        yield "two parts of a run are not the whole; wanted its past in the state, and time from motion.t"


def _rows(effect: Effect, motion: Motion, theta: Floats, whole: Floats) -> Iterator[str]:
    """A batch of two runs, of which the first is the single one."""
    batch = _motion((2,))
    several = theta * np.array([[1.0], [0.7]])
    both = _shaped("the addition of a batch of two runs", _addition(effect, batch, several), (2, motion.n))
    if isinstance(effect, LinearEffect):
        _shaped("the basis of a batch of two runs", effect.basis(batch.rate, batch), (2, motion.n, len(theta)))
    if not isinstance(effect, DrivenEffect) and not _near(both[0], whole):
        yield "a row of a batch is not the run alone; wanted each row to depend on itself"


def _flags(effect: Effect, motion: Motion, theta: Floats, whole: Floats) -> Iterator[str]:
    """What it says that it follows, and what it does follow."""
    if motion.rate_edges is None or isinstance(effect, DrivenEffect):
        return
    within = 1.0 if "rate_edges" in effect.sharpened_by else 1.5
    faster = replace(motion, rate=1.5 * motion.rate, rate_edges=within * motion.rate_edges)
    back = replace(motion, rate=-motion.rate, rate_edges=-motion.rate_edges)
    later = replace(motion, t=motion.t + 0.317 * motion.n * motion.dt)
    looks = {
        # A sense of rotation is the same at any rate; an angle's mean over an interval depends on which way it turns.
        "of_rate": ("the input rate", (faster, back) if effect.of_rate else (faster,)),
        "of_time": ("the time from the start of the run", (later,)),
    }
    for flag, (what, others) in looks.items():
        follows = any(bool(np.any(_addition(effect, other, theta) != whole)) for other in others)
        if follows != getattr(effect, flag):
            verb = "follows" if follows else "does not follow"
            yield f"it {verb} {what}, but {flag} is {not follows}; wanted {flag} = {follows}"


def _needs(effect: Effect, motion: Motion, theta: Floats, whole: Floats) -> Iterator[str]:
    """Whether it does with what it says that it needs."""
    named = {need.partition(".")[0] for need in effect.needs + effect.sharpened_by}
    bare = replace(motion, **{name: value for name, value in _LACKING.items() if name not in named})
    try:
        same = np.array_equal(_addition(effect, bare, theta), whole)
    except Exception:  # whatever another author's code raises without it
        same = False
    if not same:
        more = ", ".join(name for name in _LACKING if name not in named)
        yield f"it depends on one of {more}; wanted it in needs, so that a recording without it is told apart"


def _derivative(effect: Effect, motion: Motion, theta: Floats, whole: Floats) -> Iterator[str]:
    assert isinstance(effect, LinearEffect | CurveEffect)
    shape = (motion.n, len(theta))
    jacobian = _shaped("the jacobian", effect.jacobian(motion.rate, motion, theta), shape)
    if isinstance(effect, LinearEffect):
        if not _near(combine(effect.basis(motion.rate, motion), theta), whole):
            yield "basis times parameters is not the addition; wanted an effect that is linear, or a CurveEffect"
        return
    finer = [replace(p, sd=0.1 * p.sd) for p in effect.params]
    value: Callable[[Floats], Floats] = lambda th: _addition(effect, motion, th)  # noqa: E731 - a name for the type
    expected = central_differences(value, theta, finer)
    for j, param in enumerate(effect.linear):
        if not _near(jacobian[:, j], expected[:, j], _CURVED):
            yield f"its jacobian is not the slope in {param.name}; wanted the derivative, or none of one's own"
    k = len(effect.linear)
    small = theta.copy()
    small[:k] *= 1e-6
    profile = _shaped("the profile", effect.profile(motion.rate, motion, theta[k:]), (motion.n, k))
    # Where a threshold bends it near zero most samples still have to agree.
    off = np.abs(profile @ small[:k] - _addition(effect, motion, small))
    if np.median(off) > _CURVED * float(np.abs(profile @ small[:k]).max(initial=0.0)):
        yield "as its linear parameters vanish it does not become proportional to them; wanted them linear near zero"


def _motion(batch: tuple[int, ...] = ()) -> Motion:
    """A table that swings while all else varies; the rows of a batch differ from the second on."""
    t: Floats = np.arange(_N + 1) * np.float64(_DT)
    phase = 0.7 * np.arange(batch[0])[:, None] if batch else np.zeros(())
    projection = 0.5

    def mean_wave(amplitude: float, frequency: float, shift: float) -> Floats:
        edges = -amplitude / frequency * np.cos(frequency * t + shift + phase)
        return np.diff(edges, axis=-1) / _DT

    # It stands for a while.
    clock = np.where(t < _STOPS, t, np.maximum(_STOPS, t - _STANDS))
    goes = (t < _STOPS) | (t > _STOPS + _STANDS)
    angle = 4.0 * np.sin(0.61 * clock + phase) + 0.05 * clock
    return Motion(
        t=t,
        rate=projection * np.diff(angle, axis=-1) / _DT,
        angle=angle,
        rate_edges=projection * (2.44 * np.cos(0.61 * clock + phase) + 0.05) * goes,
        turn_rate=(2.44 * np.cos(0.61 * clock + phase) + 0.05) * goes,
        temperature=298.15 + 6 * np.sin(0.5 * t + 2 * phase) + 8 * (1 - np.exp(-t / 2)),
        base_tilt=mean_wave(1e-3, 0.4, 0.3),
        across=mean_wave(3.0, 0.35, 0.7),
        force={"x": mean_wave(2.0, 0.3, 0.1), "y": mean_wave(1.0, 0.5, 1.1), "z": 9.8 + mean_wave(0.5, 0.2, 2.0)},
        vibration={axis: 0.5 + mean_wave(0.3, 0.1 * k + 0.2, 0.3 * k) for k, axis in enumerate("xyz")},
        cross_rate={axis: mean_wave(0.2, 0.1 * k + 0.15, 0.4 * k) for k, axis in enumerate("xyz")},
        body_rate={
            axis: 0.4 * np.sin((0.12 * k + 0.2) * clock + 0.5 * k + phase) * goes for k, axis in enumerate("xyz")
        },
        axis="y",
        projection=projection,
    )
