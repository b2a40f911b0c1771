"""The dithered unit with its x axis up, then down: two positions for the bias of a gyro and the vertical Earth rate.

    up:  w_1 = b + W sin L,      down:  w_2 = b - W sin L

A gyro's mean rate is the slope of its angle, fitted by generalised least squares: dither moves the angle, and stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from studies.alignment.windows import cut
from studies.result_page import Section, table

from estimators.at_rest.base_motion import ACCELS, BLOCK, GYROS, RestBlocks, fitted_unrest, least_squares
from insenv.close import close
from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG_PER_HOUR
from insenv.data.load import read_recordings
from insenv.datasets import load

NAME = "ln100_updown"
_BLUE, _ORANGE, _GREY = "#0072B2", "#E69F00", "#666666"


@dataclass(frozen=True)
class TwoRests:
    """Bias and vertical Earth rate with their standard deviations [rad/s]."""

    bias: float
    vertical: float
    sd: float

    @classmethod
    def of(cls, up: tuple[float, float], down: tuple[float, float]) -> TwoRests:
        """From the rate and its deviation in both positions."""
        return cls(0.5 * (up[0] + down[0]), 0.5 * (up[0] - down[0]), 0.5 * float(np.hypot(up[1], down[1])))


def slope(rate: Floats, dt: float) -> tuple[float, float]:
    """Mean of a rate by its angle, and the standard deviation: white angle noise and a random walk, fitted."""
    rows = round(BLOCK / dt)
    count = len(rate) // rows
    at_rows = np.stack([dt * np.arange(1, len(rate) + 1), np.cumsum(rate) * dt])
    t, angle = at_rows[:, : count * rows].reshape(2, count, rows).mean(2)
    X = np.column_stack([np.ones(count), t])
    seen = RestBlocks(np.eye(3), t, np.column_stack([angle, angle]), X, 1.0, float(t[-1]))
    beta, P = least_squares(seen, 0, fitted_unrest(seen, 0, 0.0))
    return float(beta[1]), float(np.sqrt(P[1, 1]))


def plain(rests: tuple[Recording, ...]) -> TwoRests:
    """By the plain means of the gyro along the nominal axis; the deviation is that of means over 10 s, scaled."""
    found = []
    for rest in rests:
        x = rest.values("gyro_x", "rad/s")
        rows = round(10 / rest.dt)
        means = x[: len(x) // rows * rows].reshape(-1, rows).mean(1)
        found.append((float(x.mean()), float(means.std(ddof=1) / np.sqrt(len(means)))))
    return TwoRests.of(found[0], found[1])


def by_slope(rests: tuple[Recording, ...]) -> TwoRests:
    """By the slope of the angle of the gyro along the nominal axis."""
    found = [slope(rest.values("gyro_x", "rad/s"), rest.dt) for rest in rests]
    return TwoRests.of(found[0], found[1])


def along_the_vertical(rests: tuple[Recording, ...]) -> TwoRests:
    """By the slope of the angle about the vertical that the accelerometers show, from all three gyros."""
    found = []
    for rest, sign in zip(rests, (1, -1), strict=True):
        up = vertical_of(rest)
        rate, sd = slope(sign * up @ np.stack([rest.values(name, "rad/s") for name in GYROS]), rest.dt)
        found.append((rate, sd))
    return TwoRests.of(found[0], found[1])


def vertical_of(rest: Recording) -> Floats:
    """Unit vector upwards in body axes, shape (3,)."""
    force = np.array([rest.values(name, "m/s^2").mean() for name in ACCELS])
    return np.asarray(force / np.linalg.norm(force))


def section() -> Section:
    """The part of the page, with its picture."""
    rests = read_recordings(load(NAME))
    latitude = rests[0].site.latitude or 0.0
    known = EARTH_RATE * np.sin(latitude)
    found = {
        "plain means, x gyro": plain(rests),
        "slope of the angle, x gyro": by_slope(rests),
        "`insenv close-loop`, dither lines added, x gyro": _closed(),
        "slope of the angle about the measured vertical": along_the_vertical(rests),
    }
    first, best = list(found.values())[0], list(found.values())[-1]
    lean = [float(np.arccos(abs(vertical_of(rest)[0]))) for rest in rests]
    across = [EARTH_RATE * np.cos(latitude) * np.sin(one) / DEG_PER_HOUR for one in lean]
    lines = (
        f"Recording `{NAME}` ([talhaitis/Ins-Calibration](https://github.com/talhaitis/Ins-Calibration), MIT): a "
        "dithered ring-laser unit, x axis up for 300 s, then down. Half the sum of both rates is the bias, half the "
        f"difference the vertical Earth rate, known as {known / DEG_PER_HOUR:.3f} deg/h at this latitude.",
        "",
        *table(
            ("", "bias [deg/h]", "vertical rate [deg/h]", "sd of either, noise alone [deg/h]", "less the known rate"),
            ([name, *_cells(one, known)] for name, one in found.items()),
        ),
        "",
        f"By the accelerometers the axis stood {np.degrees(lean[0]):.2f} and {np.degrees(lean[1]):.2f} deg off the "
        f"vertical: it sees up to {across[0]:.3f} and {across[1]:.3f} deg/h of the horizontal Earth rate, which the "
        "first three rows take for bias or vertical rate and their deviations do not hold. The last row turns all "
        "three gyros into the vertical that the accelerometers show, in each rest anew. Accelerometers that are out "
        "of line with the gyros by 1 arcmin leave 0.003 deg/h in it, and so does a bias of 1 deg/h of y or z.",
    )
    return Section(
        "Two positions: bias and vertical Earth rate",
        lines,
        f"Plain means give {first.bias / DEG_PER_HOUR:.3f} and {first.vertical / DEG_PER_HOUR:.3f} deg/h. With the "
        "tilt of the axis taken from the accelerometers, and the dither fitted as angle noise, the vertical rate is "
        f"off the known one by {(best.vertical - known) / DEG_PER_HOUR:+.3f} ± {best.sd / DEG_PER_HOUR:.3f} deg/h.",
        {"align_two_rests": _figure(rests, known)},
    )


def _cells(one: TwoRests, known: float) -> tuple[str, ...]:
    bias, vertical, sd = (x / DEG_PER_HOUR for x in (one.bias, one.vertical, one.sd))
    return f"{bias:.3f}", f"{vertical:.3f}", f"{sd:.4f}", f"{vertical - known / DEG_PER_HOUR:+.3f}"


def _closed() -> TwoRests:
    """As the loop closes: bias and measured vertical rate after the effects that it found."""
    target = close(NAME).targets[0]
    values = {row.effect: row for row in target.estimates_after}
    return TwoRests(values["bias"].value, values["earth_rate"].value, values["earth_rate"].sd)


def _figure(rests: tuple[Recording, ...], known: float) -> Figure:
    drawn = Figure(figsize=(7.2, 3.4), layout="constrained")
    ax = drawn.subplots()
    used = np.arange(30, 301, 10)
    for name, kind, colour in (
        ("plain means, x gyro", plain, _GREY),
        ("slope of the angle, x gyro", by_slope, _ORANGE),
        ("slope about the measured vertical", along_the_vertical, _BLUE),
    ):
        found = [kind(tuple(cut(rest, 0, round(s / rest.dt)) for rest in rests)) for s in used]
        value, sd = (np.array([getattr(one, k) for one in found]) / DEG_PER_HOUR for k in ("vertical", "sd"))
        ax.fill_between(used, value - sd, value + sd, color=colour, alpha=0.2, lw=0)
        ax.plot(used, value, color=colour, lw=1.6, label=name)
    ax.axhline(known / DEG_PER_HOUR, color="black", lw=1, ls="--", label="known")
    ax.grid(True, color="#dddddd", lw=0.6)
    ax.set(xlabel="first seconds of each rest that are used [s]", ylabel="vertical Earth rate [deg/h]")
    ax.set_ylim(11.6, 11.95)
    ax.legend(frameon=False, ncols=2, fontsize=8)
    return drawn
