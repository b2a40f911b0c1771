"""The blind bench: its physics against the library's, its ruler against chance, and a few of its cases."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blind import climate, curves, damage, noise, parts, table
from blind.cases import Made, draw
from blind.noise import Noise
from blind.plan import plan
from blind.record import record, true_noise
from blind.strength import Ruler
from blind.world import World
from command import run

from insenv.close import close
from insenv.core.motion import Motion
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.power import by_power_up
from insenv.effects.catalogue import by_key

N, DT = 3000, 0.1


def world(profile: str = "staircase", seed: int = 1) -> World:
    rng = np.random.default_rng(seed)
    return World(
        n=N,
        dt=DT,
        profile=profile,
        trajectory=table.draw(profile, N * DT, 1.0, rng),
        climate=climate.draw("chamber", N * DT, rng),
        tilt=np.pi / 2,
        latitude=0.0,
    )


def motion(w: World) -> Motion:
    """The same exposure as the library has it."""
    edges = DT * np.arange(N + 1.0)
    return Motion(
        t=edges,
        rate=w.turned,
        rate_edges=w.trajectory.rate(edges),
        angle=w.trajectory.angle(edges),
        temperature=w.climate.at(edges) + 273.15,
        reference_temperature=298.15,
    )


#: Two texts of one formula: the bench's curve and the library's parameters.
FORMULAS = {
    "bias_drift": (lambda w: 2e-6 * curves.drift(w), (2e-6,)),
    "bias_warm_up": (lambda w: 1e-3 * curves.warm_up(w, 40.0), (1e-3, 40.0)),
    "bias_step": (lambda w: 1e-3 * curves.step(w, 101.23), (1e-3, 101.23)),
    "bias_temperature:2": (lambda w: 1e-3 * curves.temperature(w) + 1e-4 * curves.temperature(w, 2), (1e-3, 1e-4)),
    "bias_temperature_rate": (lambda w: 1e-2 * curves.temperature_rate(w), (1e-2,)),
    "bias_thermal_lag": (lambda w: 1e-3 * curves.thermal_lag(w, 30.0), (1e-3, 30.0)),
    "scale_factor": (lambda w: 1e-3 * curves.scale(w), (1e-3,)),
    "scale_factor_drift": (lambda w: 1e-6 * curves.scale_drift(w), (1e-6,)),
    "scale_factor_warm_up": (lambda w: 1e-3 * curves.scale_warm_up(w, 40.0), (1e-3, 40.0)),
    "scale_factor_temperature": (lambda w: 1e-4 * curves.scale_temperature(w), (1e-4,)),
    "scale_factor_asymmetry": (lambda w: 1e-3 * curves.asymmetry(w), (1e-3,)),
    "scale_factor_cubic": (lambda w: 1e-3 * curves.cubic(w), (1e-3,)),
    "scale_factor_anomaly": (lambda w: 1e-3 * curves.anomaly(w, 0.6, 0.1), (1e-3, 0.6, 0.1)),
    "lock_in": (lambda w: curves.lock_in(w, 1e-3), (1e-6,)),
    "angle_locked_rate:3": (lambda w: 1e-3 * curves.locked(w, 3), (1e-3, 0.0)),
    "timing_skew": (lambda w: w.encoder_shift(curves.late(w, 1e-4)), (-1e-4,)),
    "tone": (lambda w: 1e-3 * curves.tone(w, 0.31, 0.5 * np.pi), (1e-3, 0.0, 0.31)),
}


@pytest.mark.parametrize("key", FORMULAS)
def test_two_independent_texts_of_one_formula_agree(key: str) -> None:
    ours, theta = FORMULAS[key]
    smooth = key in ("lock_in", "timing_skew")
    w = world("sine" if smooth else "staircase")
    theirs, _ = by_key(key).apply(w.turned, motion(w), np.array(theta), by_key(key).begin(motion(w), np.array(theta)))
    mine = ours(w)
    # Samples in which direction or speed change hold a mean over a bend, which each text takes in its own way.
    inside = smooth | (np.abs(np.gradient(np.gradient(w.turned))) < 1e-5)
    inside[[0, -1]] = False
    inside &= (key != "lock_in") | (np.abs(w.turned) > 0.3)  # a lock bends inside a sample that is slow
    distance = np.sqrt(np.mean((mine - theirs)[inside] ** 2))
    # The rate of a temperature that is known once a second lags its bends.
    assert distance < (0.05 if key == "bias_temperature_rate" else 0.01) * np.std(mine[inside])


def test_an_encoder_that_reads_too_much_shifts_the_rate_as_the_library_says() -> None:
    w = world()
    theirs = by_key("encoder_harmonic:2").apply(w.turned, motion(w), np.array([1e-4, 0.0]))[0]
    mine = w.encoder_shift(-1e-4 * curves.encoder(w, 2))
    assert np.allclose(mine[1:], theirs[1:], atol=1e-9)


@pytest.mark.parametrize("profile", table.PROFILES)
def test_the_angle_is_the_integral_of_the_rate(profile: str) -> None:
    way = table.draw(profile, 300.0, 2.0, np.random.default_rng(3))
    t = np.linspace(0, 300, 600_001)
    rate = way.rate(t)
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
    assert np.allclose(way.angle(t) - way.angle(t[:1]), summed, atol=2e-6)


@pytest.mark.parametrize(
    ("made", "tau", "wanted"),
    [
        (Noise(1e-4, 0.0, 0.0), 1.0, 1e-4),
        (Noise(0.0, 1e-4, 0.0), 20.0, 0.664e-4),
        (Noise(0.0, 0.0, 1e-5), 30.0, 1e-5 * np.sqrt(10)),
    ],
    ids=["white", "flicker", "random walk"],
)
def test_noise_has_the_allan_deviation_of_its_coefficient(made: Noise, tau: float, wanted: float) -> None:
    # 20 records of 1000 s: the mean variance spreads by about 6 % (random walk); 20 % is passed once in 1e4 seeds.
    rng = np.random.default_rng(4)
    count = round(tau / 0.5)
    means = [noise.rates(made, 2000, 0.5, rng)[: 2000 // count * count].reshape(-1, count).mean(1) for _ in range(20)]
    variance = np.mean([0.5 * np.mean(np.diff(m) ** 2) for m in means])
    assert np.sqrt(variance) == pytest.approx(wanted, rel=0.2)


def test_the_ruler_counts_noise_as_one_per_mode() -> None:
    made = Noise(1e-4, 3e-5, 1e-6)
    ruler = Ruler(made, DT, [np.arange(N)], np.zeros((N, 0)))
    rng = np.random.default_rng(5)
    squares = [ruler.beside(noise.rates(made, N, DT, rng)) ** 2 / (N - 1) for _ in range(20)]
    # 60 000 squares of unit normals: a spread of 0.006; flicker is folded at the sampling rate by a few per cent.
    assert np.mean(squares) == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize("runs", [1, 2])
@pytest.mark.parametrize("output", ["pulses", "increment", "rate"])
def test_the_noise_of_a_recording_is_what_its_maker_says(output: str, runs: int) -> None:
    rng = np.random.default_rng(6)
    chosen = plan(rng, ("staircase",), encoder=True)
    weather = climate.Climate("room", np.repeat(chosen.world.climate.values, runs, axis=0))
    one = replace(chosen.world, n=4000, instant=False, runs=runs, climate=weather)
    chosen = replace(chosen, output=output, world=one, biases=(0.0, 1e-5)[:runs])
    part = parts.EXACT["encoder_harmonic:1"](chosen.world, rng)
    noise_of = [record(chosen, [(part, 1e-5)], rng).noise for _ in range(5)]
    pieces = np.split(np.arange(4000), runs)
    ruler = Ruler(true_noise(chosen), chosen.world.dt, pieces, np.zeros((4000, 0)))
    # 20 000 squares of unit normals: a spread of 0.01.
    assert np.mean([ruler.beside(z) ** 2 / (4000 - runs) for z in noise_of]) == pytest.approx(1.0, abs=0.06)


def test_several_runs_and_lost_rows_stand_in_the_files(tmp_path: Path) -> None:
    """Power-ups in one file by their number; rows that the logger lost are in no file."""
    made = draw("null", 3, 77, tmp_path / "case")
    facts, found = made.case.facts, read_recordings(load_manifest(made.case.manifest))
    assert len(found) == 1 and facts["runs"] == 3 and facts["gaps"] == 2
    runs = by_power_up(found)
    assert [len(r.t) for r in runs] == [int(np.sum(made.run == k)) for k in (1, 2, 3)]
    assert len(made.rows) < int(str(facts["rows"]))
    assert np.allclose(runs[1].t - runs[1].t[0], made.rows[made.run == 2] - made.rows[made.run == 2][0], atol=1e-3)


def test_a_case_is_the_same_each_time_it_is_drawn(tmp_path: Path) -> None:
    first, second = (draw("exact", 3, 8, tmp_path / name / "case") for name in ("a", "b"))
    assert np.array_equal(first.noise, second.noise)
    assert (tmp_path / "a/case/manifest.toml").read_text() == (tmp_path / "b/case/manifest.toml").read_text()


@pytest.mark.parametrize("fault", damage.FAULTS, ids=lambda fault: fault.name)
def test_a_damaged_recording_ends_in_one_sentence(
    fault: damage.Fault, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest = damage.write(fault, tmp_path, seed=9)
    before = set(tmp_path.iterdir())
    # Quietly: what is told of the progress after two seconds depends on what else the machine does.
    ended = run(capsys, monkeypatch, "close-loop", "--quiet", manifest, "--json", tmp_path / "out.json")
    left = sorted(path.name for path in set(tmp_path.iterdir()) - before)
    assert damage.shortcomings(fault, ended.status, ended.out, ended.err, left) == []


def found_in(made: Made) -> list[str]:
    target = close(made.case.manifest).targets[0]
    return [a.effect if a.order is None else f"{a.effect}:{a.order}" for a in target.added]


#: Kind, number and strength of cases that are small and beyond doubt; what must be named. Of the first three, one is a
#: run with gaps and rows dropped one by one, the others have two and three runs with gaps in each.
CLEAR = (
    ("null", 7, None, None),
    ("exact", 3, 40.0, "angle_locked_rate:4"),
    ("exact", 10, 40.0, "bias_warm_up"),
)
MORE = (
    ("null", 3, None, None),
    ("null", 9, None, None),
    ("null", 10, None, None),
    ("exact", 2, 40.0, "angle_locked_rate:3"),
    ("exact", 5, 40.0, "bias_step"),
    ("exact", 11, 40.0, "encoder_harmonic:1"),
    ("exact", 24, 40.0, "tone"),
    ("realistic", 6, 40.0, "bias_thermal_lag"),
)


def _asked(cases: tuple[tuple[str, int, float | None, str | None], ...]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("kind", "number", "strength", "wanted"), cases)


@_asked(CLEAR)
def test_a_clear_case_is_named(
    kind: str, number: int, strength: float | None, wanted: str | None, tmp_path: Path
) -> None:
    found = found_in(draw(kind, number, 77, tmp_path / "case", strength))
    assert found[:1] == ([] if wanted is None else [wanted])


@pytest.mark.slow
@_asked(MORE)
def test_more_clear_cases_are_named(
    kind: str, number: int, strength: float | None, wanted: str | None, tmp_path: Path
) -> None:
    found = found_in(draw(kind, number, 77, tmp_path / "case", strength))
    assert found[:1] == ([] if wanted is None else [wanted])


#: The bench without its damaged files, each of which is a fact above.
WITHOUT_FAULTS = """
import runpy, sys
sys.path.insert(0, sys.argv[1])
import studies.blind_bench.run as run
run.damaged = lambda seed: [("spared", [])]
del sys.argv[0]
runpy.run_path(sys.argv[0] + "/blind_bench.py", run_name="__main__")
"""


@pytest.mark.slow
def test_the_bench_prints_its_table_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    scripts = Path(__file__).parents[2] / "scripts"
    few = {"null": 1, "exact": 1, "realistic": 0, "pair": 0, "unknown": 1, "confounded": 0, "triad": 0, "student": 0}
    options = [*(f"--{kind}={n}" for kind, n in few.items()), "--jobs=1", f"--store={tmp_path}"]
    first = subprocess.run(
        [sys.executable, scripts / "blind_bench.py", *options], capture_output=True, text=True, check=True
    )
    assert "null: something added | <= 2 % | 0/1" in first.stdout
    times = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")}
    assert len(times) == 3
    again = [sys.executable, "-c", WITHOUT_FAULTS, str(scripts), *options]
    second = subprocess.run(again, capture_output=True, text=True, check=True)
    assert "null: something added | <= 2 % | 0/1" in second.stdout
    assert times == {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")}
