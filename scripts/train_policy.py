"""Train a policy of the two-position calibration by reinforcement learning: PPO on the belief, on one thread.

    pip install 'insenv[rl]'
    python scripts/train_policy.py [--steps 100000] [--envs 32] [--weights scripts/learnt_policy.json]

The agent sees what `learnt_policy.shown` makes of the belief of `two_position_joint` and earns the reward of the
environment: the information won, less the price of time and, at the end, of the error; of the error that the belief
expects, for that of one run is chance. The environment steps all runs together; it is played at 20 Hz and in steps of
five seconds, for the noise of a rest is the same. The weights go to a text file, and `learnt_policy:LearntPolicy` is a
plug-in that any machine can run and `insenv evaluate` can judge.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import gymnasium
import learnt_policy as learnt
import numpy as np
from numpy.typing import NDArray

import insenv  # noqa: F401 - registers the environments
from insenv.core.recording import Floats

SCENARIO, ESTIMATOR = "two_position/published_a2", "two_position_joint"
#: The same noise of a rest at a fifth of the work.
CHANGES = {"task.step": "5 s", "instrument.sampling": "20 Hz"}
#: At first an agent that knows nothing should rest mostly: else no run lasts long enough to learn from.
FIRST = (0.0, -2.5, -3.5)


class Belief:
    """The vector environment as flat observations and three actions; runs that end begin anew in the same step."""

    def __init__(self, runs: int, scenario: str = SCENARIO, changes: dict[str, Any] | None = None) -> None:
        self.env = gymnasium.make_vec(
            "insenv/TwoPosition-v0",
            num_envs=runs,
            scenario=scenario,
            estimator=ESTIMATOR,
            changes=CHANGES | (changes or {}),
            autoreset_mode="Disabled",
        )
        self.runs, self.seen = runs, learnt.begun((runs,))
        self.seconds = learnt.PIECE
        task: Any = getattr(self.env.unwrapped, "task")  # noqa: B009 - a vector environment of Gymnasium has none
        (self.quantity,) = task.quantities
        self.judge = task.judge

    def reset(self, seed: int | None = None) -> Floats:
        """All runs at their start; what is shown, shape (runs, 6)."""
        observation, _ = self.env.reset(seed=seed)
        self.seen = learnt.begun((self.runs,))
        return self._shown(observation)

    def step(self, chosen: NDArray[np.int64]) -> tuple[Floats, Floats, NDArray[np.bool_], Floats]:
        """What is shown next, rewards, which runs ended, and what those were shown last."""
        chosen = np.where(self.seen.turning > 0, learnt.STAY, chosen)
        observation, reward, terminated, truncated, info = self.env.step(learnt.ACTIONS[chosen])
        self.seen = learnt.gone_on(learnt.asked(self.seen, chosen), observation["turning"][:, 0] > 0, self.seconds)
        last = now = self._shown(observation)
        if (ended := terminated | truncated).any():
            reward = np.where(ended, reward - self._chance(observation["belief"], info), reward)
            observation, _ = self.env.reset(options={"reset_mask": ended})
            new = learnt.begun((self.runs,))
            parts = ("rest", "turns", "turning")
            self.seen = learnt.Seen(*(np.where(ended, getattr(new, p), getattr(self.seen, p)) for p in parts))
            now = self._shown(observation)
        return now, np.asarray(reward, float), ended, last

    def _chance(self, belief: Floats, info: Any) -> Floats:
        """By how much the verdict of the truth exceeds that of an error of one deviation, shape (runs,)."""
        found = self.judge.verdict(belief[:, :1], belief[:, 1:], info["truth"])
        return np.asarray(found + np.log1p((belief[:, 1] / self.quantity.demanded) ** 2))

    def _shown(self, observation: Any) -> Floats:
        seen = self.seen
        left = observation["time_left"][:, 0]
        return learnt.shown(observation["belief"][:, 1], left, seen.rest, seen.turns, seen.turning)


def vectors(belief: Belief, seed: int) -> Any:  # noqa: C901 - what the interface asks for, most of it empty
    """The same as a `VecEnv` of Stable-Baselines3."""
    from stable_baselines3.common.vec_env import VecEnv

    class Vectors(VecEnv):
        def __init__(self) -> None:
            seen = gymnasium.spaces.Box(-np.inf, np.inf, (learnt.SHOWN,), np.float32)
            super().__init__(belief.runs, seen, gymnasium.spaces.Discrete(len(learnt.ACTIONS)))
            self.waiting = np.zeros(belief.runs, np.int64)
            self.returns = np.zeros(belief.runs)
            self.lengths = np.zeros(belief.runs, np.int64)

        def reset(self) -> Any:
            return belief.reset(seed).astype(np.float32)

        def step_async(self, actions: Any) -> None:
            self.waiting = np.asarray(actions)

        def step_wait(self) -> Any:
            now, reward, ended, last = belief.step(self.waiting)
            self.returns += reward
            self.lengths += 1
            infos: list[dict[str, Any]] = [{} for _ in range(belief.runs)]
            for k in np.flatnonzero(ended):
                infos[k]["terminal_observation"] = last[k].astype(np.float32)
                infos[k]["episode"] = {"r": float(self.returns[k]), "l": int(self.lengths[k]), "t": 0.0}
            self.returns[ended], self.lengths[ended] = 0.0, 0
            return now.astype(np.float32), reward.astype(np.float32), ended, infos

        def close(self) -> None:
            belief.env.close()

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            return [None] * belief.runs

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            raise NotImplementedError

        def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
            raise NotImplementedError

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False] * belief.runs

    return Vectors()


def train(steps: int, runs: int, seed: int, tell: bool = True) -> list[dict[str, Any]]:
    """Layers of the policy after so many steps."""
    try:
        import torch
        from stable_baselines3 import PPO
    except ImportError as error:
        raise SystemExit(f"train_policy: {error}; wanted Stable-Baselines3: pip install 'insenv[rl]'") from None
    torch.set_num_threads(1)
    model = PPO(
        "MlpPolicy",
        vectors(Belief(runs), seed),
        n_steps=128,
        batch_size=512,
        n_epochs=8,
        learning_rate=1e-3,
        gamma=0.999,
        gae_lambda=0.98,
        ent_coef=0.003,
        policy_kwargs={"net_arch": [16, 16]},
        device="cpu",
        seed=seed,
        verbose=int(tell),
    )
    with torch.no_grad():
        model.policy.action_net.bias.copy_(torch.tensor(FIRST))
    model.learn(steps)
    hidden = [layer for layer in model.policy.mlp_extractor.policy_net if hasattr(layer, "weight")]
    return [
        {"weight": layer.weight.detach().numpy(), "bias": layer.bias.detach().numpy()}
        for layer in (*hidden, model.policy.action_net)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--steps", type=int, default=100_000, help="steps of five seconds, of all runs together")
    parser.add_argument("--envs", type=int, default=32, help="runs that are stepped together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--weights", type=Path, default=learnt.WEIGHTS)
    given = parser.parse_args()
    began = time.monotonic()
    layers = train(given.steps, given.envs, given.seed)
    learnt.saved(layers, given.weights)
    print(f"{given.weights}: {given.steps} steps in {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
