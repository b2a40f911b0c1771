"""Declarations that cannot be are stopped or cautioned; sound ones pass without a word."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from declaration_cases import Bench, bench, damages

from insenv.close import close
from insenv.core.errors import InputError
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.identify.clean.plausibility import implausible
from insenv.report import summary


def said(path: Path) -> str:
    """The sentence that stops, else the cautions; empty where all is sound."""
    try:
        manifest = load_manifest(path)
        found = implausible(manifest, read_recordings(manifest))
    except InputError as error:
        return f"stop: {error}"
    return " ".join(dict.fromkeys(text for texts in found.values() for text in texts))


def test_sound_declarations_pass(tmp_path: Path) -> None:
    """200 sound benches: gains within 6 sd of 2 % never come near a gain of 0.5 or 1.5; 2 % of words pass with 2 %."""
    assert [text for seed in range(200) if (text := said(bench(seed).write(tmp_path, "sound")))] == []


def test_wrong_declarations_are_stopped_or_cautioned(tmp_path: Path) -> None:
    silent, tried = [], 0
    for seed in range(40):
        one = bench(1000 + seed)
        for name, spoil in damages(one).items():
            tried += 1
            if not said(spoil(one).write(tmp_path, "wrong")):
                silent.append((seed, name))
    assert tried >= 130
    assert silent == []


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("gyro in rad", 'channels.gyro.unit = "rad/s" (declared "deg/s")'),
        ("gyro declared rad", 'channels.gyro.unit = "deg/s" (declared "rad/s")'),
        ("gyro twice turned into rad", 'channels.gyro.unit = "57.29578 rad/s" (declared "rad/s", and converted twice)'),
        ("gyro in deg/h", 'channels.gyro.unit = "deg/h" (declared "deg/s")'),
        ("quantity", 'channels.gyro.quantity = "rate" (declared "increment")'),
        ("angle in rad", 'channels.table_angle.unit = "rad" (declared "deg")'),
        ("time in ms", 'channels.time.unit = "ms" (declared "s")'),
        ("dead gyro", "the same value in all"),
        ("gyro across", "it does not turn with the table"),
        ("reversed", "The input axis of gyro is reversed"),
    ],
)
def test_the_likely_mistake_is_named(tmp_path: Path, name: str, words: str) -> None:
    wanted = {"gyro", "table_angle", "time"}
    one = next(b for seed in range(200) if set((b := bench(seed)).says) == wanted and not b.says["gyro"][2])
    assert words in said(damages(one)[name](one).write(tmp_path, "wrong"))


def test_the_sign_of_a_declared_unit_stays(tmp_path: Path) -> None:
    """An axis that was declared the other way, in a wrong unit."""
    says = ("gyro", "deg/s", "")
    one = next(b for seed in range(200) if (b := bench(seed)).says.get("gyro") == says and "table_angle" in b.says)
    turned = Bench({**one.columns, "gyro": -np.pi / 180 * one.columns["gyro"]}, one.says, one.targets)
    turned = replace(turned, says={**one.says, "gyro": ("gyro", "-1 deg/s", "")})
    assert 'channels.gyro.unit = "-1 rad/s" (declared "-1 deg/s")' in said(turned.write(tmp_path, "minus"))


def test_column_names_that_contradict(tmp_path: Path) -> None:
    one = bench(next(s for s in range(100) if "gyro" in bench(s).says and not bench(s).says["gyro"][2]))
    columns = {**one.columns, "time_ms": one.columns["time"], "gyro [rad/s]": one.columns["gyro"]}
    says = {**one.says, "time": ("time_ms", "s", ""), "gyro": ("gyro [rad/s]", "deg/s", "")}
    text = said(Bench(columns, says, one.targets).write(tmp_path, "names"))
    assert "'time_ms' says ms by its name" in text
    assert "'gyro [rad/s]' says rad/s by its name" in text


def test_stamps_and_temperatures_of_no_laboratory(tmp_path: Path) -> None:
    one = bench(next(s for s in range(100) if "gyro" in bench(s).says))
    stamps = {**one.columns, "time": 1.7e12 + 1e3 * one.columns["time"]}
    assert 'as with channels.time.unit = "ms"' in said(Bench(stamps, one.says, one.targets).write(tmp_path, "late"))
    warm = {**one.columns, "T": np.full(len(one.columns["time"]), 298.0)}
    says = {**one.says, "temperature": ("T", "degC", "")}
    assert 'such as "K"' in said(Bench(warm, says, one.targets).write(tmp_path, "warm"))


def test_a_caution_stands_above_the_figures(tmp_path: Path) -> None:
    one = next(b for s in range(200) if "gyro" in (b := bench(s)).says and "table_angle" not in b.says)
    found = close(damages(one)["reversed"](one).write(tmp_path, "reversed"), effects=["scale_factor"])
    (target,) = found.targets
    assert "reversed" in target.cautions[0]
    assert summary(found).index("Caution: The input axis of gyro is reversed") < summary(found).index("Held-out error")


@pytest.mark.parametrize("seed", range(4))
def test_a_point_in_the_wrong_place_is_said_of_slow_turns_too(tmp_path: Path, seed: int) -> None:
    """Rates of a hand that are ten times those of its attitude, for whose clock is ten times too fast."""
    rng = np.random.default_rng(seed)
    t = np.arange(3000) * 0.1
    rate = 3e-3 * np.sin(2 * np.pi * t / 17) + 3e-3 * np.sin(2 * np.pi * t / 41 + seed)
    angle = np.cumsum(rate) * 0.1 + 2e-4 * rng.standard_normal(len(t))
    rows = np.column_stack([t, 10.0 * rate + 2e-3 * rng.standard_normal(len(t)), angle])
    np.savetxt(tmp_path / "run.csv", rows, "%.9g", ",", header="t,g,a", comments="")
    (tmp_path / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\ntable_angle = { column = "a", unit = "rad" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    assert "a factor of 10" in said(tmp_path / "run.toml")


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_a_triad_without_gravity_is_a_linear_acceleration(gravity: float, tmp_path: Path) -> None:
    """Noise that is as tall as increments of gravity would be is no increment; gravity as increments is stopped."""
    dt, n = 0.005, 4000
    noise = 0.03 * np.random.default_rng(1).standard_normal((3, n))
    force = noise if not gravity else dt * (noise + np.array([[0.0], [0.0], [gravity]]))
    np.savez(tmp_path / "run.npz", t=dt * np.arange(n), **dict(zip("xyz", force, strict=True)))
    channels = "".join(f'accel_{a} = {{ column = "{a}", unit = "m/s^2" }}\n' for a in "xyz")
    (tmp_path / "run.toml").write_text(
        f'data = "run.npz"\n[channels]\ntime = {{ column = "t", unit = "s" }}\n{channels}'
        '[model]\ntarget = ["accel_x", "accel_y", "accel_z"]\ndeclared = ["bias"]\nprocedure = "static"\n'
    )
    text = said(tmp_path / "run.toml")
    assert ("stop: " in text and "increment" in text) if gravity else text.count("a linear acceleration") == 1


@pytest.mark.parametrize("unsigned", ["reading", "reference", "neither", "both"])
def test_a_rate_without_its_sign_is_stopped(unsigned: str, tmp_path: Path) -> None:
    t = 0.01 * np.arange(1, 6001)
    rate = np.sin(0.3 * t) + 0.4 * np.sin(1.1 * t)
    gyro = 1.01 * rate + 0.02 + 0.01 * np.random.default_rng(1).standard_normal(len(t))
    np.savez(
        tmp_path / "run.npz",
        t=t,
        gyro=np.abs(gyro) if unsigned in ("reading", "both") else gyro,
        rate=np.abs(rate) if unsigned in ("reference", "both") else rate,
    )
    (tmp_path / "run.toml").write_text(
        'data = "run.npz"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "gyro", unit = "rad/s" }\ntable_rate = { column = "rate", unit = "rad/s" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    )
    assert ("and not its sign" in said(tmp_path / "run.toml")) is (unsigned in ("reading", "reference"))


@pytest.mark.parametrize(("unit", "words"), [("deg/s", ""), ("rad/s", 'unit = "deg/s"'), ("-1 deg/s", "reversed")])
def test_files_of_one_rate_each_tell_a_gain_together(unit: str, words: str, tmp_path: Path) -> None:
    files = []
    for k, rate in enumerate((30.0, -30.0, 60.0, -60.0)):
        y = 1.01 * rate + 1.5 + 0.05 * np.random.default_rng(k).standard_normal(600)
        np.savez(tmp_path / f"run{k}.npz", t=0.1 * np.arange(600), u=np.full(600, rate), y=y)
        files.append(f'[[runs]]\nfile = "run{k}.npz"\n')
    (tmp_path / "run.toml").write_text(
        '[channels]\ntime = { column = "t", unit = "s" }\ntable_rate = { column = "u", unit = "deg/s" }\n'
        f'gyro = {{ column = "y", unit = "{unit}" }}\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n' + "".join(files)
    )
    text = said(tmp_path / "run.toml")
    assert words in text if words else not text
