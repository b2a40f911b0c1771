"""Several units judged together: pooled coefficients, false discovery rate, outliers, and the command."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.special import kolmogorov

from insenv.campaign.pool import Pool, discoveries, pool
from insenv.campaign.run import Campaign, campaign, judged, unit_names
from insenv.campaign.words import SCHEMA, summary, to_json, verdict, write_html
from insenv.cli import insenv
from insenv.close import close
from insenv.core.errors import InputError

Floats = NDArray[np.float64]
UNITS, ODD = 6, 4


def recorded(folder: Path, seed: int, asymmetry: float, drift: float = 0.0) -> Path:
    """A gyro on a table that goes from rate to rate, both ways."""
    rng = np.random.default_rng([seed, 77])
    n, dt = 1800, 0.5
    t = np.arange(1, n + 1) * dt
    u = np.tile(np.repeat(0.5 * rng.permutation(np.linspace(-1, 1, 12)), 50), 3)
    y = u * (1 + 1e-4 * rng.standard_normal()) + 1e-5 + asymmetry * np.abs(u) + drift * t
    folder.mkdir(parents=True, exist_ok=True)
    table = np.column_stack([t, y + 2e-6 * rng.standard_normal(n), u])
    np.savetxt(folder / f"unit{seed}.csv", table, "%.12g", ",", header="t,gyro,rate", comments="")
    path = folder / f"unit{seed}.toml"
    path.write_text(
        f'data = "unit{seed}.csv"\n[channels]\ntime = {{ column = "t", unit = "s" }}\n'
        'gyro = { column = "gyro", unit = "rad/s", covers = "interval" }\n'
        'table_rate = { column = "rate", unit = "rad/s", covers = "interval", source = "command" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    )
    return path


@pytest.fixture(scope="module")
def units(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Units with one asymmetry, but for an odd one."""
    folder = tmp_path_factory.mktemp("units")
    return [recorded(folder, k, 60e-6 if k == ODD else 6e-6) for k in range(UNITS)]


@pytest.fixture(scope="module")
def together(units: list[Path]) -> Campaign:
    return campaign(units)


def test_an_effect_that_all_units_have_is_discovered_with_what_they_have_in_common(together: Campaign) -> None:
    assert {d.effect for d in together.found} == {"scale_factor_asymmetry"}
    one = next(c for c in together.coefficients if c.effect == "scale_factor_asymmetry")
    # Every unit tells it, whether its own search names it or not.
    assert one.units == tuple(range(UNITS))
    assert one.pool is not None
    assert abs(one.pool.mean - 6e-6) < 4 * one.pool.sd < 4e-6
    assert one.pool.differ > 0.001


def test_the_unit_that_is_unlike_the_others_is_named_and_no_part_of_them(together: Campaign) -> None:
    assert [(o.unit, o.coefficient.effect) for o in together.outliers] == [(ODD, "scale_factor_asymmetry")]
    assert together.outliers[0].coefficient.outlying == (ODD,)
    assert f"unit{ODD} is an outlier" in summary(together)
    assert f"outlying: unit{ODD}" in verdict(together)


def test_text_page_and_json_have_the_same_figures(together: Campaign, tmp_path: Path) -> None:
    document = json.loads(json.dumps(to_json(together), allow_nan=False))
    assert document["schema"] == SCHEMA
    one = next(c for c in document["coefficients"] if c["effect"] == "scale_factor_asymmetry")
    assert [u["unit"] for u in one["units"]] == [f"unit{k}" for k in range(UNITS)]
    assert "shrunk" not in one["units"][ODD]
    assert one["population"]["mean"] == pytest.approx(6e-6, rel=0.3)
    page = write_html(together, tmp_path / "page.html").read_text()
    assert "unit4 (outlier)" in page
    assert "scale_factor_asymmetry c on gyro" in page


def test_the_command_takes_several_manifests(units: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "campaign.json"
    two = [str(path) for path in units[:2]]
    run = CliRunner().invoke(insenv, ["close-loop", *two, "--json", str(out), "--effects", "scale_factor_asymmetry"])
    assert run.exit_code == 0, run.output
    assert "2 units" in run.output
    document = json.loads(out.read_text())
    assert [u["unit"] for u in document["units"]] == ["unit0", "unit1"]
    # Two units tell no scatter.
    assert all(c["population"] is None for c in document["coefficients"])


@pytest.mark.parametrize("option", [["--calibration", "c.json"], ["--formula", "f.py"], ["--in-environment"]])
def test_what_belongs_to_one_recording_is_refused_for_several(units: list[Path], option: list[str]) -> None:
    run = CliRunner().invoke(insenv, ["close-loop", str(units[0]), str(units[1]), *option])
    assert isinstance(run.exception, InputError)
    assert "belongs to one recording" in str(run.exception)


def test_a_manifest_that_is_not_there_is_refused_before_any_is_closed(
    units: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("insenv.campaign.run.close", lambda *_, **__: pytest.fail("closed"))
    with pytest.raises(InputError, match="nowhere"):
        campaign([units[0], "nowhere.toml"])


def test_units_are_called_by_their_files() -> None:
    assert unit_names(["a/one.toml", "a/two.toml"]) == ("one", "two")
    assert unit_names(["a/gyro.toml", "b/gyro.toml"]) == (str(Path("a/gyro")), str(Path("b/gyro")))
    with pytest.raises(InputError, match="given twice"):
        unit_names(["a.toml", "b.toml", "a.toml"])


def drawn(rng: np.random.Generator, n: int, spread: float) -> tuple[Floats, Floats, Floats]:
    """Values and deviations of n units, and what they have."""
    sd = rng.uniform(0.5, 2.0, n)
    true = 3.0 + spread * rng.standard_normal(n)
    return true + sd * rng.standard_normal(n), sd, true


def pools(n: int, spread: float, count: int) -> list[tuple[Pool, Floats]]:
    rng = np.random.default_rng([n, int(10 * spread)])
    out = []
    for _ in range(count):
        value, sd, true = drawn(rng, n, spread)
        out.append((pool(value, sd), true))
    return out


def test_units_without_a_spread_have_the_weighted_mean() -> None:
    one = pool(np.array([1.0, 1.1, 0.9, 1.0]), np.array([1.0, 0.5, 0.5, 2.0]))
    assert one.spread == 0.0
    weight = 1 / np.array([1.0, 0.5, 0.5, 2.0]) ** 2
    assert one.mean == pytest.approx(np.average([1.0, 1.1, 0.9, 1.0], weights=weight))
    assert one.sd == pytest.approx(weight.sum() ** -0.5)
    assert np.ptp(one.shrunk) < 0.05


def test_the_spread_makes_the_scatter_what_it_is_on_average() -> None:
    value, sd = np.array([1.0, 5.0, -3.0, 2.0, 9.0]), np.array([1.0, 0.5, 0.8, 2.0, 1.0])
    one = pool(value, sd)
    weight = 1 / (one.spread**2 + sd**2)
    assert weight @ (value - one.mean) ** 2 == pytest.approx(len(value) - 1)
    low, high = one.spread_interval
    assert low < one.spread < high
    # In other units all is the same.
    other = pool(1e-6 * value, 1e-6 * sd)
    assert other.spread == pytest.approx(1e-6 * one.spread)
    assert other.differ == pytest.approx(one.differ)


@pytest.mark.parametrize(("n", "spread"), [(5, 0.0), (5, 3.0), (12, 1.0)])
def test_intervals_hold_what_they_promise(n: int, spread: float) -> None:
    """Of 600 populations: the mean, the next unit and each unit are where they are said to be."""
    rng = np.random.default_rng(n)
    many = pools(n, spread, 600)
    ahead = [one.ahead for one, _ in many]
    nexts = 3.0 + spread * rng.standard_normal(len(many))
    assert 0.92 < np.mean([low <= x <= high for (low, high), x in zip(ahead, nexts, strict=True)]) <= 1.0
    inside = np.concatenate([np.abs(one.shrunk - true) < 2.6 * one.shrunk_sd for one, true in many])
    assert np.mean(inside) > 0.95
    low_high = [one.spread_interval for one, _ in many]
    assert np.mean([low <= spread <= high for low, high in low_high]) > 0.92


def test_a_unit_of_the_population_is_an_outlier_as_often_as_is_said() -> None:
    p = np.sort(np.concatenate([one.outlying[:1] for one, _ in pools(8, 2.0, 500)]))
    off = np.max(np.abs(p - (np.arange(len(p)) + 0.5) / len(p)))
    assert kolmogorov(off * np.sqrt(len(p))) > 1e-3


def test_a_prior_that_is_as_sharp_as_the_test_saves_all_of_it() -> None:
    sharp = pool(np.full(9, 2.0) + 1e-3 * np.arange(9), np.full(9, 1.0))
    assert sharp.left_out(np.full(9, 1.0)) == 1.0
    wide = pool(np.array([0.0, 10.0, -20.0, 5.0]), np.full(4, 1.0))
    assert wide.left_out(np.full(4, 1.0)) < 0.02


def test_discoveries_are_those_of_benjamini_and_hochberg() -> None:
    p = np.array([0.041, 0.001, 0.9, 0.008, 0.039, 0.042, 0.06, 0.074, 0.205, 0.212])
    assert np.flatnonzero(discoveries(p, 0.05)).tolist() == [1, 3]
    # Not the first, but the last that is below its line counts.
    assert discoveries(np.array([0.03, 0.04, 0.045]), 0.05).all()
    assert not discoveries(np.array([0.5]), 0.05).any()
    assert discoveries(np.zeros(0), 0.05).shape == (0,)


def test_the_share_of_false_discoveries_is_held() -> None:
    rng = np.random.default_rng(4)
    shares = []
    for _ in range(400):
        z = rng.standard_normal(200)
        z[:20] += 3.5
        found = discoveries(0.5 * np.vectorize(_erfc)(z / np.sqrt(2)), 0.1)
        shares.append(found[20:].sum() / max(found.sum(), 1))
    assert 0.05 < np.mean(shares) < 0.11


def _erfc(x: float) -> float:
    from math import erfc

    return erfc(x)


#: Units that lack nothing: the points of a plane whose lines are campaigns.
SIDE = 5


def lines() -> list[list[int]]:
    """The affine plane of order five: 30 campaigns of five units, of which any two share one unit at the most."""
    slanted = [[SIDE * x + (slope * x + at) % SIDE for x in range(SIDE)] for slope in range(SIDE) for at in range(SIDE)]
    return [*slanted, *([SIDE * x + y for y in range(SIDE)] for x in range(SIDE))]


@pytest.mark.slow
def test_units_that_lack_nothing_make_no_discovery(tmp_path: Path) -> None:
    """Of 25 sound units in 30 campaigns one, or none, is a discovery or an outlier in any of them.

    A campaign discovers by chance in one of a hundred, so that a unit does in one of its six with 1.2 % at the most:
    two of 25 with 4 %. At a rate of a tenth it is ten times as often, and no oftener: of the five of a direction, which
    have no unit in common, three or more discover in 0.9 %, in one of six directions in 5 %.
    """
    found = [close(recorded(tmp_path, unit, 0.0)) for unit in range(SIDE**2)]
    apart = [set(a) & set(b) for a, b in combinations(lines(), 2)]
    assert max(map(len, apart)) == 1

    def judge(line: list[int], rate: float) -> Campaign:
        return judged([f"unit{unit}" for unit in line], [found[unit] for unit in line], rate)

    strict = [judge(line, 0.01) for line in lines()]
    assert len({line[d.unit] for line, one in zip(lines(), strict, strict=True) for d in one.found}) <= 1
    assert len({line[o.unit] for line, one in zip(lines(), strict, strict=True) for o in one.outliers}) <= 1
    often = [bool(judge(line, 0.1).found) for line in lines()]
    assert all(sum(often[k : k + SIDE]) <= 2 for k in range(0, len(often), SIDE))
