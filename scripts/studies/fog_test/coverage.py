r"""How many faults at an unknown rate a fixed list of rates can meet: a matter of geometry.

A fault A exp(-(|u| - u0)^2 / (2 s^2)) is seen at a rate of the list where it is larger than the alarm a there, so

    |u_j - u0| < h = s sqrt(2 ln(A / a))

and of faults whose centre is uniform the share that is found is that of the range which the intervals u_j +- h cover.
Noise and the bend of the line, both small beside the alarm, are left out.
"""

from __future__ import annotations

from math import exp, log, sqrt

import numpy as np
from scipy.optimize import brentq
from studies.fog_test.campaigns import LADDER
from studies.rate_table.policies import ALARM, POLICIES, judged
from studies.rate_table.policy_runs import BETWEEN, HEIGHT, WIDTH, play, random_faults
from studies.result_page import Section, table

from insenv.core.units import DEG, PPM

#: Alarms and widths of the fault that the table has [rad/s].
_ALARMS = tuple(a * DEG for a in (0.003, 0.005, 0.0085, 0.010, 0.015))
_WIDTHS = tuple(s * DEG for s in (0.1, 0.22, 0.5))
#: Share that the published list is said to find.
_SAID = 0.28
_SIMULATED, _FULL = 300, 35 * DEG


def reach(alarm: float, width: float, height: float = HEIGHT) -> float:
    """Distance [rad/s] at which a fault is as large as the alarm."""
    return width * sqrt(2 * log(height / alarm))


def covered(distance: float) -> float:
    """Share of the range of centres that is nearer than ``distance`` [rad/s] to a rate of the list."""
    low, high = BETWEEN
    edges = [(max(low, r * DEG - distance), min(high, r * DEG + distance)) for r in LADDER if r]
    total, end = 0.0, low
    for start, stop in sorted(edges):
        total += max(0.0, stop - max(start, end))
        end = max(end, stop)
    return total / (high - low)


def coverage(width: float = WIDTH) -> Section:
    """What the published list finds, by alarm and width of the fault."""
    runs = random_faults(_SIMULATED, seed=3)
    played = play(POLICIES["published_ladder"], runs)
    rows = []
    for alarm in _ALARMS:
        seen = float(np.mean([judged(played, row, alarm=alarm) for row in range(_SIMULATED)]))
        shares = [f"{covered(reach(alarm, s)):.1%}" for s in _WIDTHS]
        words = f"{alarm / DEG:g}", f"{alarm / _FULL / PPM:.0f}", f"{reach(alarm, width) / DEG:.2f}"
        rows.append((*words, *shares, f"{seen:.1%}"))
    wanted = float(brentq(lambda h: covered(h) - _SAID, 0.01 * DEG, 1 * DEG))
    fits = HEIGHT * exp(-(wanted**2) / (2 * width**2))
    head = ("alarm [deg/s]", "of 35 deg/s [ppm]", "reach [deg/s]", *(f"width {s / DEG:g}" for s in _WIDTHS))
    return Section(
        "What the published list can find",
        (
            "Share of faults of 0.033718 deg/s that some rate of the list meets, their centre uniform in "
            f"{BETWEEN[0] / DEG:g} to {BETWEEN[1] / DEG:g} deg/s: by geometry for three widths [deg/s], and of "
            f"{_SIMULATED} simulated tests for a width of {width / DEG:g}. Reach: how far off a rate is seen, at that "
            "width.",
            "",
            *table((*head, "simulated"), rows),
        ),
        f"Which share is found is what alarms. With the {ALARM / DEG:g} deg/s of this page it is "
        f"{covered(reach(ALARM, width)):.1%} (standard error of the simulated share {50 / sqrt(_SIMULATED):.0f} % at "
        f"most); {_SAID:.0%} belongs to an alarm at {fits / DEG:.4f} deg/s, {fits / _FULL / PPM:.0f} ppm of 35 deg/s. "
        "No alarm that noise leaves free makes a list of 17 magnitudes meet more than half of such faults.",
    )
