"""Environments: one pure, batched task with two thin Gymnasium skins.

`insenv.envs.task` steps rows of runs together, `insenv.envs.batch` keeps them through resets,
`insenv.envs.single` and `insenv.envs.vector` are `gymnasium.Env` and `gymnasium.vector.VectorEnv` over it. A
system is one file beside them: `insenv.systems.north_finder.env`.
"""
