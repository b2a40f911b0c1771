"""Attitude: conventions by example, round trips and composition as properties, scipy and the exponential as judges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from insenv.core import attitude
from insenv.core.attitude import dcm_from_angles, dcm_from_rotation_vector, misaligned, misalignment
from insenv.core.errors import InputError

ANGLE = st.floats(-np.pi, np.pi)
VECTOR = st.tuples(*3 * [st.floats(-1.8, 1.8)]).map(np.array)  # shorter than pi
ATTITUDE = st.builds(dcm_from_angles, ANGLE, st.floats(-np.pi / 2, np.pi / 2), ANGLE)


def cross(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


@pytest.mark.parametrize(
    ("angles_deg", "axis", "east_north_up"),
    [
        ((0, 0, 0), "forward", (0, 1, 0)),
        ((0, 0, 0), "right", (1, 0, 0)),
        ((90, 0, 0), "forward", (1, 0, 0)),  # clockwise: the nose to the east
        ((90, 0, 0), "right", (0, -1, 0)),
        ((0, 30, 0), "forward", (0, np.sqrt(0.75), 0.5)),  # nose up
        ((0, 0, 30), "right", (np.sqrt(0.75), 0, -0.5)),  # right side down
        ((180, 0, 30), "up", (-0.5, 0, np.sqrt(0.75))),
    ],
)
def test_signs_of_the_angles(angles_deg: tuple[float, ...], axis: str, east_north_up: tuple[float, ...]) -> None:
    dcm = dcm_from_angles(*np.radians(angles_deg))
    np.testing.assert_allclose(dcm[:, ("right", "forward", "up").index(axis)], east_north_up, atol=1e-15)


@given(ANGLE, st.floats(-np.pi / 2, np.pi / 2), ANGLE)
def test_angles_are_three_turns_about_z_x_y(heading: float, pitch: float, roll: float) -> None:
    turns = Rotation.from_euler("ZXY", [-heading, pitch, roll]).as_matrix()
    np.testing.assert_allclose(dcm_from_angles(heading, pitch, roll), turns, atol=1e-15)


@given(ATTITUDE)
def test_an_attitude_comes_back_from_its_angles_its_rotation_vector_and_its_quaternion(dcm: np.ndarray) -> None:
    for there, back in (
        (attitude.angles_from_dcm, lambda a: dcm_from_angles(*a)),
        (attitude.rotation_vector_from_dcm, dcm_from_rotation_vector),
        (attitude.quaternion_from_dcm, attitude.dcm_from_quaternion),
    ):
        np.testing.assert_allclose(back(there(dcm)), dcm, atol=1e-11)  # 1e-12 is where roll is given up


@given(ANGLE, st.floats(-1.5, 1.5), ANGLE)
def test_angles_come_back(heading: float, pitch: float, roll: float) -> None:
    found = attitude.angles_from_dcm(dcm_from_angles(heading, pitch, roll))
    away = np.subtract(found, (heading, pitch, roll))
    np.testing.assert_allclose(np.sin(away / 2), 0.0, atol=1e-13)  # pi and -pi are one angle
    assert abs(away[1]) < 1e-13


@given(VECTOR)
def test_the_rotation_vector_is_the_matrix_exponential(v: np.ndarray) -> None:
    dcm = dcm_from_rotation_vector(v)
    np.testing.assert_allclose(dcm, expm(cross(v)), atol=1e-13)
    np.testing.assert_allclose(attitude.rotation_vector_from_dcm(dcm), v, atol=1e-12)


@given(ATTITUDE, VECTOR, VECTOR)
def test_turns_compose(dcm: np.ndarray, a: np.ndarray, b: np.ndarray) -> None:
    both = attitude.rotation_vector_from_dcm(dcm_from_rotation_vector(a) @ dcm_from_rotation_vector(b))
    np.testing.assert_allclose(misaligned(misaligned(dcm, -b), -a), misaligned(dcm, -both), atol=1e-13)
    np.testing.assert_allclose(misaligned(misaligned(dcm, a), -a), dcm, atol=1e-13)


@given(ATTITUDE, VECTOR)
def test_the_misalignment_comes_back(dcm: np.ndarray, phi: np.ndarray) -> None:
    np.testing.assert_allclose(misalignment(misaligned(dcm, phi), dcm), phi, atol=1e-12)


@given(ATTITUDE, VECTOR)
def test_a_small_misalignment_is_one_minus_phi_cross(dcm: np.ndarray, phi: np.ndarray) -> None:
    small = 1e-5 * phi
    np.testing.assert_allclose(misaligned(dcm, small), (np.eye(3) - cross(small)) @ dcm, atol=2e-9)


def test_positive_misalignment_about_up_computes_too_large_a_heading() -> None:
    heading, _, _ = attitude.angles_from_dcm(misaligned(dcm_from_angles(0.4, 0.1, -0.2), (0.0, 0.0, 1e-3)))
    assert heading == pytest.approx(0.401, abs=1e-12)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_with_the_nose_up_or_down_roll_is_zero_and_the_attitude_the_same(pitch: float) -> None:
    dcm = dcm_from_angles(0.5, pitch, 0.3)
    angles = attitude.angles_from_dcm(dcm)
    assert angles[2] == 0.0
    np.testing.assert_allclose(dcm_from_angles(*angles), dcm, atol=1e-15)


def test_a_batch_is_its_rows() -> None:
    rng = np.random.default_rng(1)
    phi = rng.normal(size=(2, 5, 3))
    dcm = dcm_from_angles(phi[..., 0], 0.1 * phi[..., 1], phi[..., 2])
    rows = [[misaligned(dcm[i, j], phi[i, j]) for j in range(5)] for i in range(2)]
    np.testing.assert_array_equal(misaligned(dcm, phi), rows)
    quaternions = attitude.quaternion_from_dcm(dcm)
    assert quaternions.shape == (2, 5, 4)
    assert (quaternions[..., 0] >= 0).all()
    assert np.shape(attitude.angles_from_dcm(dcm)) == (3, 2, 5)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: misaligned(np.eye(3) * 1.01, (0, 0, 0)), "no rotation"),
        (lambda: attitude.quaternion_from_dcm(np.diag([1.0, 1.0, -1.0])), "no rotation"),
        (lambda: attitude.quaternion_from_dcm(np.full((3, 3), np.nan)), "no rotation"),
        (lambda: attitude.angles_from_dcm(np.eye(4)), r"wanted shape \(\.\.\., 3, 3\)"),
        (lambda: dcm_from_rotation_vector([1.0, 2.0]), r"wanted shape \(\.\.\., 3\)"),
        (lambda: attitude.dcm_from_quaternion(1.0), r"wanted shape \(\.\.\., 4\)"),
    ],
)
def test_what_is_no_attitude_is_refused(call: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        call()  # type: ignore[operator]
