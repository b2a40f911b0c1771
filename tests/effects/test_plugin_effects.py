"""Effects of other packages: found, checked, tried, planted, declared, and kept by a calibration."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from insenv.calibration import calibration, correct, load_calibration
from insenv.close import close, opened
from insenv.core import plugins
from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.plugins import allow_code
from insenv.core.recording import Floats
from insenv.effects import catalogue as module
from insenv.effects.base import CurveEffect, LinearEffect, Param
from insenv.effects.bias import Bias
from insenv.effects.catalogue import ALL, CATALOGUE, TRIAD, by_key, catalogue, plug_in_of
from insenv.effects.check import check_effect
from insenv.effects.forms import columns
from insenv.scenario import simulate

ROOT = Path(__file__).parents[2]
EXAMPLE = next(
    code
    for code in re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs/effects.md").read_text(), re.MULTILINE | re.DOTALL)
    if code.startswith("# my_effects.py")
)
KEY, NAME = "centripetal_rectification", "my_effects:CentripetalRectification"
SCENARIO = """
duration = "15 min"
[table]
max_rate = "100 deg/s"
max_acceleration = "50 deg/s^2"
[profile]
kind = "staircase"
rates = ["10 deg/s", "-10 deg/s", "30 deg/s", "-30 deg/s", "20 deg/s", "-20 deg/s", "40 deg/s", "5 deg/s", "-40 deg/s"]
dwell = "100 s"
[instrument]
sampling = "10 Hz"
[instrument.gyro]
noise = { angle_random_walk = "0.01 deg/sqrt(h)" }
[held_out]
rows = [[2500, 3000], [4500, 5000], [7500, 8000]]
[declared]
bias = { c = "0.5 deg/h" }
scale_factor = { c = "20 ppm" }
[undeclared]
KEY = { c = "1e-4 s/rad" }
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with the example of the page as an installed package: module, metadata, entry point."""
    folder = tmp_path / "site"
    info = folder / "my_effects-1.0.dist-info"
    info.mkdir(parents=True)
    (folder / "my_effects.py").write_text(EXAMPLE)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-effects\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[insenv.effects]\n{KEY} = {NAME}\n")
    monkeypatch.syspath_prepend(str(folder))
    forget()
    yield folder
    monkeypatch.undo()
    forget()


def forget() -> None:
    """As in a new process: what is installed is looked for anew."""
    plugins.installed.cache_clear()
    module._plug_in.cache_clear()
    sys.modules.pop("my_effects", None)
    importlib.invalidate_caches()


def simulated(folder: Path, effect: str = KEY) -> Path:
    """The manifest of a recording with ``effect``, or another of one coefficient."""
    scenario = SCENARIO.replace("KEY", effect)
    (folder / "s.toml").write_text(scenario if effect == KEY else scenario.replace(" s/rad", ""))
    return simulate(folder / "s.toml", folder / "out", 1)


def test_the_example_of_the_page_is_short() -> None:
    assert len(EXAMPLE.strip().splitlines()) <= 25


def test_aninstalled_effect_is_simulated_named_by_the_loop_and_kept_by_a_calibration(
    package: Path, tmp_path: Path
) -> None:
    assert catalogue()[-1].key == KEY
    manifest = simulated(tmp_path)
    found = close(manifest)
    assert found.verdict == "effects-found"
    (added,) = found.targets[0].added
    assert added.effect == KEY and added.confounded_with == ()
    (c,) = added.parameters
    assert abs(c.value - 1e-4) < 4 * c.sd  # false alarm 6e-5

    file = calibration(found, opened(manifest)).save(tmp_path / "cal.json")
    path, (done,) = correct(load_calibration(file), opened(manifest), tmp_path / "corrected")
    assert [said.effect for said in done.taken] == ["bias", "scale_factor", KEY]
    assert close(path, ["scale_factor_asymmetry", KEY]).verdict == "nothing-significant"
    # Without its entry point the calibration still finds the module; without both it is refused in a sentence.
    for one in (package / "my_effects-1.0.dist-info").iterdir():
        one.unlink()
    forget()
    with pytest.raises(InputError, match=r"names 'my_effects:Cent.*', which is code; wanted --allow-code"):
        load_calibration(file)
    with allow_code():
        assert load_calibration(file).targets[0].terms[-1].plug_in == NAME
    (package / "my_effects.py").unlink()
    forget()
    wanted = r"terms\[2\].effect: effect 'my_effects:Cent.*' cannot be imported"
    with allow_code(), pytest.raises(InputError, match=wanted):
        load_calibration(file)


def test_a_manifest_and_the_list_of_effects_may_name_it(package: Path, tmp_path: Path) -> None:
    manifest = simulated(tmp_path)
    text = manifest.read_text()
    assert '["bias", "scale_factor"]' in text
    (alone,) = close(manifest, ["bias_drift", NAME]).targets[0].added
    assert alone.effect == KEY
    for name in (NAME, KEY):
        manifest.write_text(text.replace('["bias", "scale_factor"]', f'["bias", "scale_factor", "{name}"]'))
        if name == NAME:
            with pytest.raises(InputError, match="which is code; wanted --allow-code"):
                close(manifest, ["scale_factor_asymmetry"])
        found = close(manifest, ["scale_factor_asymmetry"], allow_code=name == NAME)
        assert found.verdict == "nothing-significant"
        assert KEY in [e.effect for e in found.targets[0].estimates_after]


def test_a_broken_package_is_one_sentence_and_does_not_stop_what_does_not_need_it(
    package: Path, tmp_path: Path
) -> None:
    (package / "my_effects.py").write_text(EXAMPLE.replace("u * u)", "u[:-1])"))
    manifest = simulated(tmp_path, "scale_factor_asymmetry")
    with pytest.raises(InputError, match=rf"^effect '{KEY}' \(my_effects\): .*; wanted .*$"):
        close(manifest)
    assert close(manifest, ["scale_factor_asymmetry"]).verdict == "effects-found"


@pytest.mark.slow
def test_the_command_finds_it_in_a_process_of_its_own(package: Path, tmp_path: Path) -> None:
    simulated(tmp_path)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(package), str(ROOT)]), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "insenv.cli", "close-loop", "out/manifest.toml", "--effects", KEY]
    ended = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0 and f"{KEY}: c =" in ended.stdout, ended.stderr


# --- without a package


@dataclass(frozen=True)
class Sound(LinearEffect):
    """The square of the rate."""

    id = "of_a_test"
    linear = (Param("c", "1/({y})", sd=1e-4, bound=1e-2),)
    source = "a test"
    of_rate = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        return columns(u, u * u)


class Curved(CurveEffect):
    """A rate to the power p."""

    id = "of_a_test"
    linear = (Param("c", "1", sd=1e-4, bound=1e-2),)
    shapes = (Param("p", "1", sd=0.1, low=1.0),)
    source = "a test"
    of_rate = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        return theta[..., 0, None] * np.abs(u) ** theta[..., 1, None]

    def grid(self, motion: Motion) -> Floats:
        return np.array([[1.5], [2.0], [2.5]])


def test_every_effect_of_the_catalogue_is_sound() -> None:
    # In several positions a triad's own readings take the place of the references that others need.
    alone = [effect for effect in ALL if effect not in TRIAD]
    assert {effect.key: said for effect in alone if (said := check_effect(effect))} == {}


def test_sound_effects_of_others_are_sound() -> None:
    assert check_effect(Sound()) == [] and check_effect(Curved()) == []


def faulty(kind: type = Sound, **changed: Any) -> Any:
    return type("Faulty", (kind,), changed)()


TWO = (Param("c", "1/({y})", sd=1e-4), Param("c", "1", sd=1e-4))


@pytest.mark.parametrize(
    ("effect", "sentence"),
    [
        (Sound, "Sound is a class; wanted an effect made of it"),
        (3, "int is no effect"),
        (faulty(id="Of a test"), "its id is 'Of a test'"),
        (faulty(id="bias"), "its id 'bias' is that of an effect of insenv"),
        (faulty(source=" "), "it has no source"),
        (faulty(linear=()), "it has no linear parameter"),
        (faulty(linear=[TWO[0]]), "linear is ["),
        (faulty(linear=TWO), "wanted each name once"),
        (faulty(linear=(Param("c", "", sd=1.0),)), "has the unit ''"),
        (faulty(linear=(Param("c", "1", sd=0.0),)), "c: sd = 0"),
        (faulty(linear=(Param("c", "1", sd=2.0, bound=1.0),)), "c: sd = 2 beyond bound = 1"),
        (faulty(shapes=(Param("p", "1", sd=1.0),)), "a LinearEffect has shapes"),
        (faulty(needs=("humidity",)), "it needs 'humidity'"),
        (faulty(instruments=("clock",)), "instruments = ('clock',)"),
        (faulty(belongs="nobody"), "belongs = 'nobody'"),
        (faulty(__hash__=None), "not hashable"),
        (faulty(basis=lambda self, u, motion: u), "the basis has the shape (120,); wanted (120, 1)"),
        (faulty(basis=lambda self, u, motion: columns(u, u)[:-1]), "the basis has the shape (119, 1)"),
        (faulty(basis=lambda self, u, motion: columns(u, u, u)), "the basis has the shape (120, 2)"),
        (faulty(basis=lambda self, u, motion: columns(u, u / 0)), "the basis is not finite"),
        (faulty(basis=lambda self, u, motion: columns(u, 0 * u)), "it adds nothing"),
        (faulty(basis=lambda self, u, motion: 1 / 0), "it ends with ZeroDivisionError"),
        (faulty(basis=lambda self, u, motion: columns(u, u + motion.middle)), "it follows the time from the start"),
        (faulty(of_rate=False), "it follows the input rate, but of_rate is False; wanted of_rate = True"),
        (faulty(of_time=True), "it does not follow the time from the start of the run"),
        (faulty(basis=lambda self, u, motion: columns(u, u * motion.force["x"])), "wanted it in needs"),
        (faulty(basis=lambda self, u, motion: columns(u, np.cumsum(u, -1))), "two parts of a run are not the whole"),
        (faulty(Curved, grid=lambda self, motion: np.zeros((3, 2))), "grid has the shape (3, 2)"),
        (faulty(Curved, grid=lambda self, motion: np.array([[np.nan]])), "grid has values that are not finite"),
        (faulty(Curved, jacobian=lambda self, u, motion, theta: np.ones((len(u), 2))), "is not the slope in c"),
        (faulty(Curved, curve=lambda self, u, motion, theta: 1e-6 + 0 * u * theta[0]), "it still adds something"),
    ],
    ids=lambda value: re.sub(r"\W+", "_", value)[:40] if isinstance(value, str) else "",
)  # fmt: skip
def test_each_fault_is_a_sentence(effect: Any, sentence: str) -> None:
    said = check_effect(effect)
    assert any(sentence in one for one in said), said
    assert all("\n" not in one and one[-1] not in ".;" for one in said)


def test_an_effect_is_named_by_its_module() -> None:
    key = f"{__name__}:Sound"
    effect = by_key(key)
    assert effect.key == "of_a_test" and plug_in_of(effect) == key
    assert by_key("of_a_test", key) == effect
    assert plug_in_of(Bias()) == "" and plug_in_of(replace(by_key("encoder_harmonic"), order=7)) == ""  # type: ignore[call-arg]


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        ("no_such_module_xyz:Name", "effect 'no_such_module_xyz:Name' cannot be imported"),
        ("insenv.effects.bias:Nothing", "cannot be imported"),
        ("insenv.effects.base:OUTPUT", "is a str; wanted a class"),
        ("insenv.effects.base:Param", "is no effect"),
        ("os:abort", "is no effect"),
        ("pathlib:Path", "is no effect"),
    ],
)
def test_what_is_no_effect_is_refused_in_one_sentence(key: str, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        by_key(key)
    assert sentence in str(caught.value) and "\n" not in str(caught.value)


def test_without_packages_the_catalogue_is_that_of_insenv() -> None:
    assert catalogue() == CATALOGUE


@pytest.mark.parametrize("name", ["os:abort", "tests.no_module:Name"])
def test_a_file_runs_no_code(tmp_path: Path, name: str) -> None:
    """A manifest and a scenario that name a callable are refused before anything is imported."""
    (tmp_path / "m.toml").write_text(
        'data = "a.csv"\n[channels]\ntime = { rate = "10 Hz" }\ngyro = { column = 0, unit = "deg/s" }\n'
        f'[model]\ntarget = "gyro"\ndeclared = ["bias", "{name}"]\n'
    )
    with pytest.raises(InputError, match=f"model.declared names '{name}', which is code; wanted --allow-code"):
        close(tmp_path / "m.toml")
    (tmp_path / "s.toml").write_text(SCENARIO.replace("KEY", f'"{name}"').replace(" s/rad", ""))
    with pytest.raises(InputError, match="which is code; wanted --allow-code"):
        simulate(tmp_path / "s.toml", tmp_path / "out", 1)
