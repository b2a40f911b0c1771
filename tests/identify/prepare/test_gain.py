"""A gain that is no small error, and that nobody declared, is what the declared model lacks."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from simulated_runs import gyro_run, manifest, use

from insenv.close import close
from insenv.core.errors import InputError
from insenv.identify.fit.gls import solve
from insenv.identify.fit.heldout import Score
from insenv.identify.prepare.gain import undeclared_gain
from insenv.identify.prepare.problems import prepare

DT, N = 0.02, 4000


def written(folder: Path, gain: float, declared: str = '"bias"', bent: float = 0.0, size: float = 1.0) -> Path:
    """A gyro of which the axis sees ``gain`` of a table that is turned by hand, with a ``bent`` response."""
    rng = np.random.default_rng(5)
    t = DT * np.arange(N)
    rate = size * (1.5 * np.sin(0.9 * t) * np.sin(0.13 * t) + 0.5 * np.sin(2.1 * t))
    read = gain * rate + bent * np.sin(7 * rate) + 0.003 + 0.005 * rng.standard_normal(N)
    shown = rate + 1e-3 * rng.standard_normal(N)
    np.savetxt(folder / "run.csv", np.column_stack([t, read, shown]), "%.9g", ",", header="t,g,w", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\n'
        'table_rate = { column = "w", unit = "rad/s", source = "encoder" }\n'
        f'[model]\ntarget = "gyro"\ndeclared = [{declared}]\n'
    )
    return folder / "run.toml"


@pytest.mark.parametrize("gain", [0.04, 0.2, 2.0])
def test_an_undeclared_gain_is_named_with_its_size(tmp_path: Path, gain: float) -> None:
    """Within four standard deviations; held-out data are judged with a gain of one before."""
    (found,) = close(written(tmp_path, gain)).targets
    (scale,) = (added for added in found.added if added.effect == "scale_factor")
    (c,) = scale.parameters
    assert abs(c.value - (gain - 1)) < max(4 * c.sd, 0.002)
    assert c.sd < 0.02
    assert scale.p_value < 1e-6
    assert found.held_out.after < 0.1 * found.held_out.before
    assert found.verdict in ("effects-found", "effects-found-incomplete")


def test_a_gain_of_the_response_that_the_fit_does_not_bear_out_is_said_and_not_named() -> None:
    """By the response 0.5 of a rate that the bins see whole: a reference that is late by a second showed such a one."""
    run = gyro_run("sine", 7, duration=600.0, noise={"angle_random_walk": 1e-5})
    prepared = prepare(manifest(declared=("bias",)), (run.recording,), (use(len(run.recording)),), "gyro")
    scores, fit = (Score(1.0, 1.0, 1.0, 1.0, 1.0),) * 2, solve(prepared.problem, prepared.model)
    (seen,) = prepared.problem.exposures
    problem = replace(prepared.problem, exposures=(replace(seen, motion=replace(seen.motion, gain=0.5)),))
    whole = problem.measured_as(problem.y + 0.5 * problem.bins.mean((seen.motion.rate,)))
    halved = partial(undeclared_gain, whole, fit, prepared.model, scores)
    assert halved(alpha=0.01)[0] == ()
    (said,) = halved(alpha=0.01)[1]
    assert "is not told: 0.5 ±" in said
    assert halved(alpha=1.0)[0] and not halved(alpha=1.0)[1]


def test_it_is_named_beside_a_curve_without_a_cause(tmp_path: Path) -> None:
    """A curve of the rate holds a gain as well: of the two the gain has a cause."""
    (found,) = close(written(tmp_path, 0.2, bent=0.05)).targets
    assert any(added.generic for added in found.added)
    (scale,) = (added for added in found.added if added.effect == "scale_factor")
    assert abs(scale.parameters[0].value + 0.8) < 0.1


def test_a_declared_gain_is_an_estimate_and_no_finding(tmp_path: Path) -> None:
    (found,) = close(written(tmp_path, 0.2, '"bias", "scale_factor"')).targets
    assert not any(added.effect == "scale_factor" for added in found.added)
    (c,) = (row for row in found.estimates_after if row.effect == "scale_factor")
    assert c.value == pytest.approx(-0.8, abs=0.01)


def test_a_scale_factor_of_minus_one_is_no_answer(tmp_path: Path) -> None:
    """Of a table that turns too little for a refusal: the reading has nothing of it."""
    (found,) = close(written(tmp_path, 0.0, '"bias", "scale_factor"', size=0.1)).targets
    assert found.verdict == "unexplained-structure"
    assert any("does not follow it" in reason for reason in found.reasons)


def test_what_follows_nothing_of_the_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not turn with the table"):
        close(written(tmp_path, 0.001))
