"""An estimator on a recording: what was played gives what the environment had, from files and from the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from command import run as command

from insenv.core.errors import InputError
from insenv.core.plugins import ESTIMATORS, find
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.envs.recorder import Recorder
from insenv.estimate import estimate
from insenv.report.estimate import summary, to_html, to_json
from insenv.scenario import load, simulate
from insenv.scenario.datasheet import datasheet
from insenv.scenario.measured import datasheet_of

TABLE = {"instrument.sampling": "20 Hz", "duration": "60 s"}
VEHICLE = {"instrument.sampling": "10 Hz", "duration": "80 s", "sight.readings": "turns"}
#: Environment, scenario, changes, actions, and the estimators that play it or take its recording.
PLAYED: dict[str, tuple[str, str, dict[str, Any], tuple[tuple[float, float], ...], tuple[str, ...]]] = {
    "north": (
        "insenv/NorthFinder-v0",
        "north_finder/realistic",
        TABLE,
        ((0.5, 0.0),) * 59,
        ("correlation", "revolution", "north_gls", "levelling"),
    ),
    "two positions": (
        "insenv/TwoPosition-v0",
        "two_position/realistic",
        VEHICLE,
        (*((0.0, 0.0),) * 28, (0.9, 0.0), *((0.0, 0.0),) * 50),
        ("two_position", "two_position_tied", "two_position_joint"),
    ),
    "rate table": (
        "insenv/RateTable-v0",
        "rate_table/b215",
        {"instrument.sampling": "20 Hz", "duration": "80 s", "temperature": {"kind": "constant", "value": "25 degC"}},
        (*((0.0, 0.0),) * 10, *((0.5, 0.0),) * 25, *((-0.5, 0.0),) * 25, *((0.0, 0.0),) * 10),
        ("rate_line", "rate_gls", "static_bias"),
    ),
}
CASES = [(name, estimator) for name, played in PLAYED.items() for estimator in played[-1]]


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, Any, Recorder]]:
    """Of each system a run that was played and written: its manifest, datasheet and recorder."""
    found = {}
    for name, (env_id, scenario, changes, actions, _) in PLAYED.items():
        env = Recorder(gymnasium.make(env_id, scenario=scenario, changes=changes, disable_env_checker=True))
        env.reset(seed=5)
        for action in actions:
            env.step(np.array(action))
        path = env.save(tmp_path_factory.mktemp(name.replace(" ", "_")))
        found[name] = (path, env.unwrapped.task.datasheet, env)  # type: ignore[attr-defined]
    return found


@pytest.mark.parametrize(("system", "estimator"), CASES)
def test_a_recording_gives_what_the_environment_had(played: Any, system: str, estimator: str) -> None:
    path, sheet, env = played[system]
    plugin = find(ESTIMATORS, estimator)(sheet)
    wanted = plugin.estimate(plugin.update(plugin.reset(), env.recording()))
    (one,) = estimate(path, estimator).runs
    assert one.estimate.names == wanted.names and one.rows == len(env.recording())
    scale = np.sqrt(np.diag(wanted.cov))
    np.testing.assert_allclose(one.estimate.mean, wanted.mean, rtol=1e-9, atol=1e-6 * scale.min())
    np.testing.assert_allclose(one.estimate.cov, wanted.cov, rtol=1e-6, atol=1e-9 * np.diag(wanted.cov).min())


@pytest.mark.parametrize("system", PLAYED)
def test_the_datasheet_comes_back(played: Any, system: str) -> None:
    path, sheet, env = played[system]
    read = load_manifest(path)
    (run,) = read_recordings(read)
    found = datasheet_of(read, run)
    assert {d.effect: d for d in found.declared if d.target == "gyro"} == {
        d.effect: d for d in sheet.declared if d.target == "gyro"
    }
    assert sorted(map(str, found.declared)) == sorted(map(str, sheet.declared))
    same = {"declared": (), "mounting": sheet.mounting}  # a vehicle's has its turn's axis, too
    assert replace(found, **same) == replace(sheet, **same)
    for name, channel in env.recording().channels.items():
        np.testing.assert_array_equal(run.channels[name].values, channel.values)


def test_a_simulated_recording_in_text_gives_what_its_own_numbers_do(tmp_path: Path) -> None:
    scenario = "insenv/systems/two_position/scenarios/published_a.toml"
    text = Path(scenario).read_text(encoding="utf-8").replace('duration = "620 s"', 'duration = "100 s"')
    text = text.replace('[["300 s", "170 deg"]]', '[["40 s", "170 deg"]]').replace('"100 Hz"', '"10 Hz"')
    file = tmp_path / "short.toml"
    file.write_text(text + "decimals = 12\n", encoding="utf-8")
    path = simulate(file, tmp_path / "run", 3)
    (one,) = estimate(path, "two_position_joint").runs
    (run,) = read_recordings(load_manifest(path))
    assert np.isfinite(run.channels["sight_heading"].values).sum() == 1  # read at the start, and only there
    plugin = find(ESTIMATORS, "two_position_joint")(datasheet(load(file)))
    wanted = plugin.estimate(plugin.update(plugin.reset(), run))
    np.testing.assert_allclose(one.estimate.mean, wanted.mean, rtol=1e-9)
    blank = tmp_path / "blank.csv"
    data = next((tmp_path / "run").glob("*.csv"))
    blank.write_text(data.read_text(encoding="utf-8").replace(",nan", ","), encoding="utf-8")
    manifest = path.with_name("blank.toml")
    manifest.write_text(path.read_text(encoding="utf-8").replace(data.name, str(blank)), encoding="utf-8")
    np.testing.assert_array_equal(estimate(manifest, "two_position_joint").runs[0].estimate.mean, one.estimate.mean)


def test_the_command_writes_all_that_it_shows(
    played: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path, *_ = played["two positions"]
    found = estimate(path, "two_position_tied")
    files = [tmp_path / "out.json", tmp_path / "out.html"]
    how = ("--with", "two_position_tied", "--json", files[0], "--html", files[1])
    done = command(capsys, monkeypatch, "estimate", path, *how)
    assert done.status == 0 and done.out.strip() == summary(found).strip() + f"\n\nReport: {files[1].resolve()}"
    written = json.loads(files[0].read_text(encoding="utf-8"))
    assert written == to_json(found) and written["schema"] == "insenv.estimate/1"
    assert files[1].read_text(encoding="utf-8") == to_html(found)
    (run,) = written["runs"]
    assert [e["name"] for e in run["estimates"]] == list(found.runs[0].estimate.names)
    assert np.shape(run["covariance"]) == (9, 9) and "gyro_z" in run["not_told"]
    assert "tell nothing of" in done.out and "installation_angle" in to_html(found)


@pytest.mark.parametrize(
    ("wrong", "estimator", "says"),
    [
        (("", ""), "no_such", "no_such"),
        (("", ""), "rate_line", "gyro"),
        (('sight]\norientation = "', 'sight]\norientation = "-'), "two_position_tied", "datasheet.sight.orientation"),
        (("[datasheet.declared.", "[datasheet.declared.x"), "two_position_tied", "xbias"),
        (('targets = "gyro_x"', 'targets = "gyro_w"'), "two_position_tied", "gyro_w"),
        (("[channels.turning]", "[channels.turnings]"), "two_position_tied", "turnings"),
        (("latitude = ", "# "), "two_position_tied", "latitude"),
    ],
)
def test_what_does_not_fit_is_one_sentence(
    played: Any, tmp_path: Path, wrong: tuple[str, str], estimator: str, says: str
) -> None:
    path, *_ = played["two positions"]
    text = path.read_text(encoding="utf-8").replace("manifest_1.npz", str(path.with_name("manifest_1.npz")))
    file = tmp_path / "wrong.toml"
    file.write_text(text.replace(*wrong) if wrong[0] else text, encoding="utf-8")
    with pytest.raises(InputError, match=says) as raised:
        estimate(file, estimator)
    assert "\n" not in str(raised.value)
