"""The challenge for outsiders: cases, the hash of their truth, the scorer, and common methods beside. Seeded."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from studies.challenge import cases, losers, score

from insenv.close import opened
from insenv.data.load import read_recordings


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = tmp_path_factory.mktemp("challenge")
    cases.write(where, 1, 1, 7)
    return where


def test_the_published_hash_is_that_of_the_truth(folder: Path) -> None:
    digest = hashlib.sha256((folder / "truth.json").read_bytes()).hexdigest()
    assert (folder / "truth.sha256").read_text().split()[0] == digest
    truth, told = score.read_truth(folder)
    assert told == digest and len(truth) == 7
    assert {one["kind"] for one in truth.values()} == {
        "single 5",
        "single 7",
        "single 10",
        "single 15",
        "pair",
        "unknown",
        "null",
    }
    (recording,) = read_recordings(opened(folder / "cases" / "0000" / "run.toml"))
    assert len(recording) == cases.ROWS


def test_a_truth_that_was_changed_is_refused(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "truth.json").write_text((folder / "truth.json").read_text().replace("null", "pair"))
    (tmp_path / "truth.sha256").write_text((folder / "truth.sha256").read_text())
    with pytest.raises(SystemExit, match="published was"):
        score.read_truth(tmp_path)


def test_strength_is_that_of_the_best_test() -> None:
    """Of white noise of s in each row a law x of norm |x| beside the model has the strength |x| / s."""
    rng = np.random.default_rng(0)
    noise = cases.Noise(1e-5, 1e-12)
    law = np.repeat(rng.standard_normal(cases.ROWS // cases.BLOCK), cases.BLOCK)
    u = np.repeat(rng.standard_normal(cases.ROWS // cases.BLOCK), cases.BLOCK)
    model = np.column_stack([np.ones(cases.ROWS), u])
    left = law - model @ np.linalg.lstsq(model, law, rcond=None)[0]
    assert cases.strength(noise, law, u) == pytest.approx(np.linalg.norm(left) * np.sqrt(cases.DT) / 1e-5, rel=1e-6)


def test_the_scorer_counts_rivals_and_wrong_names(tmp_path: Path) -> None:
    said = [
        {"case": "0", "verdict": "effects-found", "effects": [{"name": "bias_temperature:1", "rivals": []}]},
        {"case": "1", "verdict": "confounded", "effects": [{"name": "tone", "rivals": ["bias_drift"]}]},
        {"case": "2", "verdict": "nothing-significant", "effects": []},
        {"case": "3", "verdict": "effects-found", "effects": [{"name": "encoder_harmonic:2"}]},
    ]
    path = tmp_path / "answers.jsonl"
    path.write_text("\n".join(map(json.dumps, said)))
    answers = score.read_answers(path)
    true = ("bias_temperature", "bias_drift", "bias_drift", "encoder_harmonic:1")
    told = [score.outcome(one, answers[str(k)]) for k, one in enumerate(true)]
    assert told == ["alone", "as a rival", "nothing", "wrong"]
    truth = {str(k): {"kind": "single 5", "effects": [one]} for k, one in enumerate(true)}
    counts = score.scores(truth, answers, list(truth))
    assert counts["single 5: named"] == (2, 4) and counts["single 5: named first"] == (1, 4)
    assert counts["single 5: another name beside or instead"] == (2, 4)


@pytest.mark.parametrize("name", losers.NAMES)
def test_common_methods_name_what_is_plain(name: str) -> None:
    """White noise and a cubic of 40 standard deviations: nobody misses it."""
    rng, n = np.random.default_rng(1), 720
    x = rng.standard_normal((n, 40))
    x /= np.linalg.norm(x, axis=0)
    names = tuple(f"other_{k}" for k in range(39)) + ("scale_factor_cubic",)
    y = 40 * x[:, -1] + rng.standard_normal(n)
    found = losers.METHODS[name](losers.Library(y / np.std(y), x, names, np.arange(40)))
    assert "scale_factor_cubic" in [one for one, _ in found]
