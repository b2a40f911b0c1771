"""Figures 4 to 6 of the published two-position calibration: how the estimates converge in one run."""

from __future__ import annotations

from dataclasses import dataclass

import gymnasium
import numpy as np
from matplotlib.figure import Figure
from studies.result_page import Section
from studies.two_position.runs import SHOWN
from studies.two_position.tables import READINGS

import insenv  # noqa: F401 - registers the environments
from estimators.two_position.transposition import PublishedSchedule
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Floats
from insenv.core.units import DEG
from insenv.envs.recorder import Recorder

#: What is drawn, panel by panel: the paper's figures are not in the text that is at hand, only what they show.
PANELS = (("heading", "installation_angle"), ("gyro_x", "gyro_y"), ("accel_x", "accel_y"))
_COLOURS = ("#0072B2", "#E69F00")
_EVERY = 5


@dataclass(frozen=True)
class Course:
    """Errors and deviations of every quantity in one run, shape (k,), at times t [s]."""

    t: Floats
    errors: dict[str, Floats]
    sd: dict[str, Floats]


def converging(seed: int) -> Section:
    """Errors with their one-sigma bands, `two_position_joint` and `two_position`."""
    drawn = Figure(figsize=(10.0, 7.2), layout="constrained")
    grid = drawn.subplots(3, 2, sharex=True)
    for j, name in enumerate(("two_position", "two_position_joint")):
        course = follow(name, seed)
        grid[0, j].set_title(name, fontsize=10)
        for i, quantities in enumerate(PANELS):
            ax, unit = grid[i, j], SHOWN[quantities[0]]
            for quantity, colour in zip(quantities, _COLOURS, strict=True):
                error, sd = course.errors[quantity] / unit[0], course.sd[quantity] / unit[0]
                ax.plot(course.t, error, color=colour, lw=1.2, label=quantity.replace("_", " "))
                ax.fill_between(course.t, -sd, sd, color=colour, alpha=0.15, lw=0)
            ax.axvspan(300, 320, color="#bbbbbb", alpha=0.5, lw=0)
            ax.grid(True, color="#dddddd", lw=0.6)
            limit = (5, 0.02, 90)[i]
            ax.set_ylim(-limit, limit)
            ax.set_ylabel(f"error [{unit[1].replace('ug', 'µg')}]")
            ax.legend(frameon=False, fontsize=8, ncol=2, loc="upper right")
        grid[2, j].set_xlabel("time [s]")
    return Section(
        "Figures 4 to 6: how the estimates converge",
        (
            "One run under noise A2; bands are the deviations that the estimator tells, about zero; the turn is grey. "
            "The text of the paper that is at hand has no figures, so that these stand alone.",
        ),
        "Nothing tells heading from the east gyro's drift before the turn; after it both come apart within a minute.",
        {"two_position_convergence": drawn},
    )


def follow(name: str, seed: int) -> Course:
    """One run of the published schedule through `env.step`, with an estimator beside."""
    env = Recorder(gymnasium.make("insenv/TwoPosition-v0", scenario=READINGS["A2"]))
    sheet = env.unwrapped.task.datasheet  # type: ignore[attr-defined]
    estimator, policy = find(ESTIMATORS, name)(sheet), PublishedSchedule(sheet)
    _, info = env.reset(seed=seed)
    truth = info["truth"]
    learnt, going, chunk, over = estimator.reset(), policy.reset(), None, False
    t, means, deviations = [], [], []
    names: tuple[str, ...] = ()
    while not over:
        action, going = policy.act(going, chunk, None)
        _, _, terminated, truncated, _ = env.step(action)
        over, chunk = terminated or truncated, env.chunk
        if chunk is None or terminated:
            break
        learnt = estimator.update(learnt, chunk)
        if round(float(chunk.t[-1])) % _EVERY == 0:
            estimate = estimator.estimate(learnt)
            names = estimate.names
            t.append(float(chunk.t[-1]))
            means.append(estimate.mean)
            deviations.append(estimate.sd)
    time, mean, sd = np.array(t), np.array(means), np.array(deviations)
    errors = {n: _error(n, mean[:, names.index(n)], truth, time) for panel in PANELS for n in panel}
    return Course(time, errors, {n: sd[:, names.index(n)] for n in errors})


def _error(name: str, mean: Floats, truth: dict[str, float], t: Floats) -> Floats:
    if name == "installation_angle":
        return mean - truth[name]
    if name == "heading":
        # Left out while the vehicle turns.
        turned = np.where(t >= 320, 170 * DEG, 0.0)
        error = np.angle(np.exp(1j * (mean - truth["heading"] + turned)))
        return np.where((t > 300) & (t < 320), np.nan, error)
    return mean - truth[f"{name}.bias.c"]
