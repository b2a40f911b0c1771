"""The static output of a rate test: which rests it is taken from, and what is taken off each dwell.

``ends`` is the mean of the first and the last rest of a power-up; ``interleaved`` the line between the two nearest in
time, where the rests scatter more than their noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from insenv.core.rate_test import Dwell, Valued
from insenv.core.units import DEG

#: A table that turns less than this is at rest [rad/s].
REST = 0.005 * DEG
#: Probability below which rests that scatter are interleaved.
DRIFT = 0.01


def method(rests: list[Dwell], wanted: str) -> tuple[str, str]:
    """How the static output is taken off, and why."""
    if not rests:
        return "none", "the table never rested"
    if wanted != "auto":
        return wanted, "as asked for"
    square, freedom = 0.0, 0
    for mine in _by_power_up(rests).values():
        if len(mine) > 2:
            w = np.array([r.sd**-2 for r in mine if r.sd > 0] or [1.0])
            y = np.array([r.output for r in mine if r.sd > 0] or [0.0])
            square += float((w * (y - (w * y).sum() / w.sum()) ** 2).sum())
            freedom += len(y) - 1
    if not freedom:
        return "ends", "a power-up has no rest between its first and its last"
    from scipy.special import chdtrc  # slow to import

    p = float(chdtrc(freedom, square))
    if p < DRIFT:
        return "interleaved", f"the rests scatter more than their noise (p = {p:.2g})"
    return "ends", f"the rests scatter no more than their noise (p = {p:.2g})"


def _by_power_up(dwells: list[Dwell]) -> dict[int, list[Dwell]]:
    groups: dict[int, list[Dwell]] = {}
    for d in dwells:
        groups.setdefault(d.power_up, []).append(d)
    return {q: sorted(group, key=lambda d: d.start) for q, group in groups.items()}


def level(rests: list[Dwell], method: str) -> tuple[Valued, bool]:
    """Mean static output that was taken off, over the power-ups, and whether any was."""
    if method == "none":
        return Valued(0.0, 0.0), False
    used = [
        [mine[0], mine[-1]] if method == "ends" and len(mine) > 1 else mine for mine in _by_power_up(rests).values()
    ]
    means = [np.mean([r.output for r in mine]) for mine in used]
    variances = [np.mean([r.sd**2 for r in mine]) / len(mine) for mine in used]
    return Valued(float(np.mean(means)), float(np.sqrt(np.mean(variances) / len(used)))), True


def point(d: Dwell, rests: list[Dwell], method: str) -> Dwell | None:
    """A dwell with its static output; None for a rest that is itself taken for it."""
    mine = sorted((r for r in rests if r.power_up == d.power_up), key=lambda r: r.start) or rests
    at_rest = abs(d.rate) < REST
    if method == "none":
        return replace(d, rate=0.0 if at_rest else d.rate)
    if method == "ends":
        if at_rest and (d == mine[0] or d == mine[-1]):
            return None
        return replace(d, rate=0.0 if at_rest else d.rate, zero=0.5 * (mine[0].output + mine[-1].output))
    if at_rest:
        return None
    middle = [r.start + 0.5 * r.duration for r in mine]
    now = d.start + 0.5 * d.duration
    shares = np.array([np.interp(now, middle, row) for row in np.eye(len(mine))])
    zero = float(shares @ [r.output for r in mine])
    return replace(d, zero=zero, sd=float(np.sqrt(d.sd**2 + (shares**2) @ [r.sd**2 for r in mine])))
