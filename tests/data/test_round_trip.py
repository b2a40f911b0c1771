"""`insenv simulate`, then `insenv close-loop`: the undeclared effect is found or accounted for."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from command import run

FOLDER = Path(__file__).parents[2] / "scenarios"

#: What makes each example short: the same profile in less time at a lower sampling rate.
SHORTER: dict[str, dict[str, str]] = {
    "constant_rate": {'"1200 s"': '"240 s"', '"100 Hz"': '"20 Hz"'},
    "parked_vehicle": {'"1800 s"': '"400 s"', '"100 Hz"': '"20 Hz"'},
    "reversal": {'"144 s"': '"36 s"', '"100 Hz"': '"20 Hz"'},
    "sine": {'"600 s"': '"60 s"', '"200 Hz"': '"50 Hz"'},
    "staircase": {'dwell = "20 s"': 'dwell = "6 s"', '"100 Hz"': '"25 Hz"'},
    "thermal_cycle": {'"10 Hz"': '"1 Hz"'},
}
#: At one rate and in one direction a wrong encoder is the Earth's rate, which is declared: only its size betrays it.
HIDDEN = {"constant_rate"}


def test_every_example_is_here() -> None:
    assert set(SHORTER) == {path.stem for path in FOLDER.glob("*.toml")}


def shortened(name: str, folder: Path) -> Path:
    text = (FOLDER / f"{name}.toml").read_text()
    for old, new in SHORTER[name].items():
        assert old in text
        text = text.replace(old, new)
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def key(added: dict[str, Any]) -> str:
    return added["effect"] if added["order"] is None else f"{added['effect']}:{added['order']}"


@pytest.mark.parametrize("name", SHORTER)
def test_the_undeclared_effect_comes_back(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario, out = shortened(name, tmp_path), tmp_path / "out"
    simulated = run(capsys, monkeypatch, "simulate", scenario, "--out", out, "--seed", 1)
    assert simulated.status == 0 and simulated.out.strip() == str(out / "manifest.toml")
    (undeclared,) = tomllib.loads(scenario.read_text())["undeclared"]
    for text in ((out / "manifest.toml").read_text(), (out / "recording.csv").read_text().partition("\n")[0]):
        assert undeclared not in text and "undeclared" not in text

    closed = run(capsys, monkeypatch, "close-loop", out / "manifest.toml", "--json", tmp_path / "a.json")
    assert closed.status == 0
    found = json.loads((tmp_path / "a.json").read_text())
    if name in HIDDEN:
        told = [n["effect"] for n in found["not_testable"]]
        told += [one for e in found["next_experiment"] for one in e["separates"]]
        assert any(re.fullmatch(rf"{undeclared}(:1)?", one) for one in told)
        assert found["verdict"] == "confounded"
        return
    for target in {added.get("target") for added in found["added"]} or {None}:
        first = next(added for added in found["added"] if added.get("target") == target)
        named = {key(first), first["effect"], *first["confounded_with"]}
        assert undeclared in {one.partition(":")[0] for one in named}
    assert found["added"]
