"""Effects put into recordings by `scripts/studies/injections`: sizes, files and words are what they say."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts" / "studies" / "injections"))

import injected_laws
import injected_words
from altered_files import held, read, step_of, written
from injected_cases import drawn
from injected_sizes import scale_of

from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest


def _bench(folder: Path) -> Path:
    """A gyro rounded to 0.01 rad/s beside a rate in rpm, 100 Hz, 60 s."""
    rng = np.random.default_rng(4)
    t = 0.01 * np.arange(6000)
    u = 3.0 * np.sin(2 * np.pi * 0.3 * t) + np.sin(2 * np.pi * 0.11 * t)
    y = np.round(0.02 + u + 0.02 * rng.standard_normal(t.size), 2)
    rows = [f"{a:.2f},{b:.2f},{c:.4f}" for a, b, c in zip(t, y, u * 30 / np.pi, strict=True)]
    (folder / "bench.csv").write_text("\n".join(["t,gyro,rpm", *rows]) + "\n", encoding="utf-8")
    lines = ['data = "bench.csv"', "[read]", "skip = 1", "[channels]", 'time = { column = "t", unit = "s" }']
    lines += ['gyro = { column = "gyro", unit = "rad/s" }', 'table_rate = { column = "rpm", unit = "rpm" }']
    lines += ["[model]", 'target = "gyro"', 'declared = ["bias", "scale_factor"]']
    (folder / "bench.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / "bench.toml"


def test_a_copy_reads_as_the_recording_and_an_altered_one_differs_by_the_effect_alone(tmp_path: Path) -> None:
    """Rounding stays too; no chance in it."""
    original = _bench(tmp_path)
    (tmp_path / "copy").mkdir()
    copied = written(read(original), tmp_path / "copy")
    one, two = (read_recordings(load_manifest(path))[0] for path in (original, copied))
    assert np.array_equal(one.t, two.t)
    assert all(np.array_equal(one.channels[n].values, two.channels[n].values) for n in ("gyro", "table_rate"))
    truth = drawn(original, "bench", "reference", ["scale_factor_asymmetry"], [1], tmp_path / "case")
    three = read_recordings(load_manifest(tmp_path / "case" / "case.toml"))[0]
    gained = three.channels["gyro"].values - one.channels["gyro"].values
    assert np.array_equal(three.channels["table_rate"].values, one.channels["table_rate"].values)
    assert step_of(three.channels["gyro"].values) == pytest.approx(0.01)
    fitted = float(gained @ np.abs(one.channels["table_rate"].values)) / float(
        np.sum(one.channels["table_rate"].values ** 2)
    )
    # Rounding of 0.01 on 6000 rows: 0.004 / sqrt(6000) / 2.2, and the reading is smoothed; 6 sd, chance 1e-9.
    assert fitted == pytest.approx(truth.size, abs=1.5e-4, rel=0.02) and truth.parameter == "c"


def test_a_size_is_its_standard_deviations() -> None:
    """White noise: |d| / s beside a bias and a gain, within 15 % (power of some modes, 5 sd)."""
    rng = np.random.default_rng(5)
    u, noise = rng.standard_normal(4000), rng.standard_normal(4000)
    effect = 0.2 * np.sign(np.sin(np.arange(4000.0)))
    scale = scale_of([noise], [u[:, None]], [u[:, None]], 1)
    assert scale.size([effect]) == pytest.approx(0.2 * np.sqrt(4000), rel=0.15)
    assert scale.size([effect], [[effect]]) < 1e-6 and scale.size([u]) < 1e-6


def test_what_is_held_is_known_from_what_is_rounded() -> None:
    """No chance in what is held; of what is rounded none in 100 seeds is taken for it."""
    slow = 100 * np.sin(0.01 * np.arange(2000.0))
    assert held(slow[np.arange(2000) // 4 * 4])
    assert not any(held(np.round(0.3 * np.random.default_rng(s).standard_normal(2000))) for s in range(100))


def _exposure() -> injected_laws.Exposure:
    t = np.arange(0.0, 39.995, 0.01)
    u = np.sin(0.5 * t) + 0.5 * np.sin(1.3 * t)
    angle = np.cumsum(u) * 0.01
    return injected_laws.Exposure(t, 0.01 + u, u, u, False, angle, 300 + t, 1.5)


@pytest.mark.parametrize("law", [*injected_laws.TURNED])
def test_a_law_alters_the_reading_or_the_reference_and_more_with_its_size(law: str) -> None:
    e, each, shape = _exposure(), injected_laws.TURNED[law], np.array([0.4, 0.3, 0.5])
    sizes = []
    for size in (0.2 * each.high, 0.8 * each.high):
        y, reference = each.of(e, size, shape)
        assert y.shape == reference.shape == e.t.shape and np.isfinite(y).all() and np.isfinite(reference).all()
        assert np.array_equal(y, e.y) or np.array_equal(reference, e.reference)
        sizes.append(float(np.linalg.norm(y - e.y) + np.linalg.norm(reference - e.reference)))
    assert 0 < sizes[0] < sizes[1]


def _report(verdict: str, *added: tuple[str, float, str]) -> dict[str, Any]:
    return {
        "verdict": verdict,
        "target": "gyro",
        "declared": ["bias"],
        "rejected": [],
        "not_testable": [],
        "added": [
            {"effect": e, "parameters": [{"name": "c", "value": v, "sd": 0.1}], "confounded_with": r.split()}
            for e, v, r in added
        ],
        "estimates": {"before": [], "after": []},
    }


@pytest.mark.parametrize(
    ("now", "word"),
    [
        (_report("effects-found", ("bias_drift", 2.1, "")), "right"),
        (_report("effects-found", ("bias_drift", 5.0, "")), "wrong value, stated"),
        (_report("confounded", ("bias_warm_up", 2.0, "bias_drift")), "honest"),
        (_report("effects-found", ("bias_step", 2.0, "")), "wrong name, stated"),
        (_report("effects-found-incomplete", ("bias_step", 2.0, "")), "wrong name, flagged"),
        (_report("nothing-significant"), "missed"),
        (_report("unexplained-structure"), "honest"),
        (_report("effects-found", ("tone", 1.0, "")), "missed"),
    ],
)
def test_words(now: dict[str, Any], word: str) -> None:
    truth = {"target": "gyro", "law": "bias_drift", "names": ["bias_drift"], "alike": [], "strength": 15.0}
    truth |= {"parameter": "c", "value": 2.0}
    assert injected_words.compared(truth, _report("effects-found", ("tone", 1.0, "")), now).word == word
