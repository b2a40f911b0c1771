"""Means of dwells drawn from their law: the same distribution as sample by sample."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.fft import dct
from scipy.stats import chi2

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.effects.base import NoiseEffect
from insenv.effects.bias import Bias, BiasWarmUp
from insenv.effects.noise import AngleRandomWalk, BiasInstability, Quantization, RateRandomWalk
from insenv.effects.rate.lock_in import LockInWander
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorAsymmetry
from insenv.plants.turntable import Encoder, Turntable
from insenv.rig import Fitted, Rig
from insenv.rig_dwells import Command, DwellLaw, blocks, dwell_law
from insenv.sensors.chain import Sensor

DT = 0.01
#: Edges of dwells in samples, uneven, with gaps between them that are intervals too.
EDGES = np.array([0, 1, 2, 3, 7, 12, 40, 41, 60])
NOISES = (
    AngleRandomWalk(),
    RateRandomWalk(),
    RateRandomWalk(hold=5),
    BiasInstability(decades=3.0),
    BiasInstability(decades=3.0, hold=3),
    Quantization(),
)
COMMANDS: list[Command] = [(0.2, 300), (-0.1, 500), (0.0, 400)]
DWELLS = np.array([20, 120, 280, 350, 700, 705, 800, 1200])


def responses(effect: NoiseEffect, n: int) -> Floats:
    """What each unit normal alone drives in n intervals, those of the start first; no chance in it."""
    size, hold = effect.draws_at_start, effect.every
    one = np.array([1.0])
    from_start = (
        effect.drive(one, DT, effect.start(np.eye(size)), np.zeros((size, 1, n)))[0] if size else np.zeros((0, n))
    )
    z = np.repeat(np.eye(n // hold), hold, axis=1)
    rest = effect.start(np.zeros((len(z), size))) if size else None
    return np.concatenate([from_start, effect.drive(one, DT, rest, z[:, None, :])[0]])


@pytest.mark.parametrize("effect", NOISES, ids=lambda e: f"{e.id}-{e.every}")
def test_the_law_is_the_covariance_of_what_is_driven(effect: NoiseEffect) -> None:
    driven = responses(effect, 60)
    integral = np.concatenate([np.zeros((len(driven), 1)), np.cumsum(driven, axis=1)], axis=1)[:, EDGES] * DT
    means = np.diff(integral, axis=1) / (np.diff(EDGES) * DT)
    np.testing.assert_allclose(effect.integral(EDGES, DT), integral.T @ integral, atol=1e-9 * float(np.var(integral)))
    np.testing.assert_allclose(
        effect.covariance(EDGES, DT), means.T @ means, rtol=1e-8, atol=1e-9 * float(np.var(means))
    )


def test_flicker_of_seven_decades_has_the_law_within_the_digits_of_its_start() -> None:
    """The covariance that the filter starts with is right to 3e-4 over so many decades (`insenv.effects.noise`)."""
    effect = BiasInstability()
    driven = responses(effect, 60)
    means = np.add.reduceat(driven, EDGES[:-1], axis=1) / np.diff(EDGES)
    np.testing.assert_allclose(effect.covariance(EDGES, DT), means.T @ means, rtol=5e-4)


@pytest.mark.parametrize("length", [1, 30])
@pytest.mark.parametrize("effect", [AngleRandomWalk(), RateRandomWalk(), BiasInstability()], ids=lambda e: e.id)
def test_the_law_has_the_spectrum(effect: NoiseEffect, length: int) -> None:
    """Variances of the DCT coefficients of even means, from the eighth on: flicker has 97 % there."""
    n = 128
    modes = dct(np.eye(n), type=2, norm="ortho", axis=0)
    found = np.diag(modes @ effect.covariance(blocks(n * length, length), DT) @ modes.T)[8:]
    lam = 4 * np.sin(np.pi * np.arange(8, n) / (2 * n)) ** 2
    # Of means over a dwell the flicker filter has no ripple at its upper end; those over one interval have.
    tolerance = 0.04 if effect.id == "bias_instability" else 1e-6
    np.testing.assert_allclose(found, effect.spectrum(lam, DT * length), rtol=tolerance)


def table_rig(runs: int = 2, **changed: Any) -> Rig:
    """A table with a gyro of several effects whose parameters differ from run to run."""
    sensor = Sensor(
        "gyro", (Bias(), ScaleFactor(), ScaleFactorAsymmetry(), BiasWarmUp(), AngleRandomWalk(), RateRandomWalk())
    )
    sensor = sensor + BiasInstability() + Quantization()
    rng = np.random.default_rng(5)
    exact = [1e-3, 4.0, 2e-4, 1e-4, 1e-4, 1e-5]
    theta = np.array([[*rng.normal(0, 1e-3, 3), *exact] for _ in range(runs)])
    plant = Turntable(max_acceleration=0.5, max_rate=1.0, encoder=Encoder(noise=1e-6))
    return replace(Rig(plant, (Fitted(sensor, theta),), 1 / DT), **changed)


def sampled(rig: Rig, seeds: Sequence[int], edges: Floats) -> Floats:
    """Means over the dwells sample by sample, shape (R, m)."""
    from insenv.rig import Normals

    normals = Normals(rig, seeds)
    state, parts = rig.begin(normals.start()), []
    for command, n in COMMANDS:
        readings, state = rig.advance(state, np.full(len(seeds), command), n, normals.draw(n))
        parts.append(readings.outputs["gyro"])
    inner = np.concatenate(parts, axis=1)[:, edges[0] : edges[-1]]
    return np.add.reduceat(inner, edges[:-1] - edges[0], axis=1) / np.diff(edges)


def whitened(law: DwellLaw, rig: Rig, means: Floats) -> Floats:
    """Means less what is expected of them, in units in which the law is white, shape (R, m)."""
    quiet = replace(rig, instruments=tuple(replace(f, theta=silent(f)) for f in rig.instruments))
    expected = law.draw(quiet, range(len(means)))["gyro"]
    root = np.linalg.cholesky(law.covariance("gyro", rig.instruments[0].theta[0]))
    return np.linalg.solve(root, (means - expected).T).T


def silent(fitted: Fitted) -> Floats:
    """Parameters without noise."""
    theta, place = fitted.theta.copy(), 0
    for effect in fitted.sensor.effects:
        if isinstance(effect, NoiseEffect):
            theta[:, place] = 0.0
        place += len(effect.params)
    return theta


@pytest.mark.parametrize("path", ["samples", "dwells"])
def test_both_paths_have_the_law(path: str) -> None:
    """600 runs, 7 intervals: means, variances, and covariances between dwells and across gaps.

    28 chi-square figures at 1e-7 each, two-sided: 6e-6 false alarms.
    """
    runs = 600
    rig = table_rig(runs)
    law = dwell_law(rig, COMMANDS, DWELLS)
    means = sampled(rig, range(runs), DWELLS) if path == "samples" else law.draw(rig, range(runs))["gyro"]
    z = whitened(law, rig, means)
    scatter = z.T @ z
    low, high = chi2.ppf([5e-8, 1 - 5e-8], runs)
    assert np.all((np.diag(scatter) > low) & (np.diag(scatter) < high)), np.diag(scatter) / runs
    # Sums of products of independent normals: (a + b)^2 / 2 and (a - b)^2 / 2 are chi-square, and so bound the product.
    off = scatter[np.triu_indices(len(scatter), 1)]
    assert np.all(np.abs(off) < 0.5 * (high - low))
    # Squared sums of unit normals over the runs.
    assert np.all(z.sum(axis=0) ** 2 / runs < chi2.ppf(1 - 1e-7, 1))


def test_the_law_can_tell_a_wrong_one() -> None:
    """The test above can fail: without the rate random walk's covariance across gaps it does."""
    rig = table_rig(600)
    law = dwell_law(rig, COMMANDS, DWELLS)
    wrong = rig.instruments[0].theta.copy()
    wrong[:, 6] *= 1.3
    means = law.draw(replace(rig, instruments=(replace(rig.instruments[0], theta=wrong),)), range(600))["gyro"]
    z = whitened(law, rig, means)
    assert np.diag(z.T @ z).max() > chi2.ppf(1 - 5e-8, 600)


def test_a_row_of_a_batch_is_the_run_alone_bit_for_bit() -> None:
    rig = table_rig(5)
    law = dwell_law(rig, COMMANDS, DWELLS)
    whole = law.draw(rig, range(10, 15))["gyro"]
    for row in range(5):
        own = replace(rig, instruments=(replace(rig.instruments[0], theta=rig.instruments[0].theta[row : row + 1]),))
        np.testing.assert_array_equal(law.draw(own, [10 + row])["gyro"][0], whole[row])


def test_what_no_gaussian_law_describes_is_refused() -> None:
    rig = table_rig()
    gyro = rig.instruments[0]
    locked = Fitted(
        gyro.sensor + LockInWander(), np.concatenate([gyro.theta, np.ones((2, len(LockInWander().params)))], 1)
    )
    with pytest.raises(InputError, match="driven by chance and not Gaussian"):
        dwell_law(replace(rig, instruments=(locked,)), COMMANDS, DWELLS)
    law = dwell_law(rig, COMMANDS, DWELLS)
    spread = gyro.theta.copy()
    spread[1, 4] *= 2  # the time constant of the warm-up
    with pytest.raises(InputError, match="'bias_warm_up' of gyro differs from run to run"):
        law.draw(replace(rig, instruments=(replace(gyro, theta=spread),)), [0, 1])
    assert isinstance(rig.plant, Turntable)
    uneven = replace(rig.plant, latitude=0.7, level_error=(np.array([0.0, 1e-5]), np.array([0.0, 1e-5])))
    with pytest.raises(InputError, match="differs from run to run, as by a level error"):
        dwell_law(replace(rig, plant=uneven), COMMANDS, DWELLS)


class _Untold(NoiseEffect):
    """A noise that tells no law."""

    id = "untold"
    linear = AngleRandomWalk.linear

    def drive(self, theta: Floats, dt: float, state: Any, z: Floats) -> tuple[Floats, Any]:
        raise NotImplementedError

    psd = allan = spectrum = AngleRandomWalk.spectrum  # type: ignore[assignment]


def test_a_noise_without_a_law_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="'untold' has no law of its integral"):
        _Untold().covariance(EDGES, DT)


@pytest.mark.parametrize("edges", [[0], [0, 0], [-1, 5], [5, 3], [0, 1201]])
def test_edges_out_of_place_are_refused(edges: list[int]) -> None:
    with pytest.raises(InputError, match=r"wanted two or more, rising, from 0 to 1200"):
        dwell_law(table_rig(), COMMANDS, edges)


def test_blocks_that_do_not_fill_the_samples_are_refused() -> None:
    assert blocks(6, 2).tolist() == [0, 2, 4, 6]
    with pytest.raises(InputError, match="wanted a whole number of blocks"):
        blocks(7, 2)
