"""A test that is repeated: the scenario's profile, with the instruments switched off and on before each repeat."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.rig import CHUNK, Normals, Readings, Rig, RigState
from insenv.scenario.build import Scenario

Progress = Callable[[int, int], None]


def campaign(
    scenario: Scenario,
    seed: int,
    repeats: int,
    preheat: float = 0.0,
    chunk: int = 2 * CHUNK,
    progress: Progress | None = None,
) -> Iterator[tuple[int, Readings]]:
    """Number of the power-up, from 1, and a chunk of its readings, one after the other: memory does not grow.

    Each repeat has the values of its own that ``[run_to_run]`` asks for and begins with the table at its zero mark, at
    the time ``preheat`` [s], for which the instrument was on and was not read. Noise is that of the run ``seed`` and
    goes on. An effect with a memory (``bias_thermal_lag``) is as at the start of a run.

    Raises
    ------
    InputError
        If the scenario has no table, or a number is negative.
    """
    length = scenario.rig.plant.repeatable
    if length is None:
        raise InputError(f"{scenario.path}: a campaign wants a [table] with a [profile]")
    if repeats < 1 or not 0 <= preheat < float("inf"):
        raise InputError(f"{repeats} repeats and a preheat of {preheat:g} s given; wanted 1 or more, and zero or more")
    samples = min(scenario.samples, round(length * scenario.rig.rate))
    return _played(scenario, (seed, repeats, samples), preheat, chunk, progress)


def _played(
    scenario: Scenario, run: tuple[int, int, int], preheat: float, chunk: int, progress: Progress | None
) -> Iterator[tuple[int, Readings]]:
    seed, repeats, samples = run
    normals = Normals(scenario.rig, seed)
    sizes = [min(chunk, samples - start) for start in range(0, samples, chunk)]
    drawn = _drawn_ahead(normals, repeats * sizes)
    for power_up in range(1, repeats + 1):
        rig = scenario.cast(seed, power_up)
        state = _warm(rig, rig.begin(normals.start([power_up])), preheat)
        done = (power_up - 1) * samples
        for n in sizes:
            readings, state = rig.advance(state, None, n, next(drawn))
            yield power_up, readings
            done += n
            if progress is not None:
                progress(done, repeats * samples)


def _drawn_ahead(normals: Normals, sizes: Sequence[int]) -> Iterator[Floats]:
    """Unit normals of each chunk, drawn while the one before is worked on: a third of the time goes there."""
    with ThreadPoolExecutor(1) as pool:
        coming = pool.submit(normals.draw, sizes[0])
        for n in sizes[1:]:
            z = coming.result()
            coming = pool.submit(normals.draw, n)
            yield z
        yield coming.result()


def _warm(rig: Rig, state: RigState, preheat: float) -> RigState:
    """The state after a time that nothing happened in but that clocks went on; the noise is where it began."""
    passed = round(preheat * rig.rate)
    if not passed:
        return state
    _, begun = rig.advance(state, None, 1, np.zeros((sum(rig.draws), 1)))
    return RigState(passed, rig.plant.later(state.plant, passed / rig.rate), begun.sensors)
