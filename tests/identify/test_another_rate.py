"""Laws of a measured rate that may be the reference's own: beside a gain that no gyro has, or as small as its errors.

Seeds are fixed; the cubic stands with more than 30 deviations of the noise.
"""

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.assemble import findings
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.loop import trace
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.doubts.sizes import nothing_as_well
from insenv.identify.search.doubts.unfinished import unfinished
from insenv.identify.search.settle import dropped, without_repeated
from insenv.identify.search.tracks import Track

DT = 0.02


def _have_no_name_where_added_twice(track: Track) -> None:
    """Ripples of other shapes, beside all that the track has."""
    steps = tuple(
        replace(track.steps[0], hit=replace(track.steps[0].hit, term=term, candidate=Candidate(term.effect, (term,))))
        for term in (Term(by_key("compensation_ripple"), (m, 1.0)) for m in (3.0, 5.0))
    )
    fit = solve(track.problem, (*track.fit.model, *(step.hit.term for step in steps)))
    twice = without_repeated(replace(track, fit=fit, steps=(*track.steps, *steps)))
    assert [step.hit.candidate.effect.key for step in twice.steps] == [s.hit.candidate.effect.key for s in track.steps]
    assert twice.fit.model == track.fit.model
    (why,) = (why for why in unfinished(twice, 0.01) if "was added more than once" in why)
    assert why.startswith("compensation_ripple")


@pytest.mark.parametrize(("gain", "doubted"), [(0.52, True), (0.98, False)])
def test_a_law_of_the_rate_is_named_as_surely_as_the_reference_is_the_rate(gain: float, doubted: bool) -> None:
    rng = np.random.default_rng(5)
    t = DT * np.arange(6000.0)
    levels = np.repeat(rng.permutation(np.linspace(-1.5, 1.5, 24)), 250)
    rate = np.convolve(levels, np.ones(25) / 25, mode="same")
    angle = np.cumsum(rate) * DT + 2e-4 * rng.standard_normal(len(t))
    gyro = gain * (rate - 0.005 * rate**3) + 1e-3 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad", source="encoder")}
    runs, asked = (Recording(t, channels),), manifest(declared=("bias",))
    outcome = trace(asked, runs, (use(len(t)),))
    (target,) = findings(asked, runs, outcome).targets
    assert "scale_factor_cubic" in {one.effect for one in target.added}
    assert any("none of a gyro" in reason for reason in target.reasons) == doubted

    (track,) = outcome.tracks
    again = replace(track, steps=track.steps + track.steps)
    told = [any("was added more than once" in why for why in unfinished(one, 0.01)) for one in (track, again)]
    assert told == [False, True]
    assert without_repeated(track) is track
    _have_no_name_where_added_twice(track)
    own = estimates(track.problem, track.fit)
    assert nothing_as_well(track, own) is None
    wide = {term: tuple(replace(row, sd=abs(row.value) / 1.9) for row in rows) for term, rows in own.items()}
    weak = nothing_as_well(track, wide)
    assert weak is not None
    left = track
    while weak is not None:
        left = dropped(left, *weak)
        weak = nothing_as_well(left, wide)
    assert not {"scale_factor", "scale_factor_cubic"} & {step.hit.candidate.effect.key for step in left.steps}
    weak = nothing_as_well(track, wide)
    assert weak is not None
    fewer = dropped(track, *weak)
    assert len(fewer.steps) == len(fewer.rivalries) == len(track.steps) - 1
    assert fewer.refusals[-1].unsized and "1.9 standard deviations from nothing" in fewer.refusals[-1].reason
