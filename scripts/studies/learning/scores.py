"""What random, constant, documented and learnt policies earn in each environment: docs/results/learning.md.

    pip install 'insenv[rl]'
    python scripts/studies/learning/scores.py [--runs 64] [--steps 20000] [--only NorthFinder] [--page PAGE]

PPO of Stable-Baselines3, with its own settings but for a smaller first spread and a longer sight, learns on
`gymnasium.make(..., normalised=True)`, on one thread. All policies are judged on the same runs, which no training saw.
What is done is kept in a folder, environment by environment, as by `scripts/leaderboard.py`.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import insenv  # noqa: F401 - registers the environments
from insenv.core.files import write_whole
from insenv.core.recording import Floats
from insenv.envs.normalised import Normalised
from insenv.envs.rollout import roll_out

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "scripts"))
from studies.result_page import Section, table, write  # noqa: E402 - of the folder above

PAGE = ROOT / "docs/results/learning.md"
HEAD = """# What policies earn

Returns of the [environments](../environments.md): score of the last belief less the cost of time. Written by
`python scripts/studies/learning/scores.py`. `random` draws from the whole action space, of the environment as it is and
of the `normalised` one; `constant` always gives one command, the best of a few. The documented policies are those of
[estimators](../estimators.md). PPO (Stable-Baselines3) sees the normalised observation and nothing else, on one
thread; `before`
is the same network before its first step. All are judged on the same runs, seeds that no training saw; intervals hold
with 95 %.
"""
#: First seed of the runs that judge; training draws its own, far above.
FIRST = 1000
#: Runs that are learnt from side by side, and how the learner differs from the framework's own settings.
TOGETHER = 8
SETTINGS: Mapping[str, Any] = {
    "n_steps": 64,
    "batch_size": 128,
    "n_epochs": 6,
    "learning_rate": 7e-4,
    "gamma": 0.999,
    "gae_lambda": 0.95,
    "policy_kwargs": {"log_std_init": -1.2},
}


@dataclass(frozen=True)
class Study:
    """An environment in steps that a learner can count, and who is compared."""

    settings: Mapping[str, Any]
    estimator: str
    policies: tuple[str, ...]
    constants: tuple[float, ...]


STUDIES = {
    "NorthFinder": Study(
        {"step_s": 30.0, "sampling": 20.0},
        "north_gls",
        ("constant_rate", "bidirectional", "rate_choice", "greedy_north", "horizon_north"),
        (0.0, 0.4, 1.0),
    ),
    "TwoPosition": Study(
        {"step_s": 20.0, "sampling": 20.0, "scenario": "two_position/published_a2"},
        "two_position_joint",
        ("published_schedule", "covariance_triggered", "three_rests", "horizon_two_position"),
        (0.0, 1.0),
    ),
    "RateTable": Study(
        {"step_s": 30.0, "sampling": 20.0, "changes": {"duration": "600 s"}},
        "rate_line",
        ("optimal_ladder", "van_der_corput", "sweep_and_refine"),
        (0.0, 0.5, 1.0),
    ),
}
Act = Callable[[Floats], Any]


def environment(name: str, normalised: bool = True) -> Any:
    study = STUDIES[name]
    settings: dict[str, Any] = {**study.settings, "estimator": study.estimator, "normalised": normalised}
    return gymnasium.make(f"insenv/{name}-v0", disable_env_checker=True, **settings)


def returns(env: Any, act: Act, runs: int) -> tuple[Floats, Floats]:
    """Return and number of steps of each run."""
    found, steps = np.zeros(runs), np.zeros(runs)
    for k in range(runs):
        seen, _ = env.reset(seed=FIRST + k)
        ended = False
        while not ended:
            seen, reward, terminated, truncated, _ = env.step(act(seen))
            found[k] += reward
            steps[k] += 1
            ended = terminated or truncated
    return found, steps


def drawn(space: Any) -> Act:
    return lambda _: space.sample()


def steady(command: float) -> Act:
    return lambda _: np.array([command, 0.0], np.float32)


def shown(values: Floats) -> str:
    return f"{values.mean():.2f} ± {1.96 * values.std(ddof=1) / len(values) ** 0.5:.2f}"


def learner(name: str, seed: int) -> Any:
    """PPO that has seen nothing."""
    try:
        import torch
        from stable_baselines3 import PPO
        from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize
    except ImportError as error:
        raise SystemExit(f"scores: {error}; wanted Stable-Baselines3: pip install 'insenv[rl]'") from None
    torch.set_num_threads(1)
    runs = DummyVecEnv([lambda: environment(name) for _ in range(TOGETHER)])
    # Rewards are scaled while it learns, as its makers advise; it is judged by the returns as they are.
    runs = VecNormalize(runs, norm_obs=False, norm_reward=True, gamma=SETTINGS["gamma"])
    return PPO("MlpPolicy", runs, device="cpu", seed=seed, **SETTINGS)


def studied(name: str, runs: int, steps: int) -> Section:
    study = STUDIES[name]
    env, plain = environment(name), environment(name, False)
    task = env.unwrapped.task
    rows: list[tuple[str, Floats, float]] = []

    def add(label: str, found: Floats, seconds: Floats) -> None:
        rows.append((label, found, float(np.mean(seconds))))
        print(f"{name}: {label}: {shown(found)}, {np.mean(seconds):.0f} s", flush=True)

    def played(label: str, where: Any, act: Act) -> Floats:
        found, count = returns(where, act, runs)
        add(label, found, count * task.step_s)
        return found

    for label, where in (("random", plain), ("random, normalised", env)):
        where.action_space.seed(0)
        played(label, where, drawn(where.action_space))
    constants = {c: returns(env, steady(c), runs) for c in study.constants}
    best = max(constants, key=lambda c: float(constants[c][0].mean()))
    add(f"constant, {best:g} of the largest command", constants[best][0], constants[best][1] * task.step_s)
    for policy in study.policies:
        rolled = roll_out(task, policy, study.estimator, range(FIRST, FIRST + runs), keep=False)
        add(f"`{policy}`", rolled.reward, rolled.time)
    model = learner(name, 0)

    def act(seen: Floats) -> Any:
        return model.predict(seen, deterministic=False)[0]

    def middle(seen: Floats) -> Any:
        return model.predict(seen, deterministic=True)[0]

    played("PPO before", env, act)
    began = time.monotonic()
    model.learn(steps)
    spent = time.monotonic() - began
    after = {
        f"PPO after {steps} steps, {how}": played(f"PPO after {steps} steps, {how}", env, chosen)
        for how, chosen in (("as it learns", act), ("middle of its actions", middle))
    }
    learnt = max(after.values(), key=lambda found: float(found.mean()))
    chance = next(found for label, found, _ in rows if label == "random, normalised")
    documented = max((row for row in rows if row[0].startswith("`")), key=lambda row: float(row[1].mean()))
    gain = learnt - chance
    header = ("policy", "return", "time [s]")
    settings = ", ".join(f"{key} = {value}" for key, value in study.settings.items())
    lines = (
        f"`{study.estimator}`, {settings}; {runs} runs.",
        "",
        *table(header, [(label, shown(found), f"{seconds:.0f}") for label, found, seconds in rows]),
    )
    verdict = (
        f"PPO earns {shown(gain)} more than random actions on the same runs after {steps} steps ({spent:.0f} s); the "
        f"best documented policy is {documented[0]} with {documented[1].mean():.2f}."
    )
    assert isinstance(env.unwrapped, Normalised)
    return Section(name, lines, verdict)


def sections(only: str | None, runs: int, steps: int, kept: Path) -> Iterator[Section]:
    kept.mkdir(parents=True, exist_ok=True)
    for name in STUDIES if only is None else (only,):
        file = kept / f"{name}_{runs}_{steps}.json"
        if not file.exists():
            write_whole(file, json.dumps(asdict(studied(name, runs, steps)), ensure_ascii=False))
        known = json.loads(file.read_text(encoding="utf-8"))
        yield Section(known["title"], tuple(known["lines"]), known["verdict"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=20_000)
    parser.add_argument("--only", choices=tuple(STUDIES))
    parser.add_argument("--page", type=Path, default=PAGE)
    parser.add_argument("--kept", type=Path, default=Path("out/learning"), help="folder of what is done")
    given = parser.parse_args()
    count = len(STUDIES) if given.only is None else 1
    write(given.page, HEAD, sections(given.only, given.runs, given.steps, given.kept), count)


if __name__ == "__main__":
    main()
