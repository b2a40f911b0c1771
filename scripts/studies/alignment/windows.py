"""The parked vehicle in windows: heading before and after the tilt of its base is taken off.

Three ways to the net rate of the base: it is zero; from the tilt at both ends of a window; by the effect ``base_tilt``
over all of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import chi2
from studies.result_page import Section, table

from estimators.at_rest.base_motion import ACCELS, GYROS, base_motion, fitted_angle_walk, level_axes, means, velocities
from estimators.at_rest.static_alignment import gyrocompass, site_gravity, still_base, tilting_base
from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR
from insenv.data.exposure import expose
from insenv.data.load import read_recordings
from insenv.datasets import load

NAME = "psins_lasergyro"
#: Lengths of the windows in the table, and of those in the picture of the spread [s].
LENGTHS, DRAWN = (120, 180, 300), (60, 90, 120, 180, 300, 450)
#: The first second shows the unit starting.
SKIPPED = 1.0
#: Seconds at either end of a window that give the tilt there.
AT_ENDS = 5.0
_BLUE, _ORANGE, _GREY = "#0072B2", "#E69F00", "#666666"
Aligner = Callable[[Recording, Datasheet], Estimate]


def by_ends(rest: Recording, datasheet: Datasheet) -> Estimate:
    """Alignment with the base's rate from the tilts at both ends alone; its covariance does not know of their errors.

    Over the first and the last seconds the accelerometers are averaged, less the tilt that the gyros see meanwhile.
    """
    seen = velocities(rest, site_gravity(datasheet))
    rows = round(AT_ENDS / (seen.t[1] - seen.t[0]))
    force = np.diff(seen.v, axis=0) / np.diff(seen.t)[:, None]
    risen = (force[-rows:].mean(0) - force[:rows].mean(0)) / seen.gravity
    base = np.cross(risen @ seen.axes[:2], seen.axes[2]) / ((len(force) - rows) * (seen.t[1] - seen.t[0]))
    plain, (rate, mean_force) = still_base(rest, datasheet), means(rest)
    return replace(plain, mean=gyrocompass(rate - base, mean_force, np.zeros((3, 3)), np.zeros((3, 3)), datasheet).mean)


ALIGNERS: dict[str, Aligner] = {
    "plain means": still_base,
    "tilt at both ends, means of 5 s": by_ends,
    "effect `base_tilt`": tilting_base,
}


@dataclass(frozen=True)
class Windows:
    """Heading and horizontal Earth rate of every window of one length, with deviations; each shape (k,), SI."""

    heading: Floats
    heading_sd: Floats
    rate: Floats
    rate_sd: Floats

    @classmethod
    def of(cls, aligner: Aligner, rests: list[Recording], datasheet: Datasheet) -> Windows:
        """Align every rest."""
        found = [aligner(rest, datasheet) for rest in rests]
        return cls(*np.array([(*e.of("heading"), *e.of("horizontal_rate")) for e in found]).T)

    @property
    def spread(self) -> float:
        """Standard deviation of the heading over the windows [rad]."""
        return float(np.std(self.heading, ddof=1))

    @property
    def z(self) -> float:
        """Root mean square of the heading's z over the windows, about their weighted mean."""
        weight = self.heading_sd**-2
        mean = weight @ self.heading / weight.sum()
        return float(np.sqrt(np.sum(((self.heading - mean) / self.heading_sd) ** 2) / (len(weight) - 1)))


@dataclass(frozen=True)
class Study:
    """One length of window: by way of alignment, and the angle random walk that all windows share [rad/sqrt(s)]."""

    rests: list[Recording]
    angle_walk: float
    windows: dict[str, Windows]

    @property
    def after(self) -> Windows:
        """With the effect."""
        return self.windows["effect `base_tilt`"]

    @property
    def before(self) -> Windows:
        """By plain means."""
        return self.windows["plain means"]


def cut(recording: Recording, start: int, stop: int) -> Recording:
    """Rows ``[start, stop)``."""
    channels = {name: replace(c, values=c.values[start:stop]) for name, c in recording.channels.items()}
    return replace(recording, t=recording.t[start:stop], channels=channels)


def windows(recording: Recording, length: float) -> list[Recording]:
    """Successive windows of ``length`` [s] without overlap; the row before each starts its integrals."""
    rows, skipped = round(length / recording.dt), round(SKIPPED / recording.dt)
    starts = range(skipped, len(recording) - rows + 1, rows)
    return [cut(recording, start - 1, start + rows) for start in starts]


def datasheet_of(recording: Recording, angle_walk: float) -> Datasheet:
    """What is known: the site, and the random walk of the gyros [rad/sqrt(s)]."""
    noise = {name: {"angle_random_walk": angle_walk} for name in GYROS}
    site, mounting = recording.site, recording.mounting
    return Datasheet(1 / recording.dt, float(recording.t[-1]), site=site, mounting=mounting, noise=noise)


def study(recording: Recording, length: float) -> Study:
    """Align all windows of one length in every way."""
    rests = windows(recording, length)
    walk = fitted_angle_walk(rests, site_gravity(datasheet_of(recording, 0.0)))
    sheet = datasheet_of(recording, walk)
    return Study(rests, walk, {name: Windows.of(aligner, rests, sheet) for name, aligner in ALIGNERS.items()})


def section() -> Section:
    """The part of the page, with its pictures."""
    (recording,) = read_recordings(load(NAME))
    studies = {length: study(recording, length) for length in sorted({*LENGTHS, *DRAWN})}
    known = EARTH_RATE * np.cos(recording.site.latitude or 0.0) / DEG_PER_HOUR
    longest = studies[LENGTHS[-1]]
    rate, error = _rate(longest.after)
    begun = _later(recording, longest)
    lines = (
        f"Recording `{NAME}` ([WangShanpeng/PSINS](https://github.com/WangShanpeng/PSINS), BSD-2-Clause): a ring-laser "
        "unit in a parked vehicle that people and wind move, 100 Hz, 1847 s. Its first second is left out; windows "
        "follow each other without overlap. The mean of the gyros over a window holds the Earth's rate and what the "
        "base turned between the window's ends; the effect `base_tilt`, fitted to the accelerometers over the whole "
        "window, takes the second off the first (`estimators.at_rest.static_alignment`).",
        "",
        *table(_HEADER, (row for length in LENGTHS for row in _rows(length, studies[length]))),
        "",
        f"Spread: standard deviation over the windows. The horizontal Earth rate is {known:.3f} deg/h by the latitude. "
        "z: the heading less the weighted mean of all windows, over its own standard deviation, root mean square; "
        "between the limits 95 % of honest deviations lie. Shaking and velocity walk of the accelerometers are fitted "
        "to each window and axis, the angle random walk of the gyros to all windows of a length together ("
        + ", ".join(f"{studies[n].angle_walk / DEG_PER_SQRT_HOUR:.5f}" for n in LENGTHS)
        + " deg/sqrt(h) in windows of "
        + ", ".join(map(str, LENGTHS))
        + " s: it takes in what the accelerometers drift). These fits see only what is left beside the "
        "regressors, not the headings that z judges.",
        "",
        f"What the plain means spread depends on where the windows begin: from {_deg(min(begun), 1)} to "
        f"{_deg(max(begun), 1)} deg in windows of {LENGTHS[-1]} s that begin 0 to 45 s later.",
        "",
        "The spread does not show what all windows have in common. A bias of 0.01 deg/h of the gyro that points north "
        "or south is 0.01 deg/h of the horizontal rate; of the one that points east or west, 0.05 deg of heading, "
        "and no window can tell it.",
    )
    return Section(
        "Parked vehicle: gyrocompassing in windows",
        lines,
        f"The base's tilt is what spreads the heading: {_deg(longest.before.spread, 2)} deg before, "
        f"{_deg(longest.after.spread, 3)} deg after, in windows of {LENGTHS[-1]} s; the horizontal Earth rate is "
        f"{rate:.3f} ± {error:.3f} deg/h (repeatability) against {known:.3f}. The claimed deviations are honest after, "
        f"and {longest.before.z:.0f} times too small before: plain means do not know of the base.",
        {
            "align_windows": _headings(longest),
            "align_spread": _spreads(studies),
            "align_tilt": _tilt(longest),
        },
    )


_HEADER = (
    "window [s]",
    "way",
    "windows",
    "spread of heading [deg]",
    "largest less smallest [deg]",
    "mean heading [deg]",
    "horizontal rate [deg/h]",
    "claimed sd, median [deg]",
    "z",
)


def _rows(length: int, done: Study) -> list[tuple[object, ...]]:
    rows: list[tuple[object, ...]] = []
    for name, w in done.windows.items():
        rate, error = _rate(w)
        told = name != "tilt at both ends, means of 5 s"
        low, high = np.sqrt(chi2.ppf((0.025, 0.975), len(w.heading) - 1) / (len(w.heading) - 1))
        z = f"{w.z:.2f}" if w.z < 10 else f"{w.z:.0f}"
        rows.append(
            (
                *(length, name, len(w.heading), _deg(w.spread, 3), _deg(np.ptp(w.heading), 3)),
                *(_deg(w.heading.mean(), 3), f"{rate:.3f} ± {error:.3f}"),
                *((_deg(np.median(w.heading_sd), 3), f"{z} ({low:.2f} to {high:.2f})") if told else ("", "")),
            )
        )
    return rows


def _later(recording: Recording, done: Study) -> list[float]:
    """Spread of the plain means [rad] of windows that begin 0, 5, ... 45 s later."""
    sheet = datasheet_of(recording, done.angle_walk)
    shifted = [cut(recording, round(s / recording.dt), len(recording)) for s in range(0, 46, 5)]
    return [Windows.of(still_base, windows(one, LENGTHS[-1]), sheet).spread for one in shifted]


def _rate(w: Windows) -> tuple[float, float]:
    """Mean horizontal rate and the standard error of the mean [deg/h]."""
    return float(w.rate.mean() / DEG_PER_HOUR), float(w.rate.std(ddof=1) / np.sqrt(len(w.rate)) / DEG_PER_HOUR)


def _deg(angle: float, digits: int) -> str:
    return f"{np.degrees(angle):.{digits}f}"


def _headings(done: Study) -> Figure:
    drawn = Figure(figsize=(7.2, 4.4), layout="constrained")
    top, bottom = drawn.subplots(2, 1, sharex=True)
    middle = [0.5 * (rest.t[0] + rest.t[-1]) / 60 for rest in done.rests]
    ways = (("plain means", _ORANGE, "o"), ("tilt at both ends, means of 5 s", _GREY, "s"))
    for name, colour, mark in ways:
        top.plot(middle, np.degrees(done.windows[name].heading), mark, color=colour, ms=6, label=name)
    top.plot(middle, np.degrees(done.after.heading), "D", color=_BLUE, ms=5, label="effect base_tilt")
    bottom.errorbar(
        middle, np.degrees(done.after.heading), np.degrees(done.after.heading_sd), fmt="D", color=_BLUE, ms=5, capsize=3
    )
    top.legend(frameon=False, fontsize=8)
    for ax, what in ((top, "heading [deg]"), (bottom, "after, with its\nstandard deviation [deg]")):
        ax.grid(True, color="#dddddd", lw=0.6)
        ax.set_ylabel(what)
    bottom.ticklabel_format(axis="y", useOffset=False)
    bottom.set_xlabel("middle of the window [min]")
    return drawn


def _spreads(studies: dict[int, Study]) -> Figure:
    drawn = Figure(figsize=(7.2, 3.6), layout="constrained")
    ax = drawn.subplots()
    lengths = sorted(studies)
    for (name, colour), mark in zip(zip(ALIGNERS, (_ORANGE, _GREY, _BLUE), strict=True), "osD", strict=True):
        spread = [np.degrees(studies[n].windows[name].spread) for n in lengths]
        ax.loglog(lengths, spread, mark + "-", color=colour, ms=5, lw=1, label=name.replace("`", "") + ", spread")
    told = [np.degrees(np.sqrt(np.mean(studies[n].after.heading_sd ** 2))) for n in lengths]
    ax.loglog(lengths, told, "--", color=_BLUE, lw=1, label="effect base_tilt, claimed (root mean square)")
    ax.set_xticks(lengths, [str(n) for n in lengths])
    ax.minorticks_off()
    ax.grid(True, color="#dddddd", lw=0.6)
    ax.set(xlabel="length of the window [s]", ylabel="heading [deg]")
    ax.legend(frameon=False, fontsize=8)
    return drawn


def _tilt(done: Study) -> Figure:
    """The window whose plain mean is farthest off: the tilt by the accelerometers and by the gyros."""
    worst = int(np.argmax(np.abs(done.before.heading - np.median(done.after.heading))))
    rest = done.rests[worst]
    g = site_gravity(datasheet_of(rest, 0.0))
    base = base_motion(rest, g, done.angle_walk)
    *level, up = level_axes(means(rest)[1])
    seen = [expose(rest, name, rows_per_cell=100) for name in ACCELS]
    t = seen[0].motion.middle
    felt = np.stack(level) @ np.stack([e.y for e in seen]) / g
    turned = np.stack(level) @ np.stack([e.motion.base_tilt for e in seen if e.motion.base_tilt is not None])
    drawn = Figure(figsize=(7.2, 4.8), layout="constrained")
    axes = drawn.subplots(2, 1, sharex=True)
    for j, (ax, name) in enumerate(zip(axes, ("right", "forward"), strict=True)):
        drift = up @ np.cross(base.rate, level[j]) * (t - t.mean())
        for series, colour, label in (
            (felt[j], _GREY, "accelerometers, 1 s means"),
            (turned[j], _ORANGE, "gyros less their mean"),
            (turned[j] + drift, _BLUE, "and the drift that the effect finds"),
        ):
            ax.plot(t, (series - series.mean()) / DEG * 60, color=colour, lw=1.1, label=label)
        ax.grid(True, color="#dddddd", lw=0.6)
        ax.set_ylabel(f"{name} axis up [arcmin]")
    drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    axes[1].set_xlabel(f"time in the window of {done.rests[0].t[-1] - done.rests[0].t[0]:.0f} s [s]")
    return drawn
