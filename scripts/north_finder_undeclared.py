"""Close the loop on a north finder whose encoder is eccentric, and nobody said so: the story, step by step.

python scripts/north_finder_undeclared.py --seed 11
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import gymnasium
import numpy as np

import insenv  # noqa: F401 - registers the environment
from estimators.rate_policies import ConstantRate, Proposed
from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.estimate import Policy
from insenv.core.units import ARCSEC
from insenv.envs.recorder import Recorder
from insenv.identify.findings import Estimate, Findings, TargetFindings

SCENARIO = "north_finder/undeclared"
#: A standard deviation of north beyond this is no finding of it [arcsec].
LITTLE_KNOWN = 3600.0


@dataclass(frozen=True)
class Told:
    """What closing the loop made of one run, and where north was [rad]."""

    found: Findings
    azimuth: float

    @property
    def gyro(self) -> TargetFindings:
        """What was found on the gyro."""
        return self.found.targets[0]

    def errors(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """North error and its standard deviation [arcsec], before and after the model was mended."""
        (azimuth,) = (d for d in self.gyro.derived if d.name == "azimuth")
        return self._error(azimuth.before), self._error(azimuth.after)

    def _error(self, estimate: Estimate) -> tuple[float, float]:
        wrapped = np.angle(np.exp(1j * (estimate.value - self.azimuth)))
        return float(wrapped / ARCSEC), estimate.sd / ARCSEC


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seed", type=int, default=11)
    seed = parser.parse_args().seed
    env = Recorder(gymnasium.make("insenv/NorthFinder-v0", scenario=SCENARIO))
    try:
        tell(env, seed)
    except InputError as error:
        sys.exit(f"north_finder_undeclared: {error}")


def tell(env: Recorder, seed: int) -> tuple[Told, Told]:
    """Print the story of one seed; what the two runs told."""
    datasheet = env.unwrapped.task.datasheet  # type: ignore[attr-defined]
    print(f"1. {datasheet.duration:g} s at 10 deg/s one way.")
    one = closed(env, ConstantRate(datasheet), seed)
    report(one)
    (proposed, *_) = one.gyro.next_experiment
    if proposed.profile is None:
        raise InputError(f"{proposed.procedure} was proposed; wanted something that the table alone can do")
    print(f"\n2. It proposes to {proposed.procedure}\n   which separates {' and '.join(proposed.separates)}.")
    two = closed(env, Proposed(datasheet, proposed.profile), seed)
    report(two)
    return one, two


def closed(env: Recorder, policy: Policy, seed: int) -> Told:
    """Play one run, save what was recorded, close the loop on it."""
    _, info = env.reset(seed=seed)
    state, chunk, over = policy.reset(), None, False
    while not over:
        action, state = policy.act(state, chunk, None)
        _, _, terminated, truncated, info = env.step(action)
        chunk, over = env.chunk, terminated or truncated
    with TemporaryDirectory() as folder:
        return Told(close(env.save(Path(folder))), info["truth"]["azimuth"])


def report(told: Told) -> None:
    """What was found, and the north error."""
    print(f"   Verdict: {told.found.verdict}.")
    for added in told.gyro.added:
        key = added.effect if added.order is None else f"{added.effect}:{added.order}"
        rivals = f", which may as well be {', '.join(added.confounded_with)}" if added.confounded_with else ""
        print(f"   Found: {key}{rivals}.")
    for when, (error, sd) in zip(("before", "after"), told.errors(), strict=True):
        doubt = " (it no longer claims to know north)" if sd > LITTLE_KNOWN else ""
        print(f"   North error {when}: {error:.0f} arcsec; standard deviation told: {sd:.0f} arcsec{doubt}.")


if __name__ == "__main__":
    main()
