"""Acceptance on measured recordings: what each lacks is named, and data that no fit saw agree.

The figures are those of the recordings, not of a simulation: nothing here is random. Skipped, with a reason,
where the recordings are not on this machine.
"""

from dataclasses import replace
from math import degrees, radians, sin

import numpy as np
import pytest
from recorded import measured

from insenv.core.earth import EARTH_RATE
from insenv.data.load import read_recordings
from insenv.data.manifest import Manifest
from insenv.data.remarks import remarks
from insenv.data.split import split
from insenv.identify.assemble import findings
from insenv.identify.findings import Findings, TargetFindings
from insenv.identify.loop import trace
from insenv.identify.search.size import LEAST

DEG_PER_HOUR = radians(1) / 3600


def close(manifest: Manifest) -> Findings:
    recordings = read_recordings(manifest)
    outcome = trace(manifest, recordings, split(manifest, recordings))
    return findings(manifest, recordings, outcome, remarks(recordings))


def target(found: Findings, name: str) -> TargetFindings:
    return next(t for t in found.targets if t.target == name)


def names_added(found: TargetFindings) -> list[str]:
    return [added.effect for added in found.added]


def value(found: TargetFindings, effect: str) -> float:
    """First parameter of ``effect``, declared or added, after the loop is closed."""
    rows = [*found.estimates_after, *(p for added in found.added for p in added.parameters)]
    return next(row.value for row in rows if row.effect == effect)


@pytest.fixture(scope="module")
def vehicle() -> Findings:
    return close(measured.manifest("psins_lasergyro"))


@pytest.fixture(scope="module")
def chamber() -> Findings:
    return close(measured.manifest("tofupilot_thermal"))


@pytest.fixture(scope="module")
def two_positions() -> Findings:
    return close(measured.manifest("ln100_updown"))


@pytest.mark.parametrize(("name", "before"), [("accel_x", 0.0154), ("accel_y", 0.0171)])
def test_parked_vehicle_tilts(vehicle: Findings, name: str, before: float) -> None:
    found = target(vehicle, name)
    assert names_added(found)[0] == "base_tilt"
    assert value(found, "base_tilt") == pytest.approx(9.79, rel=0.01)  # gravity at this latitude and height
    assert found.held_out.averaging == pytest.approx(5.0)
    assert found.held_out.before == pytest.approx(before, rel=0.05)
    assert found.held_out.after <= 0.0010
    assert found.added[0].held_out_after <= 0.0010  # by the tilt alone


def test_parked_vehicle_has_an_explanation(vehicle: Findings) -> None:
    assert vehicle.verdict in ("effects-found", "effects-found-incomplete")


def test_gyro_y_by_itself_has_its_lag_among_what_it_may_be() -> None:
    """A walk of the noise hides the lag from the fitted rows, and a step is left: held-out rows say otherwise."""
    whole = measured.manifest("tofupilot_thermal")
    alone = replace(whole, model=replace(whole.model, targets=("gyro_y",)))
    (found,) = close(alone).targets
    may_be = {key for added in found.added for key in (added.effect, *added.confounded_with)}
    assert "bias_thermal_lag" in may_be
    assert found.verdict == "confounded"


def test_gyro_y_lags_behind_the_temperature(chamber: Findings) -> None:
    found = target(chamber, "gyro_y")
    assert "bias_thermal_lag" in names_added(found)
    # 0.00154 by ordinary least squares on single rows; weighted by the noise, on means of two rows, a little less.
    assert 0.0013 <= found.held_out.before <= 0.0016
    assert found.held_out.after <= 0.0008


def test_gyro_z_does_not_lag(chamber: Findings) -> None:
    """There a lag makes data that no fit saw worse: it must be refused, and the refusal told."""
    found = target(chamber, "gyro_z")
    assert "bias_thermal_lag" not in names_added(found)
    assert "bias_thermal_lag" in [rejected.effect for rejected in found.rejected]


@pytest.mark.parametrize("recording", ["vehicle", "chamber", "two_positions"])
def test_what_is_named_has_a_size_on_all_its_targets_together(recording: str, request: pytest.FixtureRequest) -> None:
    """A warm-up of 1 +- 5 mm/s^2 is none, be it significant on two axes together."""
    found: Findings = request.getfixturevalue(recording)
    sizes: dict[str, list[float]] = {}
    for one in (added for t in found.targets for added in t.added if not added.generic):
        first = one.parameters[0]
        sizes.setdefault(one.effect, []).append(first.value / first.sd)
    assert sizes
    for effect, z in sizes.items():
        assert float(np.hypot.reduce(z)) > LEAST, effect


@pytest.mark.parametrize(("line", "within"), [(29.9, 0.2), (19.0, 0.3), (9.2, 0.3)])
def test_dither_comes_back_as_lines(two_positions: Findings, line: float, within: float) -> None:
    tones = [added for added in target(two_positions, "gyro_x").added if added.effect == "tone"]
    found = [p.value for added in tones for p in added.parameters if p.parameter == "f"]
    assert any(abs(f - line) <= within for f in found), found


def test_means_without_the_dither_are_quiet(two_positions: Findings) -> None:
    held_out = target(two_positions, "gyro_x").held_out
    assert held_out.averaging == pytest.approx(2.0, rel=0.01)
    assert held_out.before == pytest.approx(1.1 * DEG_PER_HOUR, rel=0.1)
    assert held_out.after <= 0.25 * DEG_PER_HOUR


def test_two_positions_give_bias_and_earth_rate(two_positions: Findings) -> None:
    found = target(two_positions, "gyro_x")
    vertical = EARTH_RATE * sin(radians(51.0784))
    assert degrees(value(found, "bias")) * 3600 == pytest.approx(-0.254, abs=0.02)
    measured_rate = (1 + value(found, "scale_factor")) * vertical
    assert degrees(measured_rate) * 3600 == pytest.approx(11.73, abs=0.03)
