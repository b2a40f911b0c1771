"""Rate tests as tables of texts, in the units of a laboratory: deg/s, deg/h, ppm, deg/sqrt(h)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from insenv.core.quantities import last_digit, number, span, with_sd
from insenv.core.rate_test import (
    NORMALISATIONS,
    Dwell,
    LineFit,
    RateLineResult,
    RateTest,
    StaticResult,
    Valued,
)
from insenv.core.series.allan import FLICKER, QUANTIZATION, WALK, WHITE
from insenv.core.units import (
    ARCSEC,
    DEG,
    DEG_PER_HOUR,
    DEG_PER_HOUR_PER_SQRT_HOUR,
    DEG_PER_SQRT_HOUR,
    PPM,
    ZERO_CELSIUS,
)

#: Units and factors of the Allan coefficients.
COEFFICIENTS = {
    QUANTIZATION: ("quantisation Q", "arcsec", ARCSEC),
    WHITE: ("angle random walk N", "deg/√h", DEG_PER_SQRT_HOUR),
    FLICKER: ("bias instability B", "deg/h", DEG_PER_HOUR),
    WALK: ("rate random walk K", "deg/h/√h", DEG_PER_HOUR_PER_SQRT_HOUR),
    "rate_ramp": ("rate ramp R", "deg/h/h", DEG_PER_HOUR / 3600.0),
}
NONE = "—"


@dataclass(frozen=True)
class Grid:
    """A table: headings and rows; the first column is left-aligned."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def valued(value: Valued, factor: float) -> str:
    """``value ± sd`` in a unit, without a power of ten below a million."""
    if not math.isfinite(value.value):
        return NONE
    shown, sd = value.value / factor, value.sd / factor
    if 0 < sd < math.inf and 1e3 <= abs(shown) < 1e6 and (last := last_digit(sd)) > 0:
        return f"{round(shown, -last):.0f} ± {round(sd, -last):.0f}"
    return with_sd(shown, sd)


def comparison(tests: Sequence[RateTest]) -> Grid:
    """Instruments side by side, as in the paper's table 5."""
    rows = [
        ("scale-factor error K − 1, without flagged [ppm]", [_error(t, "without flagged") for t in tests]),
        ("nonlinearity, all points, largest of the power-ups [ppm]", [_largest(t, "all points") for t in tests]),
        ("the same without flagged points [ppm]", [_largest(t, "without flagged") for t in tests]),
        ("nonlinearity of the means, all points [ppm]", [_of_means(t, "all points") for t in tests]),
        ("asymmetry, without flagged [ppm]", [_asymmetry(t) for t in tests]),
        ("scale-factor repeatability [ppm]", [_repeats(t) for t in tests]),
        ("bias, Earth rate in it [deg/h]", [_static(t, lambda s: valued(s.bias, DEG_PER_HOUR)) for t in tests]),
        ("bias, Earth rate removed [deg/h]", [_static(t, _without_earth) for t in tests]),
        ("bias repeatability [deg/h]", [valued(t.bias_repeatability, DEG_PER_HOUR) for t in tests]),
        *_stabilities(tests),
        *(_coefficient(tests, key) for key in COEFFICIENTS),
        ("floor of the Allan deviation / 0.664 [deg/h]", [_static(t, lambda s: _floor(s)) for t in tests]),
    ]
    shown = [(name, *cells) for name, cells in rows if any(cell != NONE for cell in cells)]
    return Grid(("", *(t.title for t in tests)), tuple(shown))


def _error(test: RateTest, method: str) -> str:
    return NONE if test.line is None else k_error(test.line.fit(method))


def k_error(fit: LineFit) -> str:
    """K - 1 [ppm]."""
    k = fit.scale_factor
    return valued(Valued(k.value - 1, k.sd), PPM)


def largest(line: RateLineResult, method: str, key: str = "largest_output") -> Valued:
    """The largest nonlinearity of the power-ups."""
    return max((fit.nonlinearity[key] for fit in line.of_each(method)), key=lambda v: v.value, default=Valued())


def _largest(test: RateTest, method: str) -> str:
    return NONE if test.line is None else valued(largest(test.line, method), PPM)


def _of_means(test: RateTest, method: str) -> str:
    return NONE if test.line is None else valued(test.line.fit(method).nonlinearity["largest_output"], PPM)


def _asymmetry(test: RateTest) -> str:
    return NONE if test.line is None else valued(test.line.fit("without flagged").asymmetry, PPM)


def _repeats(test: RateTest) -> str:
    return NONE if test.line is None else valued(test.line.repeatability["without flagged"], PPM)


def _static(test: RateTest, pick) -> str:  # type: ignore[no-untyped-def]
    return NONE if test.static is None else str(pick(test.static))


def _without_earth(static: StaticResult) -> str:
    return valued(static.bias_without_earth, DEG_PER_HOUR)


def _stabilities(tests: Sequence[RateTest]) -> Iterator[tuple[str, list[str]]]:
    """One row for each averaging time that any test has."""
    times = sorted({round(s.averaging, 9) for t in tests if t.static for s in t.static.stability})
    for tau in times:
        cells = []
        for test in tests:
            there = [s for s in test.static.stability if abs(s.averaging - tau) < 1e-9] if test.static else []
            cells.append(valued(there[0].value, DEG_PER_HOUR) if there else NONE)
        yield f"bias stability, means over {span(tau)} [deg/h]", cells


def _coefficient(tests: Sequence[RateTest], key: str) -> tuple[str, list[str]]:
    name, unit, factor = COEFFICIENTS[key]
    found = [t.static.allan.coefficients.get(key, Valued()) if t.static else Valued() for t in tests]
    return f"{name} [{unit}]", [coefficient(v, factor) for v in found]


def _floor(static: StaticResult) -> str:
    return valued(static.allan.floor, DEG_PER_HOUR)


def of_the_model(static: StaticResult) -> str:
    """Sentence on how well the terms describe the Allan deviation; nothing where they do, all of it, as they stand."""
    found = static.allan
    if len(found.coefficients) and all(math.isnan(c.value) for c in found.coefficients.values()):
        return "no sum of the terms fits the Allan deviation (chi-square): none of their figures is given"
    parts = []
    if found.left_out:
        least = found.taus[found.left_out]
        parts.append(f"the terms hold from {span(float(least))} on; below it there are filters, lines or sway")
    for term in found.others:
        if term.kind == "markov":
            parts.append(f"with a Markov term of correlation time {span(term.shape)}")
        else:
            parts.append(f"with a sinusoid of {number(term.shape)} Hz")
    return "; ".join(parts)


def coefficient(value: Valued, factor: float) -> str:
    """A coefficient with its deviation; of one below two of them what may be hidden: two deviations above it."""
    if value.value < 2 * value.sd:
        return f"< {number((value.value + 2 * value.sd) / factor, 2)}"
    return valued(value, factor)


def fits(line: RateLineResult) -> Grid:
    """The line by each method."""
    head = (
        "line through", "points", "K − 1 [ppm]", "F₀ [deg/h]", "bias [deg/h]", "K_n of means [ppm]",
        "K_n largest of power-ups [ppm]", "noise alone [ppm]", "K_a [ppm]", "K_r [ppm]",
    )  # fmt: skip
    rows = tuple(
        (
            fit.method,
            str(int((fit.weights > 0).sum())),
            k_error(fit),
            valued(fit.offset, DEG_PER_HOUR),
            valued(fit.bias, DEG_PER_HOUR),
            valued(fit.nonlinearity["largest_output"], PPM),
            valued(largest(line, fit.method), PPM),
            number(fit.noise_alone / PPM),
            valued(fit.asymmetry, PPM),
            valued(line.repeatability[fit.method], PPM),
        )
        for fit in line.fits
    )
    return Grid(head, rows)


def normalisations(line: RateLineResult) -> Grid:
    """Nonlinearity of the means by each normalisation and method."""
    methods = tuple(fit.method for fit in line.fits)
    rows = tuple(
        (words, *(valued(fit.nonlinearity[key], PPM) for fit in line.fits)) for key, words in NORMALISATIONS.items()
    )
    return Grid(("nonlinearity of the means [ppm]", *methods), rows)


def rates(line: RateLineResult) -> Grid:
    """Deviation of every rate from the line without flagged points: of the means, and of each power-up."""
    fit = line.fit("without flagged")
    each = line.of_each("without flagged")
    flagged = {round(f.rate, 6) for f in line.flagged}
    head = ("rate [deg/s]", "mean output [deg/s]", "deviation [ppm]", *(f"#{one.power_up} [ppm]" for one in each), "")
    top = fit.scale_factor.value * float(np.abs(fit.rates).max())
    rows = []
    for j, rate in enumerate(fit.rates):
        output = fit.scale_factor.value * rate + fit.offset.value + fit.residuals[j]
        deviations = (_deviation(one, float(rate)) for one in each)
        shown = with_sd(fit.residuals[j] / top / PPM, fit.sd[j] / top / PPM)
        mark = "flagged" if round(float(rate), 6) in flagged else ""
        rows.append((f"{rate / DEG:+.4f}", f"{output / DEG:+.6f}", shown, *deviations, mark))
    return Grid(head, tuple(rows))


def _deviation(fit: LineFit, rate: float) -> str:
    """A power-up's deviation at a rate, in ppm of its fitted output at the largest."""
    if not len(fit.rates) or abs(fit.rates[j := int(np.abs(fit.rates - rate).argmin())] - rate) > 0.05 * DEG:
        return NONE
    top = fit.scale_factor.value * float(np.abs(fit.rates).max())
    sd = abs(fit.sd[j] / top) / PPM
    places = 1 if sd < 3.55 else 0
    return f"{round(fit.residuals[j] / top / PPM, places) + 0.0:.{places}f}"


def power_ups(line: RateLineResult) -> Grid:
    """Each power-up's own line."""
    head = (
        "power-up",
        "K − 1, all [ppm]",
        "without flagged [ppm]",
        "K_n, all [ppm]",
        "without flagged [ppm]",
        "K_a [ppm]",
    )
    both = zip(line.of_each("all points"), line.of_each("without flagged"), strict=True)
    rows = tuple(
        (
            f"#{a.power_up}",
            k_error(a),
            k_error(b),
            valued(a.nonlinearity["largest_output"], PPM),
            valued(b.nonlinearity["largest_output"], PPM),
            valued(b.asymmetry, PPM),
        )
        for a, b in both
    )
    return Grid(head, rows)


def dwells(line: RateLineResult) -> Grid:
    """Every dwell as it was averaged, rests too."""
    head = (
        "power-up",
        "start [s]",
        "rate [deg/s]",
        "turns",
        "averaged [s]",
        "output [deg/s]",
        "static output [deg/h]",
        "sd [deg/h]",
        "temperature [degC]",
    )
    every = sorted({*line.dwells, *line.zeros}, key=lambda d: (d.power_up, d.start))
    return Grid(head, tuple(map(_dwell, every)))


def _dwell(d: Dwell) -> tuple[str, ...]:
    warmth = f"{d.temperature - ZERO_CELSIUS:.2f}" if math.isfinite(d.temperature) else NONE
    return (
        f"#{d.power_up}", f"{d.start:.1f}", f"{d.rate / DEG:+.5f}", str(d.turns or NONE), f"{d.duration:.2f}",
        f"{d.output / DEG:+.6f}", f"{d.zero / DEG_PER_HOUR:.3f}", f"{d.sd / DEG_PER_HOUR:.3f}", warmth,
    )  # fmt: skip


def stability(static: StaticResult) -> Grid:
    """Bias stability by averaging time."""
    left = f"after {span(static.warm_up_left_out)}"
    settled = bool(static.warm_up_left_out)
    head = ("means over", "number", "bias stability [deg/h]", *((left + " [deg/h]",) if settled else ()))
    rows = tuple(
        (
            span(s.averaging),
            str(s.count),
            valued(s.value, DEG_PER_HOUR) + (" (too few to tell)" if s.count < 10 else ""),
            *((valued(s.settled, DEG_PER_HOUR),) if settled else ()),
        )
        for s in static.stability
    )
    return Grid(head, rows)


def biases(test: RateTest) -> Grid:
    """Bias and what was done about the Earth rate, and its repeatability."""
    static = test.static
    assert static is not None
    rows = [
        ("bias B₀, Earth rate in it [deg/h]", valued(static.bias, DEG_PER_HOUR)),
        ("bias B₀, Earth rate removed [deg/h]", valued(static.bias_without_earth, DEG_PER_HOUR)),
        (
            f"bias repeatability B_r of {len(test.bias_of_power_ups)} power-ups [deg/h]",
            valued(test.bias_repeatability, DEG_PER_HOUR),
        ),
    ]
    warm = static.warm_up
    if warm is not None:
        rows += [
            ("change from the first to the last means [deg/h]", valued(warm.rise, DEG_PER_HOUR)),
            ("exponential of the warm-up: amplitude [deg/h]", valued(warm.amplitude, DEG_PER_HOUR)),
            ("exponential of the warm-up: time constant [s]", valued(warm.time_constant, 1.0)),
            (f"within {number(warm.limit / DEG_PER_HOUR)} deg/h of the end after [s]", f"{warm.settled:.0f}"),
        ]
    return Grid(("", ""), tuple(rows))


def allan(static: StaticResult) -> Grid:
    """Coefficients of the Allan deviation."""
    rows = tuple(
        (COEFFICIENTS[key][0], coefficient(value, COEFFICIENTS[key][2]), COEFFICIENTS[key][1])
        for key, value in static.allan.coefficients.items()
    )
    if math.isfinite(static.allan.floor.value):
        at = span(static.allan.floor_at)
        rows += ((f"floor of the deviation / 0.664, at {at}", _floor(static), "deg/h"),)
    return Grid(("coefficient", "value", "unit"), rows)
