"""Clocks that come apart are told, with what one gains; one skew, of whatever recording, is not taken for two.

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
from insenv.effects.catalogue import CATALOGUE
from insenv.identify.assemble import findings
from insenv.identify.fit.clocks import Skews, skews_apart
from insenv.identify.fit.gls import solve
from insenv.identify.loop import trace
from insenv.identify.prepare.problems import prepare


def recorded(one: Case) -> Recording:
    gyro, angle = Channel(one.gyro, "rad/s", "interval"), Channel(one.angle, "rad", source="encoder")
    return with_reference(Recording(one.t, {"gyro": gyro, "table_angle": angle}))


def told(one: Case) -> Skews | None:
    prepared = prepare(manifest(), (recorded(one),), (use(len(one.t)),), "gyro", tones=False, holds=False)
    return skews_apart(prepared.problem, solve(prepared.problem, prepared.model))


def gaining(one: Case, rate: float) -> Case:
    return replace(one, gyro=np.interp(one.t + rate * (one.t - one.t[0]), one.t, one.gyro))


def losing(one: Case, rows: int) -> Case:
    at = len(one.t) // 4
    return replace(one, gyro=np.concatenate([one.gyro[:at], one.gyro[at + rows :], one.gyro[-rows:]]))


@pytest.mark.parametrize("kind", ["clean", "flex"])
def test_one_skew_is_the_same_in_all_parts(kind: str) -> None:
    assert all(told(case(seed, kind, "hand", 60.0, row=0.02)) is None for seed in range(8))


@pytest.mark.parametrize("rate", [0.002, -0.002])
@pytest.mark.parametrize("seed", range(2))
def test_two_clocks_are_told_with_what_one_gains(seed: int, rate: float) -> None:
    found = told(gaining(case(seed, "clean", "hand", 60.0, row=0.02), rate))
    assert found is not None
    gained, sd = found.gains
    assert abs(abs(gained) - abs(rate)) < max(4 * sd, 0.1 * abs(rate))
    assert "two clocks of which one gains" in found.sentence("gyro")
    assert "rows that were lost" not in found.sentence("gyro")


@pytest.mark.parametrize("seed", range(2))
def test_rows_that_were_lost_are_a_jump(seed: int) -> None:
    found = told(losing(case(seed, "clean", "hand", 60.0, row=0.02), 3))
    assert found is not None
    assert abs(found.jump) == pytest.approx(0.06, rel=0.2)
    assert "rows that were lost" in found.sentence("gyro")
    assert "two clocks" not in found.sentence("gyro")


def test_clocks_that_come_apart_are_a_reason_and_widen_the_skew() -> None:
    one = recorded(gaining(case(1, "clean", "hand", 60.0, row=0.02), 0.002))
    asked = manifest(declared=("bias", "scale_factor", "timing_skew"))
    outcome = trace(asked, (one,), (use(len(one)),), CATALOGUE)
    (found,) = findings(asked, (one,), outcome).targets
    assert any("come apart in time" in reason for reason in found.reasons)
    (skew,) = (e for e in found.estimates_after if e.effect == "timing_skew")
    assert skew.sd > 0.005
