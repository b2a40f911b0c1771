"""Acceptance on measured triads that were held still in many attitudes: what they lack, and held-out rests that agree.

Nothing here is random. Skipped, with a reason, where the recordings are not on this machine. The figures are in g and
degrees, as their sources give them.
"""

from __future__ import annotations

from math import degrees

import pytest
from recorded import measured

from insenv.core.units import STANDARD_GRAVITY
from insenv.data.load import read_recordings
from insenv.data.manifest import Manifest
from insenv.effects.catalogue import by_key
from insenv.identify.findings import Findings, TargetFindings
from insenv.identify.positions.findings import position_findings
from insenv.identify.positions.trace import trace_positions

ACCELS, GYROS = (tuple(f"{kind}_{axis}" for axis in "xyz") for kind in ("accel", "gyro"))


def close(manifest: Manifest, *tried: str) -> Findings:
    recordings = read_recordings(manifest)
    found = trace_positions(manifest, recordings, tuple(map(by_key, tried)) or None)
    return position_findings(manifest, recordings, found, (), 0.01, 0)


def target(found: Findings, name: str) -> TargetFindings:
    return next(t for t in found.targets if t.target == name)


def added(found: TargetFindings) -> set[str]:
    return {a.effect for a in found.added}


@pytest.fixture(scope="module")
def xsens() -> Findings:
    return close(measured.manifest("imu_tk"))


@pytest.fixture(scope="module", params=["mikoff_imu0", "mikoff_imu1"])
def low_cost(request: pytest.FixtureRequest) -> Findings:
    return close(measured.manifest(request.param))


def test_axes_of_the_accelerometers_are_not_at_right_angles(xsens: Findings) -> None:
    for name in ACCELS:
        found = target(xsens, name)
        assert added(found) == {"non_orthogonality"} and found.verdict == "effects-found"
        assert found.held_out.before == pytest.approx(0.005 * STANDARD_GRAVITY, rel=0.1)
        assert found.held_out.after < 0.0003 * STANDARD_GRAVITY


def test_gyros_need_the_whole_matrix(xsens: Findings) -> None:
    for name in GYROS:
        found = target(xsens, name)
        assert {"non_orthogonality", "misalignment", "scale_factor"} <= added(found)
        assert degrees(found.held_out.before) > 2.8
        # An independent fit of nine parameters on clean rests leaves 0.35 deg, each turn by the others.
        assert degrees(found.held_out.after) < 1.3 * 0.352
        (alone,) = [r for r in found.rejected if r.effect == "scale_factor"]
        assert alone.reason.startswith("alone: ")


def test_scale_factor_alone_is_refused() -> None:
    found = target(close(measured.manifest("imu_tk"), "scale_factor"), "gyro_x")
    assert found.added == ()
    assert found.held_out.after == found.held_out.before
    assert [r.effect for r in found.rejected] == ["scale_factor"]


def test_low_cost_accelerometers(low_cost: Findings) -> None:
    for name in ACCELS:
        found = target(low_cost, name)
        assert "non_orthogonality" in added(found)
        assert found.held_out.before > 0.0014 * STANDARD_GRAVITY
        assert found.held_out.after < 0.0005 * STANDARD_GRAVITY


def test_g_sensitivity_of_low_cost_gyros_is_not_claimed(low_cost: Findings) -> None:
    for name in GYROS:
        found = target(low_cost, name)
        assert "g_sensitivity" not in added(found)
        assert any(r.effect == "g_sensitivity" and r.p_value > 0.05 for r in found.rejected)


def test_low_cost_gyros_need_the_whole_matrix(low_cost: Findings) -> None:
    """An independent fit of nine parameters on clean rests leaves 0.103 and 0.106 deg, each turn by the others."""
    for name in GYROS:
        found = target(low_cost, name)
        assert {"non_orthogonality", "misalignment", "scale_factor"} <= added(found)
        assert degrees(found.held_out.after) < 1.3 * 0.103


def test_a_short_session_tells_the_gyros_and_says_that_it_cannot_tell_the_accelerometers() -> None:
    found = close(measured.manifest("imucal"))
    for name in GYROS:
        gyro = target(found, name)
        assert added(gyro) == {"scale_factor", "misalignment"}
        # 2.16 deg before; the noise of half as many turns leaves 0.59.
        assert gyro.held_out.after < 0.4 * gyro.held_out.before
    for name in ACCELS:
        accel = target(found, name)
        assert accel.verdict == "unexplained-structure" and not accel.added
        assert any("more attitudes would tell" in reason for reason in accel.reasons), accel.reasons
        assert {"accel_scale_factor", "non_orthogonality"} <= {n.effect for n in accel.not_testable}
