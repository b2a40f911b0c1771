"""Six faces at several temperatures, a file of each: biases and scale factors of accelerometers that follow it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from positions_cases import ACCELS, FACES, G, manifest

from insenv.calibration import calibration
from insenv.calibration.apply import apply
from insenv.close import close
from insenv.core.recording import Channel, Recording, Site
from insenv.data.manifest import HeldOut, Model, load_manifest
from insenv.data.save import save
from insenv.identify.positions.trace import Positions, trace_positions

DECLARED = ("accel_bias", "accel_scale_factor")
MODEL = manifest(ACCELS, DECLARED, HeldOut())
#: Temperatures of the chamber [degC], and the one that biases and scale factors belong to.
CHAMBER, REFERENCE = (-20.0, 20.0, 60.0), 25.0
BIAS = np.array([0.05, -0.03, 0.1])
SCALE = np.array([1e-3, -2e-3, 5e-4])
#: How the axes share what follows the temperature.
SHARES = np.array([1.0, -0.5, 0.3])


def faces(seed: int, bias: float, scale: float, repeats: float = 5e-4) -> tuple[Recording, ...]:
    """Rests of 10 s, set down to a hundredth of a radian, of a unit that repeats to ``repeats`` [m/s^2].

    ``bias`` [m/s^2/K] and ``scale`` [1/K] are what the x axis has of either.
    """
    rng = np.random.default_rng(seed)
    runs: list[Recording] = []
    for temperature in CHAMBER:
        for face in FACES:
            up = face + 0.01 * rng.standard_normal(3)
            excess = (temperature - REFERENCE) * SHARES
            force = G * up / np.linalg.norm(up)
            reading = force * (1 + SCALE + scale * excess) + BIAS + bias * excess + repeats * rng.standard_normal(3)
            values = reading + 0.02 * rng.standard_normal((1000, 3))
            channels = {f"accel_{axis}": Channel(values[:, i], "m/s^2") for i, axis in enumerate("xyz")}
            channels["temperature"] = Channel(np.full(1000, temperature + 273.15), "K")
            runs.append(Recording(0.01 * np.arange(1000.0), channels, site=Site(gravity=G), label=f"run {len(runs)}"))
    return tuple(runs)


def told(found: Positions) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Of each effect that was added its coefficients and their standard deviations, shape (3,)."""
    after = found.accel.outcome.after
    added = [step.term for step in found.accel.outcome.steps]
    return {term.effect.id: (after.theta[after.of(term)], after.sd()[after.of(term)]) for term in added}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("bias", "scale"), [(0.0, 1.5e-5), (1e-3, 0.0), (1e-3, 3e-5)])
def test_what_follows_the_temperature_is_named_with_its_size(seed: int, bias: float, scale: float) -> None:
    found = told(trace_positions(MODEL, faces(seed, bias, scale)))
    true = {"bias_temperature": bias, "scale_factor_temperature": scale}
    assert found.keys() == {name for name, size in true.items() if size}
    for name, (value, sd) in found.items():
        # Of 36 sizes one is six deviations off by chance once in 300 runs of these tests (Student's t on 6 and more).
        assert np.all(np.abs(value - true[name] * SHARES) < 6 * sd)


@pytest.mark.slow
@pytest.mark.parametrize("repeats", [5e-4, 2e-3])
def test_a_unit_that_repeats_itself_follows_no_temperature(repeats: float) -> None:
    # Of twelve three and more are named by chance once in 5000 runs of these tests (a level of 0.01 each).
    assert sum(bool(told(trace_positions(MODEL, faces(seed, 0.0, 0.0, repeats)))) for seed in range(12)) <= 2


def test_two_temperatures_are_too_few_for_both() -> None:
    found = trace_positions(MODEL, faces(0, 0.0, 3e-5)[:12])
    assert not found.accel.outcome.steps
    assert found.accel.reasons


def test_a_calibration_takes_both_out_of_every_axis(tmp_path: Path) -> None:
    runs = faces(5, 1e-3, 3e-5)
    path = tmp_path / "faces.toml"
    save(path, runs, Model(ACCELS, DECLARED, procedure="multi-position"), title="Faces")
    made = calibration(close(path), load_manifest(path))
    for run in runs:
        applied = apply(made, run).recording
        force = np.array([applied.channels[name].values.mean() for name in ACCELS])
        # The unit repeats to 0.5 mm/s^2, and the noise of a mean is as large; 62 mm/s^2 were there.
        assert abs(np.linalg.norm(force) - G) < 5e-3
