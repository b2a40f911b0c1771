"""Whether `batch_gls` reaches the bound in every parameter, over many seeds.

    R rms_j^2 / bound_j^2 ~ chi^2_R,      sum over runs of e' P^-1 e ~ chi^2_(R q)

where it does and its P is honest: of each of the q parameters the true ratio stands in a band, all q at once with 99 %
(Bonferroni), and one number tells of all errors with their correlations. An rms over R runs scatters by 1 / sqrt(2 R):
200 runs cannot tell 5 %, 12800 tell 2.3 % of each of 48. The 19 positions in half of their time, at a tenth of the
samples (white noise is told by the root of a second).

python scripts/studies/system_calibration/bound_reached.py [--runs 12800] [--kept FILE.npz]

FILE.npz keeps what was run: more runs are added to it.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Floats
from insenv.envs.rollout import RollOut, roll_out
from insenv.evaluate.bounds import bounds
from insenv.systems.system_calibration.env import system_calibration

SCENARIO = "system_calibration/tactical_fog"
QUICK: Mapping[str, Any] = {"duration": "570 s", "instrument.sampling": "10 Hz", "axes.max_rate": "30 deg/s"}
#: Runs that are played together, and solved in one batch.
TOGETHER = 64
#: Chance that a band of all parameters does not hold, and the departure that is to be excluded.
ALPHA, TOLERANCE = 0.01, 0.05


@dataclass(frozen=True)
class Judged:
    """Of R runs: errors (R, q), stated deviations (R, q), squares e' P^-1 e (R,), and the bound (q,)."""

    errors: Floats
    sd: Floats
    squares: Floats
    least: Floats

    @property
    def ratio(self) -> Floats:
        """Root mean square of the errors over the bound, shape (q,)."""
        found: Floats = np.sqrt(np.mean(self.errors**2, axis=0)) / self.least
        return found

    def band(self, alpha: float = ALPHA) -> tuple[Floats, Floats]:
        """In which the true ratio of each parameter stands, of all at once, shape (q,) each."""
        runs, q = self.errors.shape
        low, high = stats.chi2.ppf([1 - alpha / (2 * q), alpha / (2 * q)], runs)
        return self.ratio * np.sqrt(runs / low), self.ratio * np.sqrt(runs / high)

    @property
    def chance(self) -> float:
        """Two-sided probability of a sum of squares as far from its mean, if errors are as stated."""
        below = stats.chi2.cdf(self.squares.sum(), self.errors.size)
        return float(2 * min(below, 1 - below))


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=12800)
    parser.add_argument("--kept", type=Path)
    asked = parser.parse_args()
    found = judged(asked.runs, QUICK, asked.kept)
    for line in said(found):
        print(line)


def said(found: Judged) -> tuple[str, ...]:
    """The figures in words."""
    runs, q = found.errors.shape
    (low, high), z, over = found.band(), found.errors / found.sd, found.sd / found.least
    within = bool(np.all(low > 1 - TOLERANCE) and np.all(high < 1 + TOLERANCE))
    each, ratio = np.sqrt(np.mean(z**2, axis=0)), found.ratio
    chance = 1.96 * np.sqrt(2 / found.errors.size)
    return (
        f"{runs} runs, {q} parameters; an rms scatters by {1 / np.sqrt(2 * runs):.1%} by chance",
        f"rms error over the bound: {ratio.min():.3f} to {ratio.max():.3f}, {ratio.mean():.4f} in the mean",
        f"true ratios, all at once with {1 - ALPHA:.0%}: {low.min():.3f} to {high.max():.3f}: "
        f"{'all' if within else 'not all'} within {TOLERANCE:.0%} of the bound",
        f"rms of z: {each.min():.3f} to {each.max():.3f}, {np.sqrt(np.mean(z**2)):.4f} of all",
        f"e' P^-1 e over {q}: {found.squares.mean() / q:.4f} in the mean "
        f"(chance: +- {chance:.4f}), p = {found.chance:.2g}",
        f"stated deviation over the bound: {over.min():.6f} to {over.max():.6f}",
    )


def judged(runs: int, changes: Mapping[str, Any], kept: Path | None = None) -> Judged:
    """Seeds 0 to ``runs`` - 1; those in the file ``kept`` are not run again, and what is run is added to it."""
    task = system_calibration(SCENARIO, changes)
    names = [q.name for q in task.quantities]
    estimator = find(ESTIMATORS, "batch_gls")(task.datasheet)
    errors, sd, squares = ([] if kept is None or not kept.exists() else [np.load(kept)[key]] for key in _KEYS)
    told = bounds(task.datasheet, roll_out(task, "nineteen_positions", None, range(1)).recording(0), tuple(names))
    least = np.array([told[name] for name in names])
    while (first := sum(map(len, squares))) < runs:
        played = roll_out(task, "nineteen_positions", None, range(first, min(first + TOGETHER, runs)))
        found = estimator.estimate(_after(estimator, played))
        at = [found.names.index(name) for name in names]
        e = found.mean[:, at] - np.stack([played.truth[name] for name in names], axis=-1)
        cov = found.cov[:, at][:, :, at]
        errors.append(e)
        sd.append(found.sd[:, at])
        squares.append(np.einsum("ri,ri->r", e, np.linalg.solve(cov, e[..., None])[..., 0]))
    whole = Judged(np.concatenate(errors), np.concatenate(sd), np.concatenate(squares), least)
    if kept is not None:
        np.savez(kept, **{key: getattr(whole, key) for key in _KEYS})
    return whole


_KEYS = ("errors", "sd", "squares")


def _after(estimator: Any, played: RollOut) -> Any:
    """State of a batch of runs that are in phase, after all that they recorded."""
    chunks = [chunk for _, chunk in played.chunks]
    channels = {
        name: replace(channel, values=np.concatenate([c.channels[name].values for c in chunks], axis=-1))
        for name, channel in chunks[0].channels.items()
    }
    whole = replace(chunks[0], t=np.concatenate([c.t for c in chunks]), channels=channels)
    return estimator.update(estimator.reset(len(played.seeds)), whole)


if __name__ == "__main__":
    main()
