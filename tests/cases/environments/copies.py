"""One environment made twice: as a vector and as many single ones, from its description, from a pickle."""

from __future__ import annotations

import json
import pickle
from typing import Any

import gymnasium
from env_cases import assert_same
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from insenv.core.recording import Floats

ROWS = 4


def native_and_sync(
    kind: type, name: str, mode: AutoresetMode = AutoresetMode.NEXT_STEP, limit: int | None = None, **settings: Any
) -> tuple[Any, Any]:
    """The native vector environment, of that kind, and gymnasium's loop over single ones."""
    more: dict[str, Any] = {} if limit is None else {"max_episode_steps": limit}
    native = gymnasium.make_vec(name, num_envs=ROWS, autoreset_mode=mode, **settings, **more)
    sync = gymnasium.make_vec(
        name, num_envs=ROWS, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **settings, **more
    )
    assert isinstance(native.unwrapped, kind) and isinstance(sync.unwrapped, SyncVectorEnv)
    return native, sync


def assert_survives(env: gymnasium.Env[Any, Any], first: Floats, then: Floats, steps: int = 1) -> Any:
    """The last of the ``steps``, which a copy from the description and one from a pickle take bit for bit alike."""
    assert env.spec is not None
    text = env.spec.to_json()
    json.loads(text)
    again = gymnasium.make(EnvSpec.from_json(text))
    env.reset(seed=3)
    env.step(first)
    pickled = pickle.loads(pickle.dumps(env))
    again.reset(seed=3)
    again.step(first)
    for _ in range(steps):
        expected = env.step(then)
        assert_same(expected, pickled.step(then))
        assert_same(expected, again.step(then))
    return expected
