"""Two-position calibration without noise: the published equations, what they leave, and states that go on."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from north_cases import piece, row
from vehicle_cases import (
    A2,
    ACCEL,
    ALTITUDE,
    GYRO,
    LATITUDE,
    UG,
    A,
    Case,
    drawn,
    recording,
    table_1,
    truth,
    wrapped,
)

from estimators.two_position.alignment import Alignment
from estimators.two_position.alignment_told import INSTALLATION_SD, UNTOLD_SD, Sighting, Told
from estimators.two_position.equations import identify_position, identify_second, rates
from estimators.two_position.joint import TwoPositionJoint
from estimators.two_position.published import TwoPosition
from estimators.two_position.tied import TwoPositionTied
from insenv.core.earth import earth_rate_enu, gravity
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Channel, Floats, Recording, Site
from insenv.core.rows import rows
from insenv.core.units import ARCMIN, DEG, DEG_PER_HOUR

ALL: tuple[type[Alignment], ...] = (TwoPosition, TwoPositionTied, TwoPositionJoint)
G, (NORTH, UP) = float(gravity(LATITUDE, ALTITUDE)), earth_rate_enu(LATITUDE)[1:]
#: Nothing is known beforehand of what is sought.
WIDE = Sighting(0.1, 1e-4, 1e-4, 0.1, 0.1)
FIRST = Case(rests=(300.0,), turns=(), told_noise=A)
BOTH = Case(told_noise=A)


def run(kind: type[Alignment], case: Case, vertical: float = GYRO, sighting: Sighting | None = None) -> Estimate:
    estimator = kind(case.datasheet(), sighting)
    return estimator.estimate(estimator.update(estimator.reset(1), recording(case, table_1(1, vertical))))


def error(found: Estimate, case: Case, name: str, vertical: float = GYRO) -> float:
    """In arcmin, deg/h or micro-g."""
    true = truth(case, table_1(1, vertical))[name]
    unit = {"gyro": DEG_PER_HOUR, "accel": UG}.get(name.split("_")[0], ARCMIN)
    return float(wrapped(found.of(name)[0] - true)[0] / unit)


# ----------------------------------------------------------------------------------------------- without noise


def test_the_first_position_is_left_with_what_equation_8_says() -> None:
    found = run(TwoPosition, FIRST)
    # Products of misalignments, which one pass leaves, move 0.172 by 0.01 and 0.02 arcmin.
    assert error(found, FIRST, "pitch") == pytest.approx(0.185, abs=0.002)
    assert error(found, FIRST, "roll") == pytest.approx(-0.194, abs=0.002)
    assert error(found, FIRST, "heading") == pytest.approx(-2.844, abs=0.01)
    assert error(found, FIRST, "gyro_y") == pytest.approx(-0.001, abs=2e-4)
    tied = run(TwoPositionTied, FIRST, sighting=WIDE)
    # The prior of the north gyro's bias tells 0.008 arcmin of the pitch.
    assert error(tied, FIRST, "pitch") == pytest.approx(0.180, abs=0.005)
    assert error(tied, FIRST, "roll") == pytest.approx(-0.172, abs=0.005)
    assert error(tied, FIRST, "heading") == pytest.approx(-2.77, abs=0.08)


def test_the_second_position_of_the_published_method() -> None:
    found = run(TwoPosition, BOTH)
    for name, wanted, within in (
        ("heading", -0.092, 0.005),
        ("pitch", -0.004, 0.001),
        ("roll", 0.010, 0.001),
        ("gyro_x", 1.7e-4, 5e-5),
        ("gyro_y", 4e-5, 2e-5),
        ("accel_x", 2.9, 0.15),
        ("accel_y", 1.39, 0.05),
    ):
        assert error(found, BOTH, name) == pytest.approx(wanted, abs=within), name


def test_two_passes_leave_what_the_vertical_gyro_does() -> None:
    for vertical, heading in ((0.0, 0.01), (GYRO, 0.1)):
        found = run(TwoPositionTied, BOTH, vertical, WIDE)
        limits = {"pitch": 0.005, "roll": 0.005, "gyro_x": 2e-4 if vertical else 1e-4, "gyro_y": 1e-4}
        for name, limit in (limits | {"accel_x": 1.5, "accel_y": 1.5, "heading": heading}).items():
            assert abs(error(found, BOTH, name, vertical)) < limit, name


def test_the_joint_estimate_without_prior_is_exact() -> None:
    case = replace(BOTH, gyro_sd=(1e-3, 1e-3, 1e-3), accel_sd=1.0, accel_z_sd=0.0)
    errors = table_1()
    errors.accel[:, 2] = 0.0  # it makes gravity larger: no horizontal channel tells of it
    estimator = TwoPositionJoint(case.datasheet(), WIDE, sway=0.0, residual=(0.0, 1.0))
    found = estimator.estimate(estimator.update(estimator.reset(1), recording(case, errors)))
    limits = {"pitch": 1e-6, "roll": 1e-6, "heading": 5e-4, "gyro_x": 1e-6, "gyro_y": 1e-6}
    for name, limit in (limits | {"accel_x": 1e-4, "accel_y": 1e-4}).items():
        assert abs(error(found, case, name)) < limit, name
    # Its deviation is there nevertheless: the vertical gyro bias is hardly told.
    assert found.of("heading")[1][0] == pytest.approx(0.432 * ARCMIN, rel=0.02)
    assert found.of("gyro_z")[1][0] == pytest.approx(0.0828 * DEG_PER_HOUR, rel=0.02)


def test_deviations_are_those_of_the_note() -> None:
    for kind, wanted in ((TwoPosition, 0.256), (TwoPositionTied, 0.087), (TwoPositionJoint, 0.0775)):
        assert run(kind, BOTH).of("heading")[1][0] == pytest.approx(wanted * ARCMIN, rel=0.05)


@pytest.mark.parametrize("kind", [TwoPositionTied, TwoPositionJoint])
def test_a_third_rest_is_used(kind: type[Alignment]) -> None:
    two = Case(rests=(80.0, 80.0), turns=(np.pi,), told_noise=A, sampling=20.0)
    three = Case(rests=(160 / 3, 160 / 3, 160 / 3), turns=(np.pi, -np.pi), told_noise=A, sampling=30.0)
    assert run(kind, three).of("heading")[1] < 0.75 * run(kind, two).of("heading")[1]
    assert abs(error(run(kind, three), three, "heading")) < 0.1


# ------------------------------------------------------------------------------------------------- equations


def forward(phi: Floats, gyro: Floats, accel: Floats) -> Floats:
    """Coefficients of a position, to first order; gyro (3) and accel (2) in east, north, up."""
    u = np.cross(phi, [0.0, NORTH, UP]) - gyro
    bend = np.cross(u, [0.0, NORTH, UP])
    east = (-G * phi[1] + accel[0], -G * u[1] / 2, -G * bend[1] / 6)
    north = (G * phi[0] + accel[1], G * u[0] / 2, G * bend[0] / 6)
    return np.array([east, north]).T


def two_positions(angle: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Coefficients of position 2 after the first was corrected; phi, gyro and accel there."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    gyro, accel = np.array([1.0, 1.0, 0.0]) * GYRO, np.array([1.0, -1.0, 0.0]) * ACCEL
    left = np.array([-accel[1] / G, accel[0] / G, accel[0] / G * UP / NORTH - gyro[0] / NORTH])
    return forward(left, R @ gyro, (R @ accel)[:2]), left, (R @ gyro)[:2], (R @ accel)[:2]


def test_equations_6_and_7_undo_a_position() -> None:
    phi, gyro = np.array([1.5e-3, -8e-4, 9e-3]), np.array([0.0, 3e-8, 0.0])
    found = identify_position(forward(phi, gyro, np.zeros(2)), G, (NORTH, UP))
    np.testing.assert_allclose(found.phi, phi, rtol=1e-12)
    np.testing.assert_allclose(found.gyro_north, 3e-8, rtol=1e-9)
    np.testing.assert_allclose(found.u, np.cross(phi, [0.0, NORTH, UP]) - gyro, rtol=1e-9)
    later = found.propagated(np.array(300.0), (NORTH, UP))
    np.testing.assert_allclose(later, phi + 300 * found.u, rtol=0, atol=1e-5)


@pytest.mark.parametrize("angle", [-170.0, 60.0, 90.0, 170.0, 180.0])
def test_equations_14_to_16_undo_a_turn(angle: float) -> None:
    a, left, gyro, accel = two_positions(angle * DEG)
    found = identify_second(a, np.array(angle * DEG), G, (NORTH, UP))
    np.testing.assert_allclose(found.accel, accel, rtol=1e-9)
    np.testing.assert_allclose(found.gyro, gyro, rtol=1e-6)
    np.testing.assert_allclose(found.phi, left, rtol=1e-6)


def test_the_printed_m_and_n_fail_by_hundreds_of_arcmin() -> None:
    angle = 170 * DEG
    a, left, _, _ = two_positions(angle)
    # As printed: M = sin, N = cos; (15) with M + 1, (16) with N + 1 and + u_E.
    M, N = np.sin(angle), np.cos(angle)
    u = rates(a, G, (NORTH, UP))
    accel_east = ((M + 1) * a[0, 0] + N * a[0, 1]) / ((M + 1) ** 2 + N**2)
    gyro_north = -u[1] + (a[0, 1] - 0.0) * UP / G / 2
    gyro_east = (M * gyro_north + u[0]) / (N + 1)
    heading = (accel_east - a[0, 0]) / G * UP / NORTH - (u[0] + gyro_east) / NORTH
    assert abs(heading - left[2]) > 200 * ARCMIN
    assert abs(gyro_east) > 1.0 * DEG_PER_HOUR
    # At the optimum of 180 degrees it is singular.
    assert abs(np.cos(np.pi) + 1) < 1e-15


def test_every_intermediate_quantity_is_there() -> None:
    estimator = TwoPosition(BOTH.datasheet())
    state = estimator.update(estimator.reset(1), recording(BOTH, table_1()))
    result = estimator.identified(state)
    assert result.angle[0] == pytest.approx(170 * DEG, abs=1e-4)
    np.testing.assert_allclose(result.first.phi[0] / ARCMIN, [5.18, 2.81, 32.8], atol=0.05)
    np.testing.assert_allclose(result.second.phi[0] / ARCMIN, [-0.18, 0.19, -2.8], atol=0.1)
    c, s = np.cos(170 * DEG), np.sin(170 * DEG)
    np.testing.assert_allclose(result.second.gyro[0], GYRO * np.array([c - s, s + c]), atol=0.001 * DEG_PER_HOUR)
    assert result.one.shape == result.two.shape == (1, 9)


# ------------------------------------------------------------------------------------------ states and priors


@pytest.mark.parametrize("kind", ALL)
def test_chunks_and_rows_of_a_batch_make_no_difference(kind: type[Alignment]) -> None:
    case = Case(rests=(40.0, 30.0, 35.0), turns=(np.pi, -np.pi), noise=A2, sampling=20.0)
    whole = recording(case, drawn(case, 4, 2), 3)
    turning = Channel(np.tile(whole.channels["turning"].values, (4, 1)), "1")
    whole = replace(whole, channels={**whole.channels, "turning": turning})
    seen, later = whole.channels["sight_heading"].values.copy(), 1200  # a sighting in the first row of a chunk
    seen[..., later] = seen[..., 0] + np.pi
    whole = replace(whole, channels={**whole.channels, "sight_heading": Channel(seen, "rad")})
    estimator = kind(case.datasheet())
    wanted = estimator.estimate(estimator.update(estimator.reset(4), whole))
    state = estimator.reset(4)
    edges = sorted({0, 1, 7, 811, later, 1500, case.n})
    for a, b in ((0, 0), *pairwise(edges)):
        before = state
        state = estimator.update(state, piece(whole, a, b))
        if a == 811:  # what went in is as it was
            again = estimator.estimate(estimator.update(before, piece(whole, a, b)))
            np.testing.assert_array_equal(again.cov, estimator.estimate(state).cov)
    found = estimator.estimate(state)
    np.testing.assert_array_equal(found.mean, wanted.mean)
    np.testing.assert_array_equal(found.cov, wanted.cov)
    single = estimator.estimate(estimator.update(estimator.reset(), row(whole, 2)))
    np.testing.assert_array_equal(single.mean, wanted.mean[2])
    np.testing.assert_array_equal(single.cov, wanted.cov[2])
    some = estimator.estimate(rows(state, np.array([3, 1])))
    np.testing.assert_array_equal(some.mean, wanted.mean[[3, 1]])


@pytest.mark.parametrize("kind", ALL)
def test_before_data_there_is_the_prior(kind: type[Alignment]) -> None:
    estimator = kind(BOTH.datasheet())
    blank = estimator.estimate(estimator.reset(2))
    assert blank.mean.shape == (2, 9) and blank.names == estimator.names
    np.testing.assert_allclose(blank.of("gyro_x")[1], GYRO)
    np.testing.assert_allclose(blank.of("installation_angle")[1], INSTALLATION_SD)
    one = Case(rests=(1.0,), turns=(), told_noise=A)
    started = estimator.estimate(estimator.update(estimator.reset(2), piece(recording(one, table_1(2)), 0, 1)))
    sight = BOTH.datasheet().sight
    assert sight is not None
    variance = INSTALLATION_SD**2 + sight.orientation**2 + sight.tracking**2
    np.testing.assert_allclose(started.of("heading")[1], variance**0.5, rtol=0.01)
    np.testing.assert_allclose(started.of("heading")[0], 30 * ARCMIN, rtol=1e-3)
    np.testing.assert_allclose(started.of("accel_y")[1], ACCEL)


@pytest.mark.parametrize("kind", ALL)
def test_deviations_fall_as_data_come_in(kind: type[Alignment]) -> None:
    case = Case(rests=(100.0, 100.0), turns=(np.pi,), told_noise=A2, sampling=10.0)
    estimator, whole = kind(case.datasheet()), recording(case, table_1())
    state, sds = estimator.reset(1), []
    for second in range(0, round(case.duration), 10):
        state = estimator.update(state, piece(whole, second * 10, (second + 10) * 10))
        found = estimator.estimate(state)
        sds.append(found.of("installation_angle")[1][0])
        assert np.linalg.eigvalsh(found.cov / np.sqrt(np.outer(np.diag(found.cov[0]), np.diag(found.cov[0])))).min() > 0
    assert (np.diff(sds) < 1e-3 * ARCMIN).all()


def test_a_sighting_after_the_turn_takes_part() -> None:
    case = Case(rests=(60.0, 60.0), turns=(np.pi,), told_noise=A2, sampling=20.0)
    errors, whole = table_1(), recording(case, table_1())
    later = round((60.0 + case.turn_s) * case.sampling)
    sight = whole.channels["sight_heading"].values.copy()
    # The first reading is off by 40 arcsec, the second by none.
    off = 40 / 60 * ARCMIN
    sight[:, 0] += off
    whole = replace(whole, channels={**whole.channels, "sight_heading": Channel(sight.copy(), "rad")})
    estimator = TwoPositionTied(case.datasheet())
    once = estimator.estimate(estimator.update(estimator.reset(1), whole))
    sight[:, later] = wrapped(case.heading - np.pi + errors.installation)
    twice_seen = replace(whole, channels={**whole.channels, "sight_heading": Channel(sight, "rad")})
    twice = estimator.estimate(estimator.update(estimator.reset(1), twice_seen))
    drop = (once.of("installation_angle")[0] - twice.of("installation_angle")[0])[0]
    assert drop == pytest.approx(off / 2, rel=0.05)
    gain = (once.of("installation_angle")[1] ** 2 - twice.of("installation_angle")[1] ** 2)[0]
    assert gain == pytest.approx((20 / 60 * ARCMIN) ** 2 / 2, rel=0.1)


def test_time_after_a_turn_can_be_left_out() -> None:
    case = Case(rests=(60.0, 60.0), turns=(np.pi,), told_noise=A2, sampling=20.0)
    found = []
    for settle in (0.0, 10.0):
        estimator = TwoPositionTied(case.datasheet(), settle=settle)
        found.append(estimator.estimate(estimator.update(estimator.reset(1), recording(case, table_1()))))
    assert found[1].of("heading")[1] > 1.05 * found[0].of("heading")[1]
    assert abs(error(found[1], case, "heading")) < 1.0


def test_what_is_told_is_taken_and_what_is_not_has_a_name() -> None:
    sheet = Case(told_noise=A).datasheet()
    told = Told.of(sheet)
    assert told.walk == pytest.approx(A[0]) and told.velocity_walk == pytest.approx(A[1])
    np.testing.assert_allclose(told.sd[:6], [GYRO, GYRO, GYRO, ACCEL, ACCEL, ACCEL])
    assert (told.sd[6:] < 1e-8).all()  # no misalignment and no scale factor where none is declared
    silent = Told.of(Datasheet(100.0, 620.0, Site(LATITUDE)))
    assert silent.sighting.pitch == UNTOLD_SD and silent.sighting.installation == INSTALLATION_SD
    assert silent.sd[2] == pytest.approx(0.01 * DEG_PER_HOUR) and silent.walk > 0
    with pytest.raises(InputError, match="latitude"):
        TwoPositionTied(Datasheet(100.0, 620.0))
    with pytest.raises(InputError, match="settling"):
        TwoPositionTied(sheet, settle=-1.0)
    with pytest.raises(InputError, match="sway"):
        TwoPositionJoint(sheet, sway=-1.0)


def test_a_level_that_is_not_told_is_found() -> None:
    case = Case(rests=(60.0, 60.0), turns=(np.pi,), told_noise=A2, sampling=20.0)
    whole = recording(case, table_1())
    blind = Recording(whole.t, {k: c for k, c in whole.channels.items() if not k.startswith("level")})
    estimator = TwoPositionJoint(replace(case.datasheet(), level_sd=(np.inf, np.inf)))
    found = estimator.estimate(estimator.update(estimator.reset(1), blind))
    assert abs(error(found, case, "pitch")) < 0.01
    told = TwoPositionJoint(case.datasheet())
    with pytest.raises(InputError, match="level_pitch"):
        told.update(told.reset(1), blind)


def test_the_names_are_installed() -> None:
    for name, kind in (("two_position", ALL[0]), ("two_position_tied", ALL[1]), ("two_position_joint", ALL[2])):
        assert find(ESTIMATORS, name) is kind
