"""The gallery of effects: what each adds to a gyro on a rate table, drawn from the code at the build.

    y_k = white_k + s e_k(u, motion; theta),      s: rms(s e) = rms(white)

Three pictures of each effect e: its trace alone, the Allan deviation and the spectrum of y with those of the white
noise alone beside. The pictures are SVG by hand: a hundred and fifty of them take a few seconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from itertools import groupby
from typing import Any

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.core.series.allan import allan_deviation, log_taus
from insenv.core.units import DEG
from insenv.effects.base import CurveEffect, DrivenEffect, Effect
from insenv.effects.catalogue import ALL

#: Sampling [s] and length [samples] of the test; what the white noise is, per sample.
DT, N = 0.1, 8000
#: Rates of the table, one after the other [deg/s]; time that it takes from one to the next [s].
RATES, RAMP = (0, 10, -10, 20, -20, 40, -40, 5, -5, 15), 4.0
#: Width and height of a picture, and its edges: left, right, top, bottom.
_WIDE, _HIGH, _LEFT, _RIGHT, _TOP, _BOTTOM = 240, 135, 36, 6, 18, 22
_TRACED = 400


def motion() -> Motion:
    """A staircase of rates in both senses while it grows warm; the axis leans by 30 deg."""
    t: Floats = np.arange(N + 1) * np.float64(DT)
    each = t[-1] / len(RATES)
    starts = each * np.arange(1, len(RATES))
    steps = np.diff(RATES) * DEG
    rising = np.clip((t[:, None] - starts) / RAMP, 0.0, 1.0)
    turn: Floats = RATES[0] * DEG + rising @ steps
    angle: Floats = np.concatenate([[0.0], np.cumsum((turn[1:] + turn[:-1]) / 2 * DT)])
    middle = (angle[1:] + angle[:-1]) / 2
    wave = np.sin(2 * np.pi * t[1:] / 90)
    share = 0.5
    return Motion(
        t=t,
        rate=share * np.diff(angle) / DT + 5e-5,
        angle=angle,
        rate_edges=share * turn + 5e-5,
        turn_rate=turn,
        temperature=298.15 + 15 * (1 - np.exp(-t / 200)),
        base_tilt=1e-3 * wave,
        across=9.8 * np.sin(middle),
        force={"x": 4.9 * np.cos(middle), "y": 4.9 * np.sin(middle), "z": 8.5 + 0 * wave},
        vibration=dict.fromkeys("xyz", 0.5 + 0.3 * wave),
        cross_rate={axis: 0.5 * np.cos(middle) * (k + 1) * 0.1 for k, axis in enumerate("xyz")},
        body_rate={axis: share * turn * (k - 0.5) for k, axis in enumerate("xyz")},
        axis="x",
        projection=share,
    )


def pictures() -> str:
    """The page's sections: one for each family of effects."""
    whole = motion()
    white = np.random.default_rng(0).standard_normal(N)
    modules = list(dict.fromkeys(_module(effect) for effect in ALL))
    first = {effect.id: effect for effect in reversed(ALL)}  # an effect with orders is shown with its first
    ordered = sorted(first.values(), key=lambda effect: modules.index(_module(effect)))
    return "\n\n".join(_family(name, list(effects), whole, white) for name, effects in groupby(ordered, key=_module))


def _module(effect: Effect) -> str:
    return type(effect).__module__


def _family(module: str, effects: list[Effect], whole: Motion, white: Floats) -> str:
    from importlib import import_module

    title = (import_module(module).__doc__ or module).strip().partition("\n")[0].rstrip(".:")
    return "\n\n".join([f"## {title}", *(_section(effect, whole, white) for effect in effects)])


def _section(effect: Effect, whole: Motion, white: Floats) -> str:
    what = (type(effect).__doc__ or "").strip().partition("\n")[0]
    head = f"### {effect.id}\n\n{what}"
    lacking = effect.missing(whole)
    if lacking:
        return f"{head}\n\nNot on this test: it needs {', '.join(lacking)}."
    added = addition(effect, whole)
    size = float(np.std(added))
    if not size > 1e-9 * float(np.abs(added).max()):
        return f"{head}\n\nOn this test it adds a constant, or nothing."
    seen = white + added / size
    return f"{head}\n\n" + "".join(
        ('<p class="gallery">', _trace(added / size), _allan(white, seen), _spectrum(white, seen), "</p>")
    )


def addition(effect: Effect, whole: Motion) -> Floats:
    """What an effect adds with half of its prior deviations, and shapes from the middle of its grid, shape (n,)."""
    own = effect.over(whole)
    linear = np.array([0.5 * p.sd for p in own.linear])
    if isinstance(own, CurveEffect):
        grid = own.grid(whole)
        theta = np.concatenate([linear, grid[len(grid) // 2]])
    else:
        theta = np.concatenate([linear, [0.5 * p.sd for p in own.shapes]])
    z = np.random.default_rng(1).standard_normal((own.draws, whole.n)) if isinstance(own, DrivenEffect) else None
    found: Any = own.apply(whole.rate, whole, theta, own.begin(whole, theta), z)[0]
    return np.asarray(found, float) * np.ones(whole.n)


def _trace(added: Floats) -> str:
    """Alone against time: the extremes of each stretch, so that a line at any frequency keeps its size."""
    parts = np.array_split(added, _TRACED // 2)
    t = np.repeat(np.arange(len(parts)) / len(parts) * N * DT, 2)
    y = np.array([edge for part in parts for edge in (part.min(), part.max())])
    return _picture("alone, against time [s]", [(t, y, "added")], False)


def _allan(white: Floats, seen: Floats) -> str:
    taus = log_taus(N, DT, 30)
    curves = []
    for name, y in (("white", white), ("added", seen)):
        found = allan_deviation(y, DT, taus)
        curves.append((found.taus, found.deviation, name))
    return _picture("Allan deviation, against averaging time [s]", curves, True)


def _spectrum(white: Floats, seen: Floats) -> str:
    """Means of the periodogram over bands that are even in the logarithm."""
    f = np.fft.rfftfreq(N, DT)[1:]
    window = np.hanning(N)
    edges = np.geomspace(f[0], f[-1] * 1.001, 60)
    place = np.digitize(f, edges)
    curves = []
    for name, y in (("white", white), ("added", seen)):
        power = np.abs(np.fft.rfft((y - y.mean()) * window))[1:] ** 2 / (window @ window) * DT
        bands = [k for k in range(1, len(edges) + 1) if np.any(place == k)]
        curves.append(
            (
                np.array([f[place == k].mean() for k in bands]),
                np.sqrt([power[place == k].mean() for k in bands]),
                name,
            )
        )
    return _picture("root of spectrum, against frequency [Hz]", curves, True)


def _picture(title: str, curves: list[tuple[Floats, Floats, str]], log: bool) -> str:
    x = np.concatenate([c[0] for c in curves])
    y = np.concatenate([c[1] for c in curves])
    across, up = _scale(x, _LEFT, _WIDE - _RIGHT, log, 0.0), _scale(y, _HIGH - _BOTTOM, _TOP, log, 0.06)
    parts = [f'<text x="2" y="11">{escape(title)}</text>']
    for value in _ticks(float(y.min()), float(y.max()), log):
        parts.append(f'<path class="grid" d="M{_LEFT} {up(value):.1f}H{_WIDE - _RIGHT}"/>')
        parts.append(f'<text x="{_LEFT - 4}" y="{up(value) + 3:.1f}" text-anchor="end">{_number(value)}</text>')
    for value in _ticks(float(x.min()), float(x.max()), log):
        parts.append(f'<text x="{across(value):.1f}" y="{_HIGH - 8}" text-anchor="middle">{_number(value)}</text>')
    for at, values, name in curves:
        line = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(across(at), up(values), strict=True))
        parts.append(f'<path class="{name}" d="M{line}"/>')
    label = f"{title}: {'with it and of the white noise alone' if len(curves) > 1 else 'what it adds'}"
    return f'<svg viewBox="0 0 {_WIDE} {_HIGH}" role="img" aria-label="{escape(label)}">{"".join(parts)}</svg>'


def _scale(values: Floats, first: float, last: float, log: bool, room: float) -> Any:
    of = np.log if log else np.asarray
    low, high = of(float(values.min())), of(float(values.max()))
    low, high = low - room * (high - low or 1.0), high + room * (high - low or 1.0)
    return lambda value: first + (last - first) * (of(value) - low) / (high - low)


def _ticks(low: float, high: float, log: bool) -> Iterator[float]:
    """Decades, every second of them where there are many; or a few round numbers."""
    if log:
        powers = range(int(np.ceil(np.log10(low) - 1e-9)), int(np.floor(np.log10(high) + 1e-9)) + 1)
        yield from (10.0**p for p in powers[:: 1 + len(powers) // 5])
        return
    step = next(s * 10.0**p for p in range(-3, 6) for s in (1, 2, 5) if (high - low) / (s * 10.0**p) <= 4)
    yield from (k * step for k in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1))


def _number(value: float) -> str:
    return f"{value:g}".replace("-", "−")
