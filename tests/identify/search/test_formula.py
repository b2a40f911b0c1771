"""A formula for what has no name: found, told in the place of what explains less, written, and tried the next time.

Recordings are made with NumPy alone; seeds are fixed.
"""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from sequential import Shares
from simulated_runs import gyro_run, manifest, use

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.effects.base import LinearEffect
from insenv.effects.catalogue import by_key
from insenv.effects.check import check_effect
from insenv.effects.formula import product
from insenv.effects.own import CATALOGUE
from insenv.identify import formula as formulas
from insenv.identify.findings import Findings, Formulas
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.formula import AFTER_EFFECT, CATALOGUED, explains_more, grammar
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.scan import Hit
from insenv.report.formula import sentences, write_effects
from insenv.report.html import to_html
from insenv.report.json import to_json
from insenv.report.text import summary

Floats = NDArray[np.float64]
Law = Callable[[Floats, Floats], Floats]
STUDY = Path(__file__).resolve().parents[3] / "scripts" / "studies" / "unknown"
DT, N = 0.5, 3600
#: Heating of a chamber, one step after another [K/s].
STEPS = [0.0, 0.03, 0.0, -0.03, 0.02, 0.0]


def recorded(folder: Path, law: Law, seed: int = 0, declared: str = '"bias", "scale_factor"', more: str = "") -> Path:
    """A table that goes from rate to rate in a chamber that goes from level to level; ``law`` of rate and degC."""
    rng = np.random.default_rng(seed)
    t = np.arange(1, N + 1) * DT
    told = np.repeat(0.6 * rng.permutation(np.linspace(-1, 1, 24)), N // 24)
    u = np.tile(told[:1200], 3)
    levels = np.repeat(rng.permutation([10.0, 16.0, 22.0, 28.0, 34.0, 40.0]), N // 6)
    warm = np.empty(N)
    now = levels[0]
    for i, level in enumerate(levels):
        now += (level - now) * DT / 80.0
        warm[i] = now
    y = u * (1 + 2e-4) + 1e-5 + law(u, warm - 25.0) + 2e-6 * rng.standard_normal(N)
    np.savetxt(
        folder / "run.csv", np.column_stack([t, y, u, warm]), "%.12g", ",", header="t,gyro,rate,temp", comments=""
    )
    path = folder / "gyro.toml"
    path.write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "gyro", unit = "rad/s", covers = "interval" }\n'
        'table_rate = { column = "rate", unit = "rad/s", covers = "interval", source = "command" }\n'
        'temperature = { column = "temp", unit = "degC" }\n'
        f'[model]\ntarget = "gyro"\ndeclared = [{declared}]\n{more}'
    )
    return path


def heated(u: Floats, warm: Floats) -> Floats:
    return np.asarray(4e-7 * u**2 * warm)


def nothing(u: Floats, warm: Floats) -> Floats:
    return np.zeros(len(u))


def sought(found: Findings) -> Formulas:
    formulas = found.targets[0].formulas
    assert formulas is not None
    return formulas


@pytest.fixture(scope="module")
def law(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Findings]:
    folder = tmp_path_factory.mktemp("law")
    return folder, close(recorded(folder, heated), formula=True)


def test_the_formula_of_a_law_that_no_effect_is_is_found_with_its_coefficient(law: tuple[Path, Findings]) -> None:
    found = sought(law[1]).found
    assert found is not None
    assert found.formula == "u^2 * (T - T_ref)"
    (c,) = found.parameters
    assert abs(c.value - 4e-7) < 4 * c.sd < 2.5e-7
    assert c.unit == "s/(rad K)"
    assert found.held_out_after < found.held_out_before
    assert found.p_value < 1e-6


def test_what_is_left_is_said_to_go_with_a_product_though_nobody_asks_for_a_formula(law: tuple[Path, Findings]) -> None:
    (target,) = law[1].targets
    assert any("goes with u^2 * (T - T_ref)" in reason for reason in target.reasons)
    assert not {a.effect for a in target.added} & {"bias_temperature", "scale_factor_temperature"}


def test_a_law_that_is_nothing_at_a_temperature_of_its_own_is_found_with_its_origin(tmp_path: Path) -> None:
    """Neither the law at the reference of the recording nor its part that does not change explains a half of it."""
    found = close(recorded(tmp_path, lambda u, warm: 1.5e-7 * np.abs(u) * (warm - 4.0)), formula=True)
    law = sought(found).found
    assert law is not None
    assert "|u| * (T - T_0)" in (law.formula, *law.alike)
    assert found.targets[0].verdict in ("unexplained-structure", "effects-found-incomplete")
    file = write_effects(found, tmp_path / "my_effect.py")
    assert file is not None
    assert check_effect(by_key(str(file))) == []


def test_an_effect_that_a_temperature_changes_keeps_its_name(tmp_path: Path) -> None:
    """A law with an origin of its own holds the asymmetry too, which is there by itself."""
    found = close(recorded(tmp_path, lambda u, warm: 4e-5 * np.abs(u) + 4e-7 * np.abs(u) * warm))
    (target,) = found.targets
    assert "scale_factor_asymmetry" in [a.effect for a in target.added]
    assert any("|u| * (T - T_ref)" in reason for reason in target.reasons)


def test_what_follows_the_rates_of_the_minute_before_is_said(tmp_path: Path) -> None:
    """An after-effect is no filter of the output, which is over in seconds, and no effect has it."""

    def after(u: Floats, warm: Floats) -> Floats:
        slow = np.zeros(len(u))
        for i in range(1, len(u)):
            slow[i] = slow[i - 1] + (u[i] - slow[i - 1]) * DT / 60.0
        return 1e-5 * slow

    (target,) = close(recorded(tmp_path, after)).targets
    assert any("goes with lag(u)" in reason for reason in target.reasons)


@pytest.mark.parametrize("size", [0.0, 2e-3])
def test_a_law_of_the_temperature_is_asked_of_a_unit_at_rest(tmp_path: Path, size: float) -> None:
    """A stress that goes with the square of the heating: beside noise that may walk it was nothing significant."""
    rng, t = np.random.default_rng(3), np.arange(1.0, N + 1)
    change = np.interp(t, [0, 300, 301, 900, 901, 1500, 1501, 2100, 2101, 2700, 2701, 3600], np.repeat(STEPS, 2))
    warm = 25.0 + np.cumsum(change)
    gyro = size * change**2 * 1e2 + 5e-5 * rng.standard_normal(N)
    np.savetxt(tmp_path / "run.csv", np.column_stack([t, gyro, warm]), "%.12g", ",", header="t,gyro,temp", comments="")
    path = tmp_path / "gyro.toml"
    path.write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "gyro", unit = "rad/s" }\ntemperature = { column = "temp", unit = "degC" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    (target,) = close(path).targets
    said = any("(dT/dt)^2" in reason for reason in target.reasons)
    assert said is (size > 0)


@pytest.mark.parametrize(("duration", "tried"), [(8.0, False), (900.0, True)])
def test_an_after_effect_is_tried_where_a_run_is_longer_than_any_filter_of_an_output(
    duration: float, tried: bool
) -> None:
    run = gyro_run("sine", 7, duration=duration, noise={"angle_random_walk": 1e-5})
    prepared = prepare(manifest(), (run.recording,), (use(len(run.recording)),), "gyro")
    fit = solve(prepared.problem, prepared.model)
    found = formulas.testable(prepared.problem, fit, grammar())
    assert found and all(one.terms for one in found)
    assert (AFTER_EFFECT in [one.effect.title for one in found]) == tried


def test_a_characteristic_with_a_corner_has_a_knee_and_no_dead_band(tmp_path: Path) -> None:
    """It was a dead band that loses some 1e-5 of the rates below it, and had no doubt."""
    (target,) = close(recorded(tmp_path, lambda u, warm: 4e-5 * np.sign(u) * np.maximum(np.abs(u) - 0.3, 0.0))).targets
    assert [a.effect for a in target.added] == ["scale_factor_knee"]


def test_what_was_found_is_in_text_html_and_json(law: tuple[Path, Findings]) -> None:
    (sentence, *_) = sentences(law[1].targets[0])
    assert "c u^2 * (T - T_ref)" in sentence
    assert "c u^2 * (T - T_ref)" in " ".join(summary(law[1]).split())
    assert "c u^2 * (T - T_ref)" in to_html(law[1])
    block = to_json(law[1])["formula"]
    assert block["found"]["formula"] == "u^2 * (T - T_ref)"
    assert block["tried"] > 50
    json.dumps(block, allow_nan=False)


def test_the_next_search_tries_the_file_and_names_it(law: tuple[Path, Findings]) -> None:
    folder, found = law
    file = write_effects(found, folder / "my_effect.py")
    assert file is not None
    effect = by_key(str(file))
    assert check_effect(effect) == []
    assert "found on" in effect.source
    (param,) = effect.linear
    assert param.sd < param.bound < 1e-4
    again = recorded(folder, heated, more='effects = ["my_effect.py"]\n')
    with pytest.raises(InputError, match="--allow-code"):
        close(again)
    (target,) = close(again, allow_code=True).targets
    assert [a.effect for a in target.added] == [effect.id]
    assert target.verdict == "effects-found"
    # Declared, it is part of the model, and nothing is missing.
    whole = recorded(folder, heated, declared='"bias", "scale_factor", "my_effect.py"')
    (target,) = close(whole, allow_code=True).targets
    assert target.verdict == "nothing-significant"


def test_where_nothing_is_missing_no_formula_is_told_and_no_file_written(tmp_path: Path) -> None:
    found = close(recorded(tmp_path, nothing), formula=True)
    assert sought(found).found is None
    assert sought(found).reason
    assert found.targets[0].verdict == "nothing-significant"
    assert write_effects(found, tmp_path / "my_effect.py") is None
    assert not (tmp_path / "my_effect.py").exists()
    assert "formula" not in to_json(close(recorded(tmp_path, nothing)))


def test_an_effect_of_the_catalogue_keeps_its_place(tmp_path: Path) -> None:
    found = close(recorded(tmp_path, lambda u, warm: 4e-5 * np.abs(u)), formula=True)
    assert [a.effect for a in found.targets[0].added] == ["scale_factor_asymmetry"]
    assert sought(found).found is None


def test_a_formula_that_explains_more_is_told_in_the_place_of_what_was_added(tmp_path: Path) -> None:
    found = close(recorded(tmp_path, lambda u, warm: 3e-7 * np.abs(warm)), formula=True)
    assert found.targets[0].added
    told = sought(found).found
    assert told is not None
    assert told.formula == "|T - T_ref|"
    assert told.instead_of
    assert {key.partition(":")[0] for key in told.instead_of} <= {a.effect for a in found.targets[0].added}


def test_a_product_that_is_a_part_of_a_law_is_not_told(tmp_path: Path) -> None:
    """A law of the temperature with three bends: no power of it, and no product, is all of it."""
    found = close(recorded(tmp_path, lambda u, warm: 4e-6 * np.sin(0.55 * warm)), formula=True)
    assert sought(found).found is None


@cache
def spans() -> list[Floats]:
    """Orthonormal bases of the linear effects of the catalogue, beside a bias, on a table that swings in a chamber."""
    motion, found = swinging(), []
    for effect in CATALOGUE:
        if not isinstance(effect, LinearEffect) or effect.generic or effect.missing(motion):
            continue
        own = effect.basis(motion.rate, motion).reshape(motion.n, -1)
        size = np.linalg.norm(own, axis=0)
        found.append(np.linalg.qr(np.column_stack([own[:, size > 0] / size[size > 0], np.ones(motion.n)]))[0])
    return found


def spanned(text: str) -> bool:
    """Whether one of them spans a formula there."""
    motion = swinging()
    columns = [c / np.linalg.norm(c) for c in product(text).means(motion.rate, motion, "a formula")]
    return any(all(np.linalg.norm(x - q @ (q.T @ x)) < 1e-2 for x in columns) for q in spans())


@cache
def swinging() -> Motion:
    t: Floats = np.arange(1201) * np.float64(0.1)
    angle = 5.0 * np.sin(0.3 * t) + 0.4 * t + 0.5 * np.sin(0.13 * t)
    axes = {axis: 0.2 + np.sin((0.11 + 0.05 * k) * t[1:] + k) for k, axis in enumerate("xyz")}
    return Motion(
        t=t,
        rate=np.diff(angle) / 0.1,
        angle=angle,
        rate_edges=np.gradient(angle, 0.1),
        temperature=298.15 + 5 * np.sin(0.07 * t) + 3 * np.cos(0.19 * t),
        force=axes,
        vibration={axis: 1.0 + 0.9 * np.sin(4 * x) for axis, x in axes.items()},
    )


def test_no_formula_that_is_tried_is_an_effect_of_the_catalogue() -> None:
    tried = [one.text for one in grammar() if not one.lagged]
    assert [text for text in tried if spanned(text)] == []
    assert [text for text in CATALOGUED if not text.startswith("lag(") and not spanned(text)] == []


@pytest.fixture
def study() -> Iterator[ModuleType]:
    sys.path.insert(0, str(STUDY))
    yield importlib.import_module("formulas")
    sys.path.remove(str(STUDY))


#: Laws, drawn in turn, that are not found as such, where seven of ten are asked; nulls with a formula. Good shares are
#: refused with 6e-4 and 3e-4, bad ones pass with 4 % and 9 %: each trial closes a recording.
NOT_FOUND, OF_NOTHING = Shares(0.1, 0.5, alarm=1e-3, miss=0.05), Shares(0.01, 0.3, alarm=1e-3, miss=0.1)


@pytest.mark.slow
def test_seven_of_ten_laws_of_strangers_are_found_and_none_where_there_is_none(study: ModuleType) -> None:
    words: list[str] = []

    def spoiled() -> Iterator[bool]:
        for k in np.random.default_rng(11).permutation(len(study.LAWS)):
            words.append(study.right(study.of_law(study.LAWS[k], 11, 20.0)))
            yield words[-1] not in ("right", "equivalent")

    assert NOT_FOUND.accept(spoiled())
    assert words.count("wrong") <= 1
    nulls = (study.of_null(n, 11).get("targets", []) for n in range(40))
    assert OF_NOTHING.accept(any("found" in target for target in targets) for targets in nulls)


def test_a_product_explains_more_than_an_effect_by_itself_too() -> None:
    """Of an encoder's wave errors of the reference took 127 of 151, of |u| u cos 2a 92 of 147: it lost its name."""
    wave = Term(by_key("encoder_harmonic:2"))
    own = Hit(Candidate(wave.effect, (wave,)), wave, 150.6, 62.0, 7.5, 2, alone=15.4)
    alike = replace(own, likelihood_ratio=147.2, looks=458.0, deviate=9.03, alone=15.3)
    assert alike.rank > own.rank + 6 and not explains_more(alike, own)
    assert explains_more(replace(alike, likelihood_ratio=190.0), own)
    assert not explains_more(replace(alike, likelihood_ratio=190.0, deviate=5.0), own)
