"""The bound of the rate table's scale factor, with power-ups, and the estimator that reaches it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimators.rate_table.rate_gls import RateGls
from insenv.core.errors import InputError
from insenv.core.estimate import Estimate
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.units import DEG, PPM
from insenv.envs.rollout import RollOut, roll_out
from insenv.envs.task import Task
from insenv.evaluate.bounds import bounds
from insenv.evaluate.runs import task_of
from insenv.scenario import load
from insenv.systems.rate_table.bound import parameters_bound, run_to_run, scale_factor_bound

SCENARIO = "rate_table/b215"
CHANGES: dict[str, Any] = {"undeclared": {}, "instrument.sampling": "20 Hz", "duration": "120 s"}


def played(power_ups: bool = False, seeds: range = range(1), **changes: Any) -> tuple[Task, RollOut]:
    task = task_of(SCENARIO, {**CHANGES, **changes})
    return task, roll_out(task, _Steps(power_ups), None, seeds)


class _Steps:
    """Ten seconds at each of two rates, in turns; the gyro switched off and on at the middle where asked for."""

    def __init__(self, power_ups: bool) -> None:
        self.power_ups = power_ups

    def reset(self, batch: int | None = None) -> tuple[int, int]:
        return batch or 1, 0

    def act(self, state: tuple[int, int], chunk: Any, estimate: Any) -> tuple[Floats, tuple[int, int]]:
        runs, step = state
        rate = 30 * DEG * (1 if step % 20 < 10 else -1)
        signal = -1.0 if self.power_ups and step == 60 else 0.0
        return np.tile([rate, signal], (runs, 1)), (runs, step + 1)


def after(estimator: RateGls, run: RollOut) -> Estimate:
    state = estimator.reset(len(run.seeds))
    for _, chunk in run.chunks:
        state = estimator.update(state, chunk)
    return estimator.estimate(state)


def test_the_bound_is_what_the_efficient_estimator_tells_and_evaluate_asks_for() -> None:
    task, run = played(seeds=range(2))
    record, scenario = run.recording(0), load(SCENARIO, CHANGES)
    least = scale_factor_bound(task.datasheet, record, scenario)
    assert bounds(task.datasheet, record, ("scale_factor",), scenario) == {"scale_factor": least}
    assert bounds(task.datasheet, record, ("scale_factor",)) == {}
    # Another task asks for the scale factor of the moment.
    assert bounds(task.datasheet, record, ("scale_factor",), load("north_finder/scale_factor_test")) == {}
    told = after(RateGls(task.datasheet), run).of("scale_factor")[1]
    np.testing.assert_allclose(told, least, rtol=1e-4)
    assert 2 * PPM < least < 20 * PPM


def test_before_a_dwell_it_is_the_prior_and_time_and_priors_tell_more() -> None:
    task, run = played()
    whole = run.recording(0)
    sd = [parameters_bound(task.datasheet, part, {})[0].sd("scale_factor.c") for part in (_cut(whole, 600), whole)]
    assert sd[1] < sd[0] < 200 * PPM
    tight = replace(task.datasheet, declared=tuple(_known(d) for d in task.datasheet.declared))
    assert "scale_factor.c" not in parameters_bound(tight, whole, {})[0].names
    assert scale_factor_bound(tight, whole, load(SCENARIO, {**CHANGES, "run_to_run": {}})) == np.inf
    # Its mean is known, and what this power-up has of its own is not.
    joined = (sd[1] ** -2 + (6 * PPM) ** -2) ** -0.5
    assert scale_factor_bound(tight, whole, load(SCENARIO, CHANGES)) == pytest.approx(joined, rel=0.01)
    quiet = replace(task.datasheet, noise={}, encoder_noise=0.0, pulse=0.0)
    assert scale_factor_bound(quiet, whole, load(SCENARIO, CHANGES)) == np.inf


def _known(declared: Any) -> Any:
    return replace(declared, sd=tuple(0.0 for _ in declared.sd)) if declared.effect == "scale_factor" else declared


def _cut(recording: Recording, rows: int) -> Recording:
    channels = {name: replace(c, values=c.values[:rows]) for name, c in recording.channels.items()}
    return replace(recording, t=recording.t[:rows], channels=channels, segments=())


def test_an_earlier_power_up_tells_what_is_common_and_no_more() -> None:
    task, run = played(power_ups=True)
    record, scenario = run.recording(0), load(SCENARIO, CHANGES)
    assert set(record.values("power", "1")) == {1.0, 2.0}
    assert run_to_run(scenario) == pytest.approx({"bias.c": 0.35 * DEG / 3600, "scale_factor.c": 6 * PPM})

    def sd(recording: Recording, own: float) -> float:
        again = {"bias.c": 0.35 * DEG / 3600, "scale_factor.c": own}
        return parameters_bound(task.datasheet, recording, again)[0].sd("scale_factor.c")

    last = _from(record, int(np.flatnonzero(np.diff(record.values("power", "1")))[0]) + 1)
    # Nearly all of the spread is drawn anew: the earlier power-up tells nothing; next to none: it tells as much.
    assert sd(record, 199.9 * PPM) == pytest.approx(sd(last, 199.9 * PPM), rel=1e-3)
    assert sd(record, 1e-9) == pytest.approx(sd(last, 1e-9) / np.sqrt(2), rel=0.03)
    assert sd(record, 1e-9) < sd(record, 6 * PPM) < sd(last, 6 * PPM)


def _from(recording: Recording, row: int) -> Recording:
    channels = {name: replace(c, values=c.values[row:]) for name, c in recording.channels.items()}
    return replace(recording, t=recording.t[row:], channels=channels, segments=())


# ------------------------------------------------------------------------------------------------- rate_gls


def test_the_estimate_does_not_depend_on_chunks_or_batch() -> None:
    task, run = played(power_ups=True, seeds=range(3))
    estimator = RateGls(task.datasheet)
    whole = after(estimator, run)
    for row in range(3):
        record, state = run.recording(row), estimator.reset()
        for a in range(0, len(record), 77):
            state = estimator.update(state, _from(_cut(record, a + 77), a))
        alone = estimator.estimate(state)
        np.testing.assert_allclose(alone.mean, whole.mean[row], rtol=1e-9)
        np.testing.assert_allclose(alone.cov, whole.cov[row], rtol=1e-9)


def test_before_data_and_at_rest_it_tells_the_prior() -> None:
    sheet = task_of(SCENARIO, CHANGES).datasheet
    estimator = RateGls(sheet)
    for batch in (None, 2):
        found = estimator.estimate(estimator.reset(batch))
        assert found.names == ("scale_factor", "bias") and found.mean.shape == ((2,) if batch is None else (2, 2))
        np.testing.assert_allclose(found.of("scale_factor")[1], np.hypot(200, 6) * PPM, rtol=1e-6)
    t = np.arange(1, 401) / 20.0
    still = Recording(
        t, {"gyro": Channel(np.zeros(400), "rad/s", "interval"), "table_angle": Channel(np.zeros(400), "rad")}
    )
    rested = estimator.estimate(estimator.update(estimator.reset(), still))
    assert rested.of("scale_factor")[1] == pytest.approx(np.hypot(200, 6) * PPM, rel=1e-3)
    assert rested.of("bias")[1] < 0.9 * found.of("bias")[1][0]


def test_it_says_what_it_cannot_do() -> None:
    sheet = task_of(SCENARIO, CHANGES).datasheet
    with pytest.raises(InputError, match="tells of no noise"):
        RateGls(replace(sheet, noise={}, encoder_noise=0.0, pulse=0.0))
    with pytest.raises(InputError, match="lies in the table plane"):
        RateGls(replace(sheet, mounting=replace(sheet.mounting, tilt=0.0)))
