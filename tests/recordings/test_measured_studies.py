"""Independent fits and judge of `scripts/studies/measured`: what was put in comes out, and each word has its case."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts" / "studies" / "measured"))

import bench_fit
import judge
import position_fit
import rest_fit


def test_a_held_gyro_behind_a_late_encoder_is_told_apart() -> None:
    rng = np.random.default_rng(1)
    time = np.linspace(0.0, 59.99, 6000)
    phase = 2 * np.pi * 0.5 * time
    true = 3.0 * np.sin(phase)
    encoder = 3.0 * np.sin(phase - 2 * np.pi * 0.5 * 0.021) + 0.01 * rng.standard_normal(time.size)
    last = np.maximum((np.arange(time.size) - 1) // 3 * 3 + 1, 0)
    gyro = np.round(0.02 - 0.87 * true[last] + 0.003 * rng.standard_normal(time.size)[last], 2)
    found = bench_fit.held(time, gyro, encoder)
    assert found is not None
    assert (found.rows, found.phase, found.share) == (3, 1, 1.0)
    assert found.gain == pytest.approx(-0.87, abs=0.002) and found.lag == pytest.approx(0.021, abs=0.001)
    plain = bench_fit.fit(time, gyro, encoder)
    assert abs(plain.gain + 0.87) < 0.004 and plain.delay == pytest.approx(0.010 - 0.021, abs=0.002)
    assert plain.hold == pytest.approx(0.03) and not plain.railed


def test_positions_give_bias_scale_and_right_angles() -> None:
    rng = np.random.default_rng(2)
    up = rng.standard_normal((20, 3))
    up *= 9.8 / np.linalg.norm(up, axis=1, keepdims=True)
    matrix = np.array([[1.02, 0.003, -0.004], [0, 0.99, 0.005], [0, 0, 1.01]])
    means = up @ np.linalg.inv(matrix).T + [0.1, -0.2, 0.3] + 1e-4 * rng.standard_normal((20, 3))
    p, sd, left = position_fit.solve(means, 9.8, "bias+scale+nonorth")
    true = [0.1, -0.2, 0.3, 0.02, -0.01, 0.01, 0.003, -0.004, 0.005]
    assert np.all(np.abs(p - true) < 5 * sd) and left < 2e-4
    assert position_fit.left_out(means, 9.8, "bias") > 10 * position_fit.left_out(means, 9.8, "bias+scale+nonorth")


def test_a_turn_is_the_product_of_its_steps() -> None:
    rate = np.tile([0.0, 0.0, np.pi / 2], (101, 1))
    assert np.allclose(position_fit.turn(rate, 0.01) @ [1, 0, 0], [0, 1, 0], atol=1e-9)


def test_a_line_and_a_drift_are_seen_in_a_rest() -> None:
    rng = np.random.default_rng(3)
    time = np.arange(60000) * 0.01
    x = rng.standard_normal(time.size) + 0.3 * np.sin(2 * np.pi * 7.3 * time)
    (frequency, amplitude), *_ = rest_fit.lines(x, 100.0)
    assert frequency == pytest.approx(7.3, abs=0.02) and amplitude == pytest.approx(0.3, rel=0.2)
    slope, sd = rest_fit.drift(x + 6.0 * time / 3600, 100.0)
    assert abs(slope - 6.0) < 5 * sd
    tau, deviation = rest_fit.allan(rng.standard_normal(20000), 100.0)
    assert np.interp(1.0, tau, deviation) == pytest.approx(0.1, rel=0.1)


FACT = {"manifest": "a/b.toml", "must": {"gyro": [["sample_hold"]]}, "may": {"gyro": ["tone"]}}


def _report(verdict: str, *effects: str, rivals: tuple[str, ...] = ()) -> dict[str, Any]:
    added = [{"effect": e, "parameters": [], "confounded_with": list(rivals)} for e in effects]
    return {"target": "gyro", "verdict": verdict, "added": added, "estimates": {"after": []}}


@pytest.mark.parametrize(
    ("report", "word"),
    [
        (_report("effects-found", "sample_hold", "tone"), "right"),
        (_report("effects-found", "sample_hold", "lock_in"), "wrong, stated"),
        (_report("effects-found-incomplete", "sample_hold", "lock_in"), "wrong, flagged"),
        (_report("confounded", "lock_in", rivals=("sample_hold",)), "right"),
        (_report("nothing-significant"), "missed"),
        (_report("unexplained-structure"), "honest"),
    ],
)
def test_each_word_has_its_case(report: dict[str, Any], word: str, tmp_path: Path) -> None:
    import json

    (tmp_path / "a__b.json").write_text(json.dumps(report), encoding="utf-8")
    assert judge.judge(FACT, {}, tmp_path).word == word


def test_no_answer_is_a_refusal_or_a_crash(tmp_path: Path) -> None:
    (tmp_path / "a__b.err").write_text("insenv: b.toml: too few rows", encoding="utf-8")
    assert judge.judge(FACT, {}, tmp_path).word == "refused"
    assert judge.judge({**FACT, "refusal": "no rests"}, {}, tmp_path).word == "refused"
    (tmp_path / "a__b.err").write_text("insenv: b.toml: 3 rests to fit", encoding="utf-8")
    assert judge.judge({**FACT, "refusal": "no rests"}, {}, tmp_path).word == "honest"
    (tmp_path / "a__b.err").write_text("Traceback (most recent call last)\nValueError", encoding="utf-8")
    assert judge.judge(FACT, {}, tmp_path).word == "crashed"
