"""Whether `batch_gls` reaches the bound in every parameter, over many seeds.

python scripts/studies/system_calibration/bound_reached.py [--runs 1600]

An rms over R runs scatters by 1 / sqrt(2 R): 1600 runs tell 5 % of each of 48 parameters, 200 do not. The 19 positions
in half of their time, at a tenth of the samples: white noise is told by the root of a second.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

import numpy as np

from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Floats
from insenv.envs.rollout import roll_out
from insenv.evaluate.bounds import bounds
from insenv.systems.system_calibration.env import system_calibration

SCENARIO = "system_calibration/tactical_fog"
QUICK: Mapping[str, Any] = {"duration": "570 s", "instrument.sampling": "10 Hz", "axes.max_rate": "30 deg/s"}
#: Runs that are played together.
TOGETHER = 50


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1600)
    errors, sd, least = errors_and_bound(parser.parse_args().runs, QUICK)
    over, z = np.sqrt(np.mean(errors**2, axis=0)) / least, np.sqrt(np.mean((errors / sd) ** 2, axis=0))
    chance = 1 / np.sqrt(2 * len(errors))
    print(f"{len(errors)} runs, {errors.shape[1]} parameters; an rms scatters by {chance:.1%} by chance")
    print(f"rms error over the bound: {over.min():.3f} to {over.max():.3f}, {over.mean():.4f} in the mean")
    print(f"rms of z: {z.min():.3f} to {z.max():.3f}, {np.sqrt(np.mean((errors / sd) ** 2)):.4f} of all")
    print(f"stated deviation over the bound: {(sd / least).min():.6f} to {(sd / least).max():.6f}")


def errors_and_bound(runs: int, changes: Mapping[str, Any]) -> tuple[Floats, Floats, Floats]:
    """Errors and stated deviations, shapes (R, q), and the bound, shape (q,), of all that is sought."""
    task = system_calibration(SCENARIO, changes)
    names = [q.name for q in task.quantities]
    estimator, errors, sd, least = find(ESTIMATORS, "batch_gls")(task.datasheet), [], [], np.zeros(0)
    for first in range(0, runs, TOGETHER):
        played = roll_out(task, "nineteen_positions", None, range(first, min(first + TOGETHER, runs)))
        for row in range(min(TOGETHER, runs - first)):
            found = estimator.estimate(estimator.update(estimator.reset(), played.recording(row)))
            at = [found.names.index(name) for name in names]
            errors.append(found.mean[at] - [played.truth[name][row] for name in names])
            sd.append(found.sd[at])
        if not first:
            told = bounds(task.datasheet, played.recording(0), tuple(names))
            least = np.array([told[name] for name in names])
    return np.array(errors), np.array(sd), least


if __name__ == "__main__":
    main()
