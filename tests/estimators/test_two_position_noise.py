"""Two-position calibration with noise: the figures of the study, honest covariances, and sway."""

from __future__ import annotations

from functools import cache, lru_cache

import numpy as np
import pytest
from north_cases import piece
from vehicle_cases import A2, SIGHT, UG, A, B, Case, Errors, drawn, recording, table_1, truth, wrapped

from estimators.two_position.alignment import Alignment
from estimators.two_position.joint import TwoPositionJoint
from estimators.two_position.published import TwoPosition
from estimators.two_position.tied import TwoPositionTied
from insenv.core.estimate import Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import ARCMIN, DEG_PER_HOUR

SEEDS, AT_ONCE = 240, 30
KINDS: dict[str, type[Alignment]] = {"cubic": TwoPosition, "tied": TwoPositionTied, "joint": TwoPositionJoint}
#: RMS of the heading's error at position 2, of the gyro biases', at most; their deviation by the closed form.
HEADING = {"cubic": 0.33, "tied": 0.12, "joint": 0.10}
GYROS = {"cubic": 0.0015, "tied": 0.0005, "joint": 0.0003}
HEADING_A2 = {"cubic": 0.48, "tied": 0.24, "joint": 0.20}


def scored(found: Estimate, true: dict[str, Floats]) -> dict[str, Floats]:
    """Errors, wrapped."""
    return {
        name: wrapped(found.of(name)[0] - values)
        if name in ("heading", "installation_angle")
        else found.of(name)[0] - values
        for name, values in true.items()
    }


@cache
def published(noise: tuple[float, float]) -> dict[str, dict[str, Floats]]:
    """Errors of all estimators with the errors of Table 1, and the sight's, over `SEEDS` runs of the procedure."""
    case = Case(noise=noise, sampling=20.0)
    parts: dict[str, list[dict[str, Floats]]] = {name: [] for name in KINDS}
    for seed in range(0, SEEDS, AT_ONCE):
        fixed = table_1(AT_ONCE)
        sight = SIGHT * np.random.default_rng(seed).standard_normal((2, AT_ONCE)).sum(axis=0)
        errors = Errors(fixed.gyro, fixed.accel, fixed.pitch, fixed.roll, fixed.installation, sight)
        whole, true = recording(case, errors, seed + 1), truth(case, errors)
        for name, kind in KINDS.items():
            estimator = kind(case.datasheet())
            parts[name].append(scored(estimator.estimate(estimator.update(estimator.reset(AT_ONCE), whole)), true))
    return {n: {k: np.concatenate([part[k] for part in got]) for k in got[0]} for n, got in parts.items()}


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


# The RMS of 240 errors has a relative deviation of 1 / sqrt(480) = 0.046; the bounds stand 0.2 or more above what is
# reached, 4 deviations: a false alarm has a probability below 1e-4 each.
@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_the_figures_of_the_study_under_noise_a(name: str) -> None:
    found = published(A)[name]
    assert rms(found["heading"]) / ARCMIN <= HEADING[name]
    assert rms(found["gyro_x"]) / DEG_PER_HOUR <= GYROS[name]
    assert rms(found["gyro_y"]) / DEG_PER_HOUR <= GYROS[name]
    assert rms(found["installation_angle"]) / ARCMIN <= 0.65
    limits = {"cubic": 0.015, "tied": 0.005, "joint": 0.003}
    assert max(rms(found["pitch"]), rms(found["roll"])) / ARCMIN <= limits[name]
    if name != "cubic":  # one pass leaves 2.9 micro-g
        assert max(rms(found["accel_x"]), rms(found["accel_y"])) / UG <= {"tied": 1.1, "joint": 0.25}[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_the_figures_of_the_study_under_noise_a2(name: str) -> None:
    assert rms(published(A2)[name]["heading"]) / ARCMIN <= HEADING_A2[name]


# The deviation of 240 headings against the closed form of the study: 0.046 of it by chance, and 10 % that the
# formula is off; a false alarm beyond 0.2 has a probability of 3e-2 at worst, and the seeds are fixed.
@pytest.mark.slow
@pytest.mark.parametrize(("noise", "name", "closed"), [(A, "cubic", 0.250), (A, "tied", 0.065), (A2, "cubic", 0.388)])
def test_the_spread_is_that_of_the_closed_form(noise: tuple[float, float], name: str, closed: float) -> None:
    assert published(noise)[name]["heading"].std() / ARCMIN == pytest.approx(closed, rel=0.2)


@lru_cache(maxsize=1)
def begun(noise: tuple[float, float]) -> tuple[Case, Recording, dict[str, Floats]]:
    """A case with short rests, 300 runs of it with errors that are drawn, once for all estimators, and these errors."""
    case = Case(noise=noise, sampling=20.0, rests=(200.0, 200.0), heading=0.7)
    errors = drawn(case, 300, 11)
    return case, recording(case, errors, 12), truth(case, errors)


# The RMS of 300 z-scores has a deviation of 0.041 (0.06 for the accelerometers and the level of the cubic, where
# products of two misalignments stand): 0.15 is 3.7 (2.5) of it. The seeds are fixed; of 150 such scores drawn anew one
# or two would be expected beyond the bound.
@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("noise", [A, A2, B], ids=["A", "A2", "B"])
def test_covariances_are_honest_at_any_time(noise: tuple[float, float], name: str) -> None:
    case, whole, true = begun(noise)
    estimator = KINDS[name](case.datasheet())
    state, last = estimator.reset(300), 0
    for time in (20, 100, 200, 300, 420):
        cut = round(time * case.sampling)
        state, last = estimator.update(state, piece(whole, last, cut)), cut
        found = estimator.estimate(state)
        at = true | ({"heading": np.full(300, case.heading)} if time <= 200 else {})
        for quantity, wrong in scored(found, at).items():
            z = rms(wrong / found.of(quantity)[1])
            assert z == pytest.approx(1.0, abs=0.15), (time, quantity)


def sway(case: Case, frequency: float, size: float, arm: float, phases: Floats) -> tuple[Floats, Floats]:
    """Increments that a swing about the right axis adds, with a phase of its own in each rest; ``arm`` above."""
    dt, w, amplitude = 1 / case.sampling, 2 * np.pi * frequency, 2**0.5 * size
    t = np.arange(case.n + 1) * dt
    change = round((case.rests[0] + 0.5 * case.turn_s) * case.sampling)
    phase = np.where(np.arange(case.n + 1) < change, *phases)
    angle, speed = amplitude * np.sin(w * t + phase), arm * amplitude * w * np.cos(w * t + phase)
    mean = np.diff(-amplitude / w * np.cos(w * t + phase))
    mean[change - 1] = 0.5 * dt * (angle[change - 1] + angle[change])
    gyro, accel = np.zeros((2, case.n, 3))
    gyro[:, 0] = np.diff(angle)
    accel[:, 1] = 9.8 * mean - np.diff(speed)
    return gyro, accel


@pytest.mark.parametrize("name", KINDS)
def test_sway_costs_a_fit_without_constant_alone(name: str) -> None:
    case = Case(told_noise=A, sampling=50.0)
    estimator = KINDS[name](case.datasheet())

    def heading(moved: tuple[Floats, Floats] | None) -> float:
        state = estimator.update(estimator.reset(1), recording(case, table_1(), 0, moved))
        return float(estimator.estimate(state).of("heading")[0][0])

    still = heading(None)
    draws = np.random.default_rng(4).uniform(0, 2 * np.pi, (6, 2))
    cost = rms(np.array([heading(sway(case, 1.5, 0.5 * ARCMIN, 1.0, d)) - still for d in draws])) / ARCMIN
    if name == "cubic":
        assert 0.5 < cost < 4.0
    else:
        assert cost <= 0.02


def test_the_joint_estimate_notices_sway() -> None:
    case = Case(told_noise=A, sampling=50.0)
    estimator = TwoPositionJoint(case.datasheet())
    strong = recording(case, table_1(), 0, sway(case, 1.53, 3 * ARCMIN, 1.5, np.array([1.0, 2.0])))
    swaying = estimator.estimate(estimator.update(estimator.reset(1), strong))
    still = estimator.estimate(estimator.update(estimator.reset(1), recording(case, table_1())))
    assert swaying.of("heading")[1] > 1.5 * still.of("heading")[1]
