"""The gain of a recording in its parts: alike where it is one, told and widened where it is not.

Recordings are simulated without insenv (`studies.hand_turned`); seeds are fixed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import manifest, use
from studies.hand_turned import Case, case

from insenv.core.recording import Channel, Recording
from insenv.data.reference import with_reference
from insenv.effects.timing import TimingSkew
from insenv.identify.fit.gls import solve
from insenv.identify.fit.parts import PartsApart, apart
from insenv.identify.fit.problem import Term
from insenv.identify.prepare.problems import prepare


def told(cases: list[Case]) -> PartsApart:
    channels = [
        {"gyro": Channel(c.gyro, "rad/s", "interval"), "table_angle": Channel(c.angle, "rad", source="encoder")}
        for c in cases
    ]
    runs = tuple(with_reference(Recording(c.t, own)) for c, own in zip(cases, channels, strict=True))
    uses = tuple(use(len(c.t)) for c in cases)
    prepared = prepare(manifest(), runs, uses, "gyro", tones=False, holds=False)
    fit = solve(prepared.problem, (*prepared.model, Term(TimingSkew(), per_run=len(cases) > 1)))
    term = next(t for t in fit.model if t.effect.id == "scale_factor")
    found = apart(prepared.problem, fit, term)
    assert found is not None
    return found


def with_gain(one: Case, gain: float) -> Case:
    return replace(one, gyro=one.gyro * gain / one.gain, gain=gain)


@pytest.mark.parametrize("kind", ["clean", "flex"])
@pytest.mark.parametrize("runs", [1, 2])
def test_one_gain_is_the_same_in_all_parts(kind: str, runs: int) -> None:
    """Of six recordings none is as rare as one in a thousand, and few are widened by half of their deviation."""
    found = [
        told([with_gain(case(10 * seed + run, kind, "hand", 40.0, row=0.02), 1.0) for run in range(runs)])
        for seed in range(6)
    ]
    assert min(one.chance for one in found) > 1e-3
    widened = [np.sqrt(one.added * np.sum(one.deviations**-2.0)) for one in found]
    assert np.mean(np.array(widened) > 0.5) < 0.3


@pytest.mark.parametrize("seed", range(3))
def test_a_gain_of_its_own_in_each_run_is_told(seed: int) -> None:
    """Two runs with 0.99 and 1.01: the common gain is no surer than half of their distance over root two."""
    runs = [with_gain(case(seed + 20 * k, "clean", "hand", 40.0, row=0.02), 0.99 + 0.02 * k) for k in range(2)]
    found = told(runs)
    assert found.chance < 1e-6
    assert 0.005 < np.sqrt(found.added) < 0.02


@pytest.mark.parametrize("seed", range(3))
def test_a_gain_that_changes_on_the_way_is_told(seed: int) -> None:
    """One run whose gain grows by 2 %, 1.2 % of it in the fitted rows."""
    one = with_gain(case(seed, "clean", "hand", 60.0, row=0.02), 1.0)
    found = told([replace(one, gyro=one.gyro * (1 + 0.02 * one.t / one.t[-1]))])
    assert found.chance < 1e-3
    assert np.sqrt(found.added) > 5e-4
