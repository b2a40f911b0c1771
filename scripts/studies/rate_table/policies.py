"""Policies on a rate table: how often each finds a fault at an unknown rate, in what time, and how well it tells K.

The functions return figures; `python -m studies.rate_table.policies`, in the folder scripts, prints them. How runs are
simulated stands in `studies.rate_table.policy_runs`.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from studies.rate_table.policy_runs import Maker, Played, Runs, Table, play, random_faults, together

from estimators.rate_table import rate_ladder_tally as tallies
from estimators.rate_table.greedy_information import GreedyInformation
from estimators.rate_table.rate_ladder import OptimalLadder, PublishedLadder, VanDerCorput
from estimators.rate_table.rate_ladder_residual import line, loudness, smooth
from estimators.rate_table.sweep_and_refine import SweepAndRefine
from insenv.core.estimate import Limits
from insenv.core.recording import Floats
from insenv.core.units import ARCSEC, DEG, PPM
from insenv.plants.turntable import Encoder, Ripple

#: A fixed list alarms where a residual is larger than this [rad/s], and than so many deviations.
ALARM, LOUD = 0.005 * DEG, 4.5
#: Error of each setting that is allowed for [rad/s].
FLOOR = 1e-4 * DEG
#: Entries before which a list that is judged as it grows is not judged.
_LEAST = 8


@dataclass(frozen=True)
class Row:
    """A line of the policy table.

    Attributes
    ----------
    policy : str
    found, false_alarms : float
        Share of the runs with a fault in which it was found, and of those without one in which something was.
    time : float
        Median of the whole test [s]; ``first``: of the first alarm, where a list is judged as it grows.
    scale_factor_rms, scale_factor_sd : float
        Of the error of K over the runs without a fault, and what its covariance says.
    """

    policy: str
    runs: int
    found: float
    false_alarms: float
    clean_runs: int
    time: float
    longest: float
    first: float
    scale_factor_rms: float
    scale_factor_sd: float


POLICIES: Mapping[str, Maker] = {
    "published_ladder": lambda sheet: PublishedLadder(sheet, repeats=1, preheat=0.0),
    "optimal_ladder": lambda sheet: OptimalLadder(sheet, duration=400.0, visits=12),
    "van_der_corput": VanDerCorput,
    "greedy_information": GreedyInformation,
    "sweep_and_refine": lambda sheet: SweepAndRefine(sheet, floor=FLOOR),
}


def judged(played: Played, row: int, entries: int | None = None, alarm: float = ALARM) -> bool:
    """Whether a fixed list, or its first ``entries``, has more than ``alarm`` [rad/s] at some rate of one run."""
    part, tally = slice(0, entries), played.tally
    variance = tallies.variance(tally.time[row, part], played.datasheet, FLOOR)
    mean = [np.nan_to_num(values[row, part]) for values in (tally.rate, tally.residual, tally.middle)]
    fit = smooth(mean[0], mean[1], mean[2], variance, float(np.abs(played.rate).max()))
    loud = loudness(fit, played.rate[row, part]) > LOUD
    return bool(np.any(loud & (np.abs(fit.left) > alarm) & np.isfinite(variance)))


def first_alarm(played: Played, row: int) -> float:
    """Time at which a list that is judged as it grows alarms first [s]; infinite where it never does."""
    used = int((played.tally.time[row] > 0).sum())
    for k in range(_LEAST, used + 1):
        if judged(played, row, k):
            return float(played.tally.middle[row, k - 1] + 0.5 * played.tally.time[row, k - 1])
    return float("inf")


def found(name: str, maker: Maker, played: Played, runs: Runs) -> NDArray[np.bool_]:
    """In which runs a policy alarms; where it says at which rate, that must be right if there is a fault."""
    n = len(runs.seeds)
    if name != "sweep_and_refine":
        return np.array([judged(played, row) for row in range(n)])
    policy = maker(played.datasheet)
    near = np.where(runs.height == 0, np.inf, 2 * runs.width)
    return np.array(
        [
            any(abs(f.centre - runs.centre[row]) < near[row] for f in alarms)
            for row, alarms in enumerate(policy.alarms(played.state))
        ]
    )


def scale_factors(name: str, maker: Maker, played: Played) -> tuple[Floats, Floats]:
    """Relative error of K and its deviation, each (R,); of the published test by plain least squares, as it says."""
    if name == "sweep_and_refine":
        value, sd = maker(played.datasheet).scale_factor(played.state)
        return value, sd
    tally = played.tally
    variance = tallies.variance(tally.time, played.datasheet, FLOOR)
    if name != "published_ladder":
        top = float(np.abs(played.rate).max())
        several = [
            line(tally.rate[r], tally.residual[r], np.nan_to_num(tally.middle[r]), variance[r], top)
            for r in range(len(variance))
        ]
        values, sds = np.array(several).T
        return values, sds
    x, y = tally.rate[:, :-1], tally.residual[:, :-1]
    x = x - x.mean(axis=-1, keepdims=True)
    gain = x / (x**2).sum(axis=-1, keepdims=True)
    return (gain * y).sum(axis=-1), np.sqrt((gain**2 * variance[:, :-1]).sum(axis=-1))


def study(name: str, faulty: Runs, clean: Runs, maker: Maker | None = None, **settings: Any) -> Row:
    """One policy on runs with and without a fault; one that is no documented policy is given with its ``maker``."""
    maker = maker or POLICIES[name]
    if name in POLICIES:  # a list that is over does nothing more, however long its neighbours go on
        both = play(maker, together(faulty, clean), **settings)
        played, control = (both.rows(index) for index in np.split(np.arange(len(both.time)), [len(faulty.seeds)]))
    else:
        played, control = play(maker, faulty, **settings), play(maker, clean, **settings)
    hit, false = found(name, maker, played, faulty), found(name, maker, control, clean)
    growing = name in ("van_der_corput", "greedy_information")
    first = [first_alarm(played, row) for row in range(len(hit))] if growing else [float("nan")]
    value, sd = scale_factors(name, maker, control)
    return Row(
        policy=name,
        runs=len(hit),
        found=float(hit.mean()),
        false_alarms=float(false.mean()),
        clean_runs=len(false),
        time=float(np.median(played.time)),
        longest=float(played.time.max()),
        first=float(np.median(first)),
        scale_factor_rms=float(np.sqrt(np.mean((value - clean.scale) ** 2))),
        scale_factor_sd=float(np.sqrt(np.mean(sd**2))),
    )


#: What a sweep has to feel.
DISTURBED: Mapping[str, Table] = {
    "none": Table(),
    "ripple 0.1 %, 8 per turn": Table(ripple=Ripple(1e-3, 8)),
    "eccentric encoder, 5 arcsec": Table(encoder=Encoder(noise=1 * ARCSEC, eccentricity=5 * ARCSEC)),
    "latency 1 ms": Table(latency=1e-3),
    "latency 10 ms": Table(latency=1e-2),
    "acceleration 5 deg/s^2": Table(limits=Limits(50 * DEG, 5 * DEG)),
}


def disturbed(faulty: Runs, clean: Runs, tables: Mapping[str, Table] = DISTURBED) -> dict[str, Row]:
    """`sweep_and_refine` on tables with ripple and an eccentric encoder, with a late gyro, and on a slow table."""
    return {name: study("sweep_and_refine", faulty, clean, table=table) for name, table in tables.items()}


def pull_in(
    offset: Floats, half_width: float, pull: float, dwell: float = 0.95, guard: float = tallies.GUARD
) -> Floats:
    r"""Largest error of a dwell in and around a lock against Adler's law [rad/s], shape (k,): what pulling in costs.

    With the phase theta between signal and cross-coupling, ``d theta / dt = pull (d / D - sin theta)`` and the error
    ``-D sin theta``; the law is its mean over a long time, -d within D, else sign(d) (sqrt(d^2 - D^2) - |d|).

    Parameters
    ----------
    offset : ndarray, shape (k,)
        Of the table's rate from the centre of the lock, d [rad/s].
    half_width : float
        D [rad/s]
    pull : float
        Of the loop [1/s]: q K_s D / tau for 2 pi p / q, scale K_s and transit time tau.
    dwell, guard : float
        Averaged over, and left out before [s]; the phase with which a dwell begins may be any.
    """
    theta = np.linspace(0.0, 2 * np.pi, 9)[:-1, None] + np.zeros(len(offset))
    drive = offset / half_width
    dt = 0.2 / (pull * max(1.0, float(np.abs(drive).max())))
    total, steps = np.zeros(theta.shape), round(dwell / dt)
    for k in range(-round(guard / dt), steps):
        half = theta + 0.5 * dt * pull * (drive - np.sin(theta))
        speed = drive - np.sin(half)
        theta = theta + dt * pull * speed
        if k >= 0:
            total += speed
    error = half_width * (total / steps - drive)
    beyond = np.sqrt(np.maximum(offset**2 - half_width**2, 0.0))
    worst: Floats = np.abs(error - (np.sign(offset) * beyond - offset)).max(axis=0)
    return worst


def rows(n: int = 60, clean: int = 60, names: Sequence[str] = tuple(POLICIES)) -> list[Row]:
    """The policy table."""
    return [study(name, random_faults(n), random_faults(clean, 2, height=0.0)) for name in names]


def told(row: Row) -> str:
    """A line of print."""
    return (
        f"{row.policy:20s} found {row.found:5.2f} of {row.runs}, false {row.false_alarms:.3f} of {row.clean_runs}, "
        f"{row.time:6.0f} s (longest {row.longest:.0f}), first alarm {row.first:.0f} s, "
        f"K {row.scale_factor_rms / PPM:.2f} ppm rms, said {row.scale_factor_sd / PPM:.2f}"
    )


def main() -> None:
    small = "--small" in sys.argv
    for name in POLICIES:
        print(told(rows(30 if small else 200, 30 if small else 300, (name,))[0]), flush=True)
    for label, row in disturbed(random_faults(40), random_faults(40, 2, height=0.0)).items():
        print(f"{label:28s} {told(row)}", flush=True)


if __name__ == "__main__":
    main()
