"""A law of an instrument is the same in every run; a line of one run alone is how the table shook in it.

Generated with NumPy, no effect of insenv; seeds are fixed. A scatter that chance does not make is told at 1 %.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fit_cases import problem_of, terms
from motions import edges
from scipy.signal import lfilter
from simulated_runs import closed, manifest, use

from insenv.core.recording import Channel, Floats, Recording, Response
from insenv.effects.catalogue import by_key
from insenv.effects.tone import Tone
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.fit.scatter import scatter
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.prepare.declared import declared_model
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.artefacts.recurrence import not_both_ways, not_in_all_runs, of_few_means
from insenv.identify.search.round import _swing, search
from insenv.identify.search.scan import reference

DT, N, NOISE = 0.1, 6000, 1e-4
LINE = 0.31


def run(seed: int, cubic: float = 0.0, line: float = 0.0, top: float = 1.5, gain: float = 1.0) -> Recording:
    """A gyro on a table that swings, with a cubic scale factor [1/(rad/s)^2] and a line [rad/s]."""
    rng = np.random.default_rng(seed)
    t: Floats = DT * np.arange(1.0, N + 1)
    rate = top * np.sin(2 * np.pi * t / 40)
    gyro = gain * rate + cubic * rate**3 + line * np.sin(2 * np.pi * LINE * t) + NOISE * rng.standard_normal(N)
    return Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(rate, "rad/s", source="command")})


def said(recordings: tuple[Recording, ...], term: Term) -> str:
    problem = prepare(manifest(), recordings, tuple(use(N) for _ in recordings), "gyro", holds=False)
    return not_in_all_runs(problem.problem, solve(problem.problem, problem.model), term)


@pytest.mark.parametrize(("cubics", "law"), [((1e-4, 1e-4, 1e-4), True), ((3e-4, 0.0, -1e-4), False)])
def test_a_law_is_the_same_in_every_run(cubics: tuple[float, ...], law: bool) -> None:
    recordings = tuple(run(seed, cubic) for seed, cubic in enumerate(cubics))
    assert (not said(recordings, Term(by_key("scale_factor_cubic")))) == law


@pytest.mark.parametrize("law", ["scale_factor", "scale_factor_cubic"])
def test_runs_of_one_steady_rate_each_tell_no_coefficient_of_their_own(law: str) -> None:
    """Beside one bias for all of them the first run's number is nobody's: it went to each coefficient in turn."""
    rng = np.random.default_rng(4)
    t, runs = DT * np.arange(1.0, N + 1), []
    for rate in np.deg2rad([30.0, -30.0, 60.0, -60.0]):
        bend = rate if law == "scale_factor" else rate**3
        gyro = rate + 1e-3 * bend + 0.005 + NOISE * rng.standard_normal(N)
        told = Channel(np.full(N, rate), "rad/s", source="command")
        runs.append(Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_rate": told}))
    asked = manifest(declared=("bias",), bias="common")
    problem = prepare(asked, tuple(runs), tuple(use(N) for _ in runs), "gyro", holds=False).problem
    assert not_in_all_runs(problem, solve(problem, declared_model(asked, tuple(runs), "gyro")), Term(by_key(law))) == ""


@pytest.mark.parametrize(("instant", "law"), [(0.5, False), (0.3, True)])
def test_a_step_where_a_table_turns_round_once_is_its_gain(instant: float, law: bool) -> None:
    """Half a mean beside the reversal it is one of two columns that differ in that mean alone."""
    t: Floats = DT * np.arange(1.0, N + 1)
    rate = np.where(t < 0.5 * t[-1], 0.5, -0.5)
    gyro = rate + NOISE * np.random.default_rng(7).standard_normal(N)
    table = Channel(rate, "rad/s", source="command")
    one = (Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_rate": table}),)
    problem = prepare(manifest(), one, (use(N),), "gyro", holds=False).problem
    model = declared_model(manifest(declared=("bias", "scale_factor")), one, "gyro")
    term = Term(by_key("bias_step"), (instant * t[-1] + 0.4 * problem.bins.width,))
    assert (not of_few_means(problem, solve(problem, model), term)) == law


@pytest.mark.parametrize(("means", "law"), [(2.0, False), (60.0, True)])
def test_a_warm_up_of_a_few_means_beside_a_reference_is_how_it_was_set_in_motion(means: float, law: bool) -> None:
    one = (run(4),)
    problem = prepare(manifest(), one, (use(N),), "gyro", holds=False).problem
    term = Term(by_key("bias_warm_up"), (means * problem.bins.width,))
    assert (not of_few_means(problem, solve(problem, declared_model(manifest(), one, "gyro")), term)) == law


def test_one_run_says_nothing_of_others() -> None:
    assert said((run(1, 3e-4),), Term(by_key("scale_factor_cubic"))) == ""


@pytest.mark.parametrize(("lines", "law"), [((3e-5, 3e-5, 3e-5), True), ((1e-4, 0.0, 0.0), False)])
def test_a_line_of_one_run_alone_is_none_of_the_instrument(lines: tuple[float, ...], law: bool) -> None:
    recordings = tuple(run(seed, line=line) for seed, line in enumerate(lines))
    assert (not said(recordings, Term(Tone(), (LINE,), per_run=True))) == law


@pytest.mark.parametrize(("cubic", "gains"), [(1e-3, (1.0, 1.0)), (0.0, (1.0, 0.999))])
def test_beside_a_late_reference_a_gain_in_each_run_is_no_curve(cubic: float, gains: tuple[float, float]) -> None:
    """Runs of other amplitudes and gains, as a filter makes them at other frequencies, look like a cubic together."""
    runs = [run(k, cubic, top=top, gain=gain) for k, (top, gain) in enumerate(zip((0.6, 1.5), gains, strict=True))]
    late = tuple(replace(one, responses={"gyro": Response(lag=0.01)}) for one in runs)
    assert (not said(late, Term(by_key("scale_factor_cubic")))) == (cubic > 0)


@pytest.mark.parametrize("late", [True, False])
@pytest.mark.parametrize(("share", "law"), [(1.0, True), (0.8, True), (0.0, False)])
def test_a_law_of_the_rate_does_not_know_which_way_it_changes(share: float, law: bool, late: bool) -> None:
    """An error like a cubic while the table slows down, ``share`` of it while it speeds up: a motor swings so."""
    one = run(9)
    rate, gyro = (one.channels[name] for name in ("table_rate", "gyro"))
    faster = np.gradient(np.abs(rate.values)) > 0
    bent = gyro.values + 1e-3 * rate.values**3 * np.where(faster, share, 1.0)
    one = replace(one, channels={**one.channels, "gyro": replace(gyro, values=bent)})
    if late:
        one = replace(one, responses={"gyro": Response(lag=0.01)})
    problem = prepare(manifest(), (one,), (use(N),), "gyro", holds=False).problem
    fit = solve(problem, declared_model(manifest(), (one,), "gyro"))
    base = reference(problem, fit.model, fit.noise.power)
    why = not_both_ways(problem, fit, base, Term(by_key("scale_factor_cubic")))
    assert (not why) == (law or not late)


@pytest.mark.parametrize(("multiple", "remarked"), [(1, True), (3, True), (4.5, False)])
def test_a_line_at_a_multiple_of_a_swing_is_of_the_motion(multiple: float, remarked: bool) -> None:
    t: Floats = DT * np.arange(1.0, N + 1)
    one = run(5)
    gyro = one.channels["gyro"].values + 1e-3 * np.sin(2 * np.pi * multiple / 40 * t + 0.7)
    one = replace(one, channels={**one.channels, "gyro": replace(one.channels["gyro"], values=gyro)})
    problem = prepare(manifest(), (one,), (use(N),), "gyro", holds=False, tones=False)
    (hit,) = search(problem.problem, solve(problem.problem, problem.model), (), 0, 1, tones=True)
    assert ("repeats" in hit.remark) == remarked


@pytest.mark.parametrize("length", [24, 60, 77, 100])
def test_a_rate_that_stands_still_but_for_rounding_swings_nowhere(length: int) -> None:
    """The mean of equal numbers is off by rounding: what is left is even, and at no frequency."""
    for rate in (0.1, 1 / 3, 0.7, 1.1):
        assert _swing(np.full(length, rate), 1.0) is None


@pytest.mark.parametrize("scatter", [0.0, 1e-3])
def test_the_deviation_of_a_gain_knows_how_runs_differ(scatter: float) -> None:
    """Eight runs whose gains scatter tell their mean to scatter / sqrt(8), not to what their rows would."""
    gains = 1 + scatter * np.random.default_rng(8).standard_normal(8)
    runs = tuple(run(10 + k, gain=float(gain)) for k, gain in enumerate(gains))
    problem = prepare(manifest(), runs, tuple(use(N) for _ in runs), "gyro", holds=False, tones=False).problem
    told = estimates(problem, solve(problem, declared_model(manifest(), runs, "gyro")))
    (scale,) = (row for rows in told.values() for row in rows if row.effect == "scale_factor")
    assert abs(scale.value) < 4 * scale.sd + 1e-4  # rows are read at instants, and the table bends between them
    if scatter:
        assert scale.sd == pytest.approx(float(np.std(gains)) / np.sqrt(7), rel=0.6)
    else:
        assert scale.sd < 1e-5


def test_the_mean_of_runs_that_agree_is_the_weighted_one() -> None:
    values, deviations = np.array([1.0, 1.1, 0.9]), np.array([0.1, 0.2, 0.2])
    found = scatter(values, deviations)
    p, z = found.chance, found.deviate
    w = 1 / deviations**2
    assert p > 0.5
    assert z == pytest.approx(float(values @ w / np.sqrt(w.sum())))


def test_runs_that_scatter_are_worth_their_scatter() -> None:
    """With deviations that are nothing beside the scatter, z is the mean over its standard error."""
    values = np.array([3.0, -1.0, 2.0, 0.5])
    found = scatter(values, np.full(4, 1e-6))
    p, z = found.chance, found.deviate
    assert p < 1e-6
    assert z == pytest.approx(float(values.mean() / (values.std(ddof=1) / 2)), rel=1e-6)


def test_of_which_one_tells_all_there_is_no_scatter() -> None:
    """A deviation that is nothing beside the other's: the mean is that one's, by its own deviation."""
    found = scatter(np.array([1.0, 5.0]), np.array([1e-9, 1e9]))
    p, z = found.chance, found.deviate
    assert p == pytest.approx(1.0, abs=1e-6)
    assert z == pytest.approx(1e9, rel=1e-6)


def drive(seed: int, stops: int) -> Recording:
    """A car in turns both ways beside its estimated heading, which wanders while it stands: `stops` times."""
    rng = np.random.default_rng(seed)
    n = 600 * stops
    t = 0.5 * np.arange(1.0, n + 1)
    phase = np.arange(n) % 600
    moves = phase >= 150
    rate = np.where(moves, 0.3 * np.sin(2 * np.pi * (phase - 150) / 150), 0.0)
    wander = lfilter([1.0], [1.0, -0.8], rng.standard_normal(n))
    read = rate + np.where(moves, 0.0, 6e-4 * wander / wander.std())
    gyro = rate + 1e-4 * rng.standard_normal(n)
    channels = {
        "gyro": Channel(gyro, "rad/s", "interval"),
        "table_rate": Channel(read, "rad/s", "interval", source="encoder"),
    }
    return Recording(t, channels)


def test_what_a_heading_wanders_in_one_stop_is_no_law() -> None:
    """Four drives; lines and noise may be named by chance, a curve of the rate not once."""
    for seed in range(4):
        (found,) = closed(drive(seed, stops=1), manifest(declared=("bias", "scale_factor"))).targets
        assert not {a.effect for a in found.added} & {"lock_in", "dead_band", "scale_factor_anomaly"}


def said_of_a_cubic(rates: Floats, way: int) -> str:
    """What is said of a cubic beside bias and scale factor, ``way`` rows from rate to rate."""
    rate = np.convolve(np.repeat(rates, 2700 // len(rates)), np.ones(way) / way, "same")[way:-way]
    t = edges(len(rate), 0.05)[1:]
    y = rate + 3e-4 * np.random.default_rng(1).standard_normal(len(rate))
    channels = {"gyro": Channel(y, "rad/s", "interval"), "table_rate": Channel(rate, "rad/s", "interval")}
    problem, _ = problem_of(Recording(t, channels))
    fit = solve(problem, terms("bias", "scale_factor"))
    return of_few_means(problem, fit, Term(by_key("scale_factor_cubic")))


def test_a_law_that_one_quick_change_of_the_rate_tells_is_none() -> None:
    """A cubic of 23 % and a gain of 1.6 were told by 0.7 s in which a filter was behind."""
    assert "the rate changes once" in said_of_a_cubic(np.array([3.4, 1.4]), 14)


def test_at_three_rates_or_in_a_slow_ramp_it_may_be_one() -> None:
    assert said_of_a_cubic(np.tile([3.4, 1.4, -2.0], 3), 14) == ""
    assert said_of_a_cubic(np.array([3.4, 1.4]), 1200) == ""
