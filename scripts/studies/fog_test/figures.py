"""Figures 1 to 7 of the published gyro test, simulated; bias stability by averaging time; policies."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter
from studies.fog_test.campaigns import (
    LONG,
    NAMES,
    PROCESSES,
    Campaign,
    Line,
    each,
    envelope,
    long_rest,
    per_hour,
    raw_rest,
    stability,
)
from studies.fog_test.tables import NOISE, Campaigns, averaging, closed_form, policy_verdict
from studies.rate_table.policies import DISTURBED, POLICIES, Row, pull_in, study
from studies.rate_table.policy_runs import random_faults
from studies.result_page import Section, table

from insenv.core.rate_test import StaticResult
from insenv.core.recording import Floats
from insenv.core.units import ARCSEC, DEG, DEG_PER_SQRT_HOUR, PPM
from insenv.trust.rates import Rate

_BLUE, _ORANGE, _GREY = "#0072B2", "#E69F00", "#666666"
_COLOURS = {"b215": _BLUE, "kvh13": _ORANGE}
#: Where the names of policies stand beside their points, and which end of them is there.
_BESIDE = {
    "sweep_and_refine": ((0, 14), "left"),
    "greedy_information": ((0, -16), "left"),
    "published_ladder": ((-10, 0), "right"),
}
#: Parts that the 27 hours are drawn in.
_PARTS = 400


def curves(played: Campaigns) -> Section:
    """Figures 1, 2 and 3: nonlinearity by rate."""
    b, k = played["b215"][0].ladder, played["kvh13"][0].ladder
    drawn, axes = _panels(3)
    shown = (
        (b.rates, b.residuals, "1: B-215"),
        (k.rates, k.residuals, "2: KVH-13"),
        (b.without_rates, b.without_residuals, "3: B-215 without ±20 deg/s"),
    )
    for ax, (rates, left, words) in zip(axes, shown, strict=True):
        ax.plot(rates / DEG, _ppm(left, rates).T, color=_GREY, lw=0.5, alpha=0.6)
        ax.plot(rates / DEG, _ppm(left.mean(axis=0), rates), ".-", color=_BLUE, lw=1.4, ms=5)
        ax.set(title=f"Figure {words}", ylabel="deviation / largest\noutput [ppm]")
    axes[-1].set_xlabel("rate [deg/s]")
    return Section(
        "Figures 1 to 3: nonlinearity by rate",
        ("First campaign: seven repeats (grey) and their mean (blue).",),
        f"All points of the B-215 are within {_range(b):.0f} ppm of each other, those of the KVH-13 within "
        f"{_range(k):.0f}, and those of the B-215, fitted anew without two of its rates, within "
        f"{np.ptp(_ppm(b.without_residuals, b.rates)):.0f}.",
        {"fog_test_fig1_3": drawn},
    )


def at_rest(seed: int) -> Section:
    """Figures 4, 5 and 6: six minutes at rest."""
    t, y = raw_rest("b215", seed)
    tk, yk = raw_rest("kvh13", seed)
    smooth = y.reshape(-1, 20).mean(axis=1)
    shown = (
        (t, y, "4: B-215, 2000 Hz", "b215", 0.0005),
        (t[19::20], smooth, "5: B-215, means over 10 ms", "b215", 0.01),
        (tk, yk, "6: KVH-13, 100 Hz", "kvh13", 0.01),
    )
    drawn, axes = _panels(3)
    rows = []
    for ax, (when, value, words, name, tau) in zip(axes, shown, strict=True):
        ax.plot(when, per_hour(1.0) * value, color=_COLOURS[name], lw=0.2, rasterized=True)
        ax.set(title=f"Figure {words}", ylabel="output [deg/h]")
        form = per_hour(closed_form(tau, *NOISE[name]))
        spread = per_hour(float(value.std(ddof=1)))
        rows.append((words[3:], f"{spread:.2f}", f"{form:.2f}", f"{100 * (spread / form - 1):+.2f} %"))
    axes[-1].set_xlabel("time [s]")
    ratio = float(y.std() / smooth.std())
    return Section(
        "Figures 4 to 6: six minutes at rest",
        table(("", "bias stability [deg/h]", "closed form", "difference"), rows),
        f"Means of 20 samples are more stable by a factor of {ratio:.1f}, not by sqrt(20) = {20**0.5:.1f}: the ratio "
        "shows that quantisation, which falls with the time and not with its root, makes up most of the samples' "
        "noise. A random walk is not to be had from the stability of 10 ms.",
        {"fog_test_fig4_6": drawn},
    )


def long_test(seed: int) -> Section:
    """Figure 7: 27 hours of both, each at its own rate for the noise, and in 10 ms for the picture."""
    results = dict(zip(NAMES, each(long_rest, [(name, seed, None) for name in NAMES], "record"), strict=True))
    bands = each(envelope, [(name, seed, _PARTS) for name in NAMES], "record")
    drawn, axes = _panels(2)
    for ax, (name, words), (t, low, mean, high) in zip(axes, NAMES.items(), bands, strict=True):
        ax.fill_between(t / 3600, per_hour(1.0) * low, per_hour(1.0) * high, color=_COLOURS[name], alpha=0.3, lw=0)
        ax.plot(t / 3600, per_hour(1.0) * mean, color=_COLOURS[name], lw=1.4)
        ax.set(title=words, ylabel="output [deg/h]")
    axes[-1].set_xlabel("time since the power-up [h]")
    rows = [row for name, result in results.items() for row in _long_rows(name, result)]
    rise = {name: result.warm_up.rise.value if result.warm_up else np.nan for name, result in results.items()}
    walk = {
        name: result.allan.coefficients["angle_random_walk"].value / DEG_PER_SQRT_HOUR / NOISE[name][0] - 1
        for name, result in results.items()
    }
    return Section(
        "Figure 7: 27 hours at rest",
        (
            f"Least and largest 10-ms mean (shaded) and mean of each {LONG / _PARTS:.0f} s. The table is of the whole "
            "records, 194 and 9.7 million samples at the instruments' own rates, streamed.",
            "",
            *table(("", "", "here", "model", "difference"), rows),
        ),
        f"From the first five minutes to the last hour the KVH-13 rises by {per_hour(rise['kvh13']):.1f} deg/h and the "
        f"B-215 by {per_hour(rise['b215']):+.1f}. The B-215's band is the wider one, which the paper reads as a worse "
        "bias: it is white noise and quantisation of 10 ms. "
        f"The KVH-13's stability of 10 ms is above its form, in squares, by {_above('kvh13', results['kvh13']):.1f} "
        f"deg/h: its means over 100 s vary by {per_hour(stability(results['kvh13'], 100.0)):.1f}, the warm-up. The "
        f"random walk comes back within {100 * max(abs(value) for value in walk.values()):.3f} %.",
        {"fog_test_fig7": drawn},
    )


def _above(name: str, result: StaticResult) -> float:
    """What the stability of 10 ms has beside noise [deg/h]."""
    square = stability(result, 0.01) ** 2 - closed_form(0.01, *NOISE[name]) ** 2
    return per_hour(float(np.sqrt(max(square, 0.0))))


def _long_rows(name: str, result: StaticResult) -> list[tuple[str, ...]]:
    walk, pulse = NOISE[name]
    rows: list[tuple[str, ...]] = []
    for tau in (0.0005, 0.01) if name == "b215" else (0.01,):
        form, found = per_hour(closed_form(tau, walk, pulse)), per_hour(stability(result, tau))
        words = f"bias stability, {1000 * tau:g} ms [deg/h]"
        rows.append((NAMES[name], words, f"{found:.2f}", f"{form:.2f}", f"{100 * (found / form - 1):+.2f} %"))
    noise = result.allan.coefficients
    kinds = (("angle_random_walk", walk, DEG_PER_SQRT_HOUR, "deg/sqrt(h)"), ("quantization", pulse, ARCSEC, "arcsec"))
    for kind, true, unit, label in kinds:
        if true:
            value = noise[kind].value / unit
            words = f"{kind.replace('_', ' ')} [{label}]"
            rows.append((NAMES[name], words, f"{value:.4f}", f"{true:g}", f"{100 * (value / true - 1):+.2f} %"))
    return rows


def averaging_time(played: Campaigns) -> Section:
    """Bias stability by averaging time, with its table."""
    drawn, (ax,) = _panels(1)
    drawn.set_figheight(4.2)
    for name, words in NAMES.items():
        for settled, style in ((False, "-"), (True, "--")):
            taus, values = _curve(played[name], settled)
            label = f"{words}, {'after 3 h' if settled else 'from the power-up on'}"
            ax.loglog(taus, per_hour(1.0) * values, style, marker=".", color=_COLOURS[name], label=label)
    ax.axvline(0.01, color=_GREY, lw=0.8, ls=":")
    ax.set(xlabel="averaging time [s] (dotted: the paper's)", ylabel="bias stability [deg/h]")
    ax.legend(frameon=False)
    return replace(averaging(played), pictures={"fog_test_averaging": drawn})


def _curve(played: Sequence[Campaign], settled: bool) -> tuple[Floats, Floats]:
    """Averaging times [s] and medians [rad/s]; below a second of the six minutes, where the warm-up does not matter."""
    long = [
        (s.averaging, float(np.median([stability(c.long, s.averaging, settled) for c in played])))
        for s in played[0].long.stability
        if s.averaging >= 1.0
    ]
    short = [] if settled else [(0.01, float(np.median([stability(c.short, 0.01) for c in played])))]
    taus, values = np.array([*short, *long]).T
    return taus, values


def policy_section(faulty: int, clean: int, disturbed: int) -> Section:
    """Which rates to take where nobody knows at which one the fault is."""
    rows, feel = _policy_study(faulty, clean, disturbed)
    spoiled = [label for label, row in feel.items() if row.found < 0.99 or row.false_alarms > 0]
    hurt = {label: row.scale_factor_rms / PPM for label, row in feel.items()}
    told = [replace(row, policy=label) for label, row in feel.items()]
    return Section(
        "Policies for a fault at an unknown rate",
        (
            f"{faulty} runs with a fault as that at 20 deg/s, its centre uniform, and {clean} without one; one power-"
            "up of the published list, judged at its end. `van_der_corput` and `greedy_information` could stop at the "
            "first alarm.",
            "",
            *_policy_rows(rows),
            "",
            f"`sweep_and_refine` on tables and gyros with faults, {disturbed} runs with and without:",
            "",
            *_policy_rows(told, "fault of the table or gyro"),
        ),
        policy_verdict(rows)
        + (f" It misses faults or alarms falsely with: {', '.join(spoiled)}." if spoiled else "")
        + f" Its K is off by {min(hurt.values()):.1f} ppm rms at best and by {max(hurt.values()):.1f} with: "
        f"{max(hurt, key=lambda label: hurt[label])}. Where the fault is a lock of 0.0345 deg/s half width, pulling in "
        f"moves the mean of a second off Adler's law by {_pull_in():.2%} of that at most.",
        {"fog_test_policies": policy_picture(rows, faulty)},
    )


def _pull_in() -> float:
    """Largest error of a dwell by what pulling in costs, in half widths: 1 km of fibre, steps of 2 pi / 16."""
    half_width, transit, scale = 0.0345 * DEG, 4.9e-6, 1.119
    error = pull_in(np.linspace(-3, 3, 25) * half_width, half_width, 16 * scale * half_width / transit)
    return float(error.max() / half_width)


def _policy_study(faulty: int, clean: int, disturbed: int) -> tuple[list[Row], dict[str, Row]]:
    """The policies, and the sweep on tables with faults, by two processes."""
    runs, sound = random_faults(faulty), random_faults(clean, 2, height=0.0)
    few, few_sound = random_faults(disturbed), random_faults(disturbed, 2, height=0.0)
    with ProcessPoolExecutor(PROCESSES) as pool:
        each_policy = [pool.submit(study, name, runs, sound) for name in POLICIES]
        feel = {
            label: pool.submit(partial(study, table=on), "sweep_and_refine", few, few_sound)
            for label, on in DISTURBED.items()
        }
        return [job.result() for job in each_policy], {label: job.result() for label, job in feel.items()}


def _policy_rows(rows: Sequence[Row], label: str = "policy") -> tuple[str, ...]:
    """A table of the study."""
    cells = [
        (
            row.policy, f"{row.found:.2f}", f"{row.false_alarms:.3f}", f"{row.time:.0f}",
            "" if np.isnan(row.first) else f"{row.first:.0f}",
            f"{row.scale_factor_rms / PPM:.2f}", f"{row.scale_factor_sd / PPM:.2f}",
        )
        for row in rows
    ]  # fmt: skip
    head = (label, "found", "false alarms", "time [s]", "first alarm [s]", "K, rms error [ppm]", "K, claimed [ppm]")
    return table(head, cells)


def policy_picture(rows: Sequence[Row], runs: int) -> Figure:
    """Faults found, of so many runs, with exact 95 % intervals, against the time of the test."""
    drawn, (ax,) = _panels(1)
    for row in rows:
        colour = _ORANGE if row.policy == "published_ladder" else _BLUE
        bars = np.abs(np.array(Rate(round(row.found * runs), runs).interval) - row.found)
        ax.errorbar(row.time, row.found, yerr=bars[:, None], fmt="o", ms=7, capsize=3, color=colour)
        (across, up), side = _BESIDE.get(row.policy, ((10, 0), "left"))
        ax.annotate(
            row.policy, (row.time, row.found), xytext=(across, up), textcoords="offset points", ha=side, va="center"
        )
    ax.set(xlabel="median time of the test [s]", ylabel="share of the faults found", ylim=(-0.1, 1.2), xlim=(0, 4500))
    ax.set_yticks(np.linspace(0, 1, 6))
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_title("bars: exact 95 % intervals")
    return drawn


def _ppm(left: Floats, rates: Floats) -> Floats:
    shown: Floats = left / np.abs(rates).max() / PPM
    return shown


def _range(line: Line) -> float:
    return float(np.ptp(_ppm(line.residuals, line.rates)))


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    drawn = Figure(figsize=(7.2, 2.2 + 1.7 * count), layout="constrained")
    axes = list(drawn.subplots(count, 1, sharex=True, squeeze=False)[:, 0])
    for ax in axes:
        ax.grid(True, color="#dddddd", lw=0.6)
        ax.title.set_fontsize(10)
    return drawn, axes
