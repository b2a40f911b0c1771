"""Signs and order of the gyros' axes, where a table turns a unit about one axis at a time."""

from dataclasses import replace

import numpy as np
import pytest

from insenv.core.recording import Floats
from insenv.identify.positions.gyros.factor import other_axes, unaccounted
from insenv.identify.positions.gyros.rotations import Rotations, Turn

DT = 0.05


def one_axis_at_a_time(axes: str, signs: tuple[int, int, int], seed: int) -> Rotations:
    """Quarter turns of 2 s about the axes named, read by gyros of these signs; 5 mrad of errors of direction."""
    rng, n = np.random.default_rng(seed), 40
    turns: list[Turn] = []
    start, end, level = list[Floats](), list[Floats](), list[Floats]()
    for axis in axes:
        rates = np.zeros((n, 3))
        rates[:, "xyz".index(axis)] = 0.5 * np.pi / (n * DT)
        about = rates[0] / np.linalg.norm(rates[0])
        up = np.array([1.0, 0.0, 0.0]) if axis != "x" else np.array([0.0, 1.0, 0.0])
        after = np.cross(up, about) + 5e-3 * rng.standard_normal(3)
        after /= np.linalg.norm(after)
        turns.append(Turn(rates * signs, np.full(n, DT), len(turns), len(turns) + 1))
        start.append(up)
        end.append(after)
        level.append(_across(after))
    m = len(axes)
    every = np.ones(m, bool)
    return Rotations(
        tuple(turns),
        np.array(start),
        np.array(end),
        np.arange(m, dtype=float),
        every,
        every,
        np.array(level),
        np.eye(2 * m),
    )


def _across(direction: Floats) -> Floats:
    """Two directions across one, shape (2, 3)."""
    return np.linalg.svd(direction[None])[2][1:]


@pytest.mark.parametrize(("signs", "words"), [((1, -1, 1), "x, -y, z"), ((1, 1, -1), "x, y, -z"), ((1, 1, 1), "")])
def test_a_reversed_axis_about_which_few_turns_are_is_told(signs: tuple[int, int, int], words: str) -> None:
    """Two of nine turns show y, two show z: the median turn knows of neither.

    Errors of 5 mrad against a quarter turn: chance would need 60 standard deviations.
    """
    said = other_axes(one_axis_at_a_time("xxyxxzyzx", signs, seed=3))
    assert (f"taken as {words} beside" in said) if words else not said


def test_readings_of_half_the_rate_with_an_axis_reversed_are_told() -> None:
    """No factor and no sign alone tells these turns, and the loop said that nothing was wrong with them."""
    problem = one_axis_at_a_time("xyzxyzzz", (1, 1, -1), seed=4)
    turns = tuple(replace(turn, rates=0.5 * turn.rates) for turn in problem.turns)
    halved = replace(problem, turns=turns)
    said = unaccounted(halved, halved.errors((), np.zeros(0))[0])
    assert "0.5 of what they should be" in said and "taken as x, y, -z" in said
    right = one_axis_at_a_time("xyzxyzzz", (1, 1, 1), seed=4)
    assert unaccounted(right, right.errors((), np.zeros(0))[0]) == ""
