"""`insenv evaluate`: the numbers, what is paired, bounds, plug-ins that fail, and what is written."""

from __future__ import annotations

import json
import pickle
import struct
import threading
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run

from estimators.north_finder.revolution import Revolution
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Recording
from insenv.core.units import ARCSEC
from insenv.envs.rollout import roll_out
from insenv.evaluate import play as runs_played
from insenv.evaluate import words
from insenv.evaluate.board import HEADER, board
from insenv.evaluate.bounds import bounds
from insenv.evaluate.check.child import SIMULATOR
from insenv.evaluate.child import Child, Ended
from insenv.evaluate.evaluation import Evaluation, _blamed, evaluate
from insenv.evaluate.host import Reply, Request
from insenv.evaluate.page import to_html
from insenv.evaluate.play import PlayedRuns, Work, play, play_on
from insenv.evaluate.remote import Apart, InProcess
from insenv.evaluate.runs import episodes, task_of
from insenv.evaluate.scores import Paired, Scored, nees, paired, score

SHORT: dict[str, Any] = {"duration": "60 s", "task.step": "5 s"}


def table(errors: np.ndarray, sd: float, name: str = "x") -> dict[str, np.ndarray]:
    """Runs with these errors, of which the estimator tells ``sd``."""
    variance = np.full(len(errors), sd**2)
    return {"seed": np.arange(len(errors)), f"error.{name}": errors, f"cov.{name}.{name}": variance}


def test_the_numbers_are_those_of_the_errors() -> None:
    errors = 2.0 + 3.0 * np.random.default_rng(1).standard_normal(100_000)
    found = score(table(errors, 3.0), "x", "rad", bound=2.4)
    assert found.bias[0] == pytest.approx(errors.mean()) and found.bias[1] == pytest.approx(1.96 * 3 / 316, rel=0.02)
    assert found.deviation[0] == pytest.approx(errors.std(ddof=1))
    # Of a Gaussian the interval of a deviation is z s / sqrt(2 n).
    assert found.deviation[1] == pytest.approx(1.96 * 3 / np.sqrt(2e5), rel=0.02)
    assert found.rms[0] == pytest.approx(np.sqrt(13), rel=0.01) and found.told == pytest.approx(3.0)
    assert found.spread[0] == pytest.approx(np.sqrt(13) / 3, rel=0.01)
    assert found.efficiency is not None and found.efficiency[0] == pytest.approx(0.64, rel=0.02)
    assert nees(table(errors, 3.0), ["x"])[0] == pytest.approx(13 / 9, rel=0.02)


def test_errors_beyond_the_bound_are_told_and_those_at_the_bound_are_not() -> None:
    rng, bound = np.random.default_rng(5), 1e-4
    # At the bound: a false alarm of 1e-6 in each of 200 sets.
    for n in [2, 16, 64, 400] * 50:
        assert not score(table(bound * rng.standard_normal(n), bound), "x", "rad", bound).beyond
    for n, share in ((16, 0.2), (64, 0.5), (400, 0.8)):
        assert score(table(share * bound * rng.standard_normal(n), bound), "x", "rad", bound).beyond
    assert score(table(np.zeros(16), bound), "x", "rad", bound).beyond
    assert not score(table(np.zeros(16), bound), "x", "rad", None).beyond


def test_nees_takes_correlation_into_account() -> None:
    cov = np.array([[4.0, 1.5], [1.5, 1.0]])
    errors = np.random.default_rng(2).multivariate_normal([0, 0], cov, 20_000)
    runs = {"error.a": errors[:, 0], "error.b": errors[:, 1]}
    runs |= {f"cov.{n}": np.full(20_000, v) for n, v in (("a.a", 4.0), ("a.b", 1.5), ("b.b", 1.0))}
    value, half = nees(runs, ["a", "b"])
    assert abs(value - 1.0) < 3 * half  # false alarm 4e-9: half is two standard deviations


def test_pairing_takes_out_what_both_have() -> None:
    common = np.random.default_rng(3).standard_normal(400)
    found = paired("x", ("a", "p"), table(1.1 * common + 0.01, 1.0), ("b", "p"), table(common, 1.0))
    assert found.bias[0] == pytest.approx(0.01 + 0.1 * common.mean())
    assert found.rms[0] == pytest.approx(0.1, abs=0.02)
    assert found.rms[1] < 0.15 * score(table(common, 1.0), "x", "1", None).rms[1]


def test_a_part_plays_the_runs_of_its_seeds() -> None:
    work = Work("north_finder/published", ("revolution",), "constant_rate", 3, 4, json.dumps(SHORT), bound=True)
    played = play(work, lambda doing, share: None)["revolution"]
    assert isinstance(played, PlayedRuns)
    wanted = episodes("north_finder/published", "revolution", "constant_rate", range(3, 7), SHORT)
    assert played.table.keys() == wanted.keys()
    for name, values in wanted.items():
        np.testing.assert_array_equal(played.table[name], values)
    assert played.units["azimuth"] == "rad" and 0 < played.cpu_estimator < played.cpu
    assert played.bounds["azimuth"] > 0


class Rushed:
    """A policy that turns at a rate of its own for each estimator: it looks at what is believed."""

    def __init__(self, datasheet: Datasheet) -> None:
        self.looks = 0

    def reset(self, batch: int | None = None) -> Any:
        return np.zeros(batch or 1)

    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> Any:
        rate = 0.2 if estimate is not None and estimate.sd[0, 0] > 1e-3 else 0.1
        return np.stack([np.full_like(state, rate), np.zeros_like(state)], axis=-1), state


class Spoils:
    """A sound estimator, but for what it leaves of the data."""

    def __init__(self, datasheet: Datasheet) -> None:
        own = Revolution(datasheet)
        self.inner, self.reset, self.estimate = own, own.reset, own.estimate

    def update(self, state: Any, chunk: Recording) -> Any:
        found = self.inner.update(state, chunk)
        chunk.channels["gyro"].values[:] = 1e3
        return found


def together(monkeypatch: pytest.MonkeyPatch, policy: str, *names: str) -> tuple[dict[str, Any], int]:
    """What four short runs give, and how often the runs were simulated."""
    rolled = []

    def counted(*given: Any, **how: Any) -> Any:
        rolled.append(how)
        return roll_out(*given, **how)

    monkeypatch.setattr(runs_played, "roll_out", counted)
    found = play(Work("north_finder/published", names, policy, 3, 4, json.dumps(SHORT)), lambda doing, share: None)
    return found, sum("progress" in how for how in rolled)


@pytest.mark.parametrize(("policy", "simulated"), [("constant_rate", 1), ("test_evaluate:Rushed", 2)])
def test_estimators_together_say_what_each_says_alone(
    policy: str, simulated: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs are shared only where the policy looks at no estimate."""
    found, times = together(monkeypatch, policy, "correlation", "north_gls")
    # Where it is told of the first look the runs of both were begun and given up.
    assert times == simulated + (simulated > 1)
    for name, played in found.items():
        alone = episodes("north_finder/published", name, policy, range(3, 7), SHORT)
        assert played.table.keys() == alone.keys()
        for column, values in alone.items():
            np.testing.assert_array_equal(played.table[column], values)


def test_what_one_does_to_the_data_the_others_do_not_see(monkeypatch: pytest.MonkeyPatch) -> None:
    found, times = together(monkeypatch, "constant_rate", "test_evaluate:Spoils", "revolution")
    first, second = (found[name].table["error.azimuth"] for name in found)
    assert times == 1
    np.testing.assert_array_equal(first, second)


def test_who_is_to_blame_for_a_lost_process() -> None:
    for doing, blamed, again in (
        ("step 2 of policy 'p', estimator 'b'", {"b"}, [("a", "c")]),
        ("step 2 of policy 'p'", {"a", "b", "c"}, []),
        ("its import", set(), [("a",), ("b",), ("c",)]),
    ):
        faults, rest = _blamed(Ended(fault=f"hangs in {doing}", doing=doing), ("a", "b", "c"), "p")
        assert set(faults) == blamed and rest == again


def test_the_bound_of_north_is_that_of_the_design_page() -> None:
    """The published instrument for 300 s at 10 deg/s: 30 arcsec within some percent, whoever turns the table."""
    task = task_of("north_finder/published")
    least = bounds(task.datasheet, roll_out(task, "constant_rate", None, [0]).recording(0), ("azimuth",))
    assert 27 * ARCSEC < least["azimuth"] < 34 * ARCSEC


@pytest.mark.parametrize("name", ["realistic", "undeclared"])
def test_there_is_a_bound_of_north_whatever_is_declared(name: str) -> None:
    task = task_of(f"north_finder/{name}", SHORT)
    least = bounds(task.datasheet, roll_out(task, "bidirectional", None, [0]).recording(0), ("azimuth",))
    assert 60 * ARCSEC < least["azimuth"] < 90 * ARCSEC  # in 60 s


def test_the_bound_of_the_installation_angle_knows_the_sight() -> None:
    task = task_of("two_position/published_a2")
    assert task.datasheet.sight is not None
    run_ = roll_out(task, "published_schedule", None, [0]).recording(0)
    least = bounds(task.datasheet, run_, ("installation_angle",))["installation_angle"]
    assert least > task.datasheet.sight.orientation
    assert least < 60 * ARCSEC


def test_there_is_no_bound_without_a_model() -> None:
    task = task_of("rate_table/kvh13", {"duration": "100 s"})
    assert bounds(task.datasheet, roll_out(task, "van_der_corput", None, [0]).recording(0), ("scale_factor",)) == {}


# ------------------------------------------------------------------------------------------------ several processes


PLUGINS = """
import gc
import sys
import time
import numpy as np
from insenv.core.estimate import Estimate

class Sound:
    def __init__(self, datasheet):
        self.passed = 0
    def update(self, block):
        self.passed += len(block.t)
    def estimate(self):
        return Estimate(("azimuth",), ("rad",), np.zeros(1), np.eye(1) * 3.3)

class Raises(Sound):
    def update(self, block):
        raise RuntimeError("out of order")

class Hangs(Sound):
    def update(self, block):
        while True:
            time.sleep(0.1)

class SaysNaN(Sound):
    def estimate(self):
        mean = np.full(1, np.nan if self.passed else 0.0)
        return Estimate(("azimuth",), ("rad",), mean, np.eye(1))

class Cheats(Sound):
    # Looks for the truth in all frames and all objects of its process.

    def update(self, block):
        super().update(block)
        self.truth = None
        frame = sys._getframe()
        while frame is not None:
            for value in list(frame.f_locals.values()):
                self.look(value)
            frame = frame.f_back
        for value in gc.get_objects():
            self.look(value)

    def look(self, value):
        if type(value).__name__ in ("Group", "Rig", "Scenario", "Turntable"):
            value = getattr(value, "truth", None) or {"azimuth": getattr(value, "azimuth", None)}
        if type(value) is dict and value.get("azimuth") is not None:
            found = np.ravel(value["azimuth"])
            if self.truth is None and found.dtype.kind == "f":
                self.truth = float(found[0])

    def estimate(self):
        mean = np.full(1, 0.0 if self.truth is None else self.truth)
        return Estimate(("azimuth",), ("rad",), mean, np.eye(1) * 1e-20)

    truth = None
"""


@pytest.fixture
def plugins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A module of plug-ins that other processes can import."""
    (tmp_path / "evaluated_plugins.py").write_text(PLUGINS)
    monkeypatch.syspath_prepend(str(tmp_path))


@pytest.mark.usefixtures("plugins")
def test_a_cheat_finds_the_truth_in_the_simulators_process_alone() -> None:
    """Where it does, its score is called beyond the bound; where plug-ins are played it finds nothing."""
    short = {"duration": "6 s", "task.step": "3 s"}
    for limit in (None, 60.0):
        names = ["evaluated_plugins:Cheats"], ["constant_rate"]
        cheat = evaluate("NorthFinder", *names, range(2), limit=limit, changes=short)
        (errors,) = (each["azimuth"] for each in cheat.errors.values())
        # Run 0 is told its own truth; run 1, which this cheat confuses with run 0, is not.
        assert (errors[0] == 0.0) == (limit is None)


def test_no_truth_goes_over_to_the_plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    """All that is sent while runs are played, byte by byte; and the answers are those of this process."""
    sent: list[bytes] = []
    ask = Apart.ask

    def noted(self: Apart, request: Request, chunk: Recording | None = None) -> Reply:
        sent.append(pickle.dumps((request, None if chunk is None else replace(chunk, label=""))))
        return ask(self, request, chunk)

    monkeypatch.setattr(Apart, "ask", noted)
    work = Work("north_finder/published", ("revolution", "north_gls"), "greedy_north", 0, 3, json.dumps(SHORT))
    with closing(Apart()) as stage:
        apart = play_on(stage, work, lambda doing, share: None)
    here = play_on(InProcess(), work, lambda doing, share: None)
    for name, found in apart.items():
        own = here[name]
        assert isinstance(found, PlayedRuns) and isinstance(own, PlayedRuns)
        for column, values in found.table.items():
            np.testing.assert_array_equal(values, own.table[column])
    task = task_of("north_finder/published", SHORT)
    truth = task.world.truth(task.world.cast(range(3)), 3)
    everything = b"".join(sent)
    assert not [value for value in truth["azimuth"] if struct.pack("<d", value) in everything]
    assert not [m for m in (*SIMULATOR, "published") if m.encode() in everything]


@pytest.mark.slow
@pytest.mark.usefixtures("plugins")
def test_what_fails_is_named_and_the_rest_goes_on() -> None:
    names = [f"evaluated_plugins:{name}" for name in ("Sound", "Raises", "Hangs", "SaysNaN")]
    found = evaluate(
        "NorthFinder", [*names, "levelling"], ["constant_rate"], range(4), jobs=2, limit=8.0, changes=SHORT
    )
    by_name = {one.estimator: one for one in found.scored}
    assert by_name[names[0]].scores[0].quantity == "azimuth" and not by_name[names[0]].fault
    assert by_name[names[1]].fault == f"estimator {names[1]!r} failed in update: RuntimeError: out of order"
    assert "does not return within 8 s" in by_name[names[2]].fault and repr(names[2]) in by_name[names[2]].fault
    assert repr(names[3]) in by_name[names[3]].fault and "nan" in by_name[names[3]].fault
    assert "asks for azimuth" in by_name["levelling"].fault
    assert all(fault in words.summary(found) for fault in found.faults) and len(found.faults) == 4


@pytest.mark.slow
def test_the_result_does_not_depend_on_how_the_work_is_shared_out() -> None:
    """In this process in one piece, and in two processes in two."""
    asked = ("NorthFinder", ["revolution"], ["constant_rate"], range(130))
    one, two = evaluate(*asked, limit=None, changes=SHORT), evaluate(*asked, jobs=2, changes=SHORT)
    for pair, errors in one.errors.items():
        np.testing.assert_array_equal(errors["azimuth"], two.errors[pair]["azimuth"])
    assert threading.active_count() < 20


def test_nothing_is_left_of_a_child_that_is_ended() -> None:
    work = Work("north_finder/published", ("revolution",), "constant_rate", 0, 2)
    child = Child("insenv.evaluate.play:play", work, 60.0)

    def interrupt(_: Child) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        child.wait(interrupt)
    assert child._process.returncode is not None and not child._result.exists()


# -------------------------------------------------------------------------------------------------- what is written


def made() -> Evaluation:
    """An evaluation without runs behind it: two pairs, and one that failed."""
    rng = np.random.default_rng(4)
    tables = {
        (name, "p"): table(s * rng.standard_normal(50), 1e-4, "azimuth") for name, s in (("a", 1e-4), ("b", 3e-4))
    }
    scored = tuple(
        Scored(e, p, 50, (score(t, "azimuth", "rad", 9e-5),), nees(t, ["azimuth"]), 300.0, 0.0, 0.01, 0.004)
        for (e, p), t in tables.items()
    )
    (first, base), (other, more) = tables.items()
    difference: tuple[Paired, ...] = (paired("azimuth", other, more, first, base),)
    failed = Scored("<c>", "p", fault="estimator '<c>' failed in update: ValueError: no")
    errors = {pair: {"azimuth": t["error.azimuth"]} for pair, t in tables.items()}
    return Evaluation("NorthFinder", "north_finder/published", 0, 50, 1, (*scored, failed), difference, errors)


def test_the_json_has_si_units_and_intervals() -> None:
    found = json.loads(json.dumps(words.to_json(made()), allow_nan=False))
    assert found["schema"] == "insenv.evaluate/1" and found["seeds"] == [0, 49]
    first, second, failed = found["pairs"]
    azimuth = first["quantities"][0]
    low, high = azimuth["rms"]["interval"]
    assert azimuth["unit"] == "rad" and low < azimuth["rms"]["value"] < high < 2e-4
    assert failed == {"estimator": "<c>", "policy": "p", "fault": "estimator '<c>' failed in update: ValueError: no"}
    assert second["fault"] is None and found["paired"][0]["rms"]["interval"][0] > 0


def test_a_pair_beyond_the_bound_is_named_everywhere() -> None:
    found = made()
    known = score(table(np.full(50, 1e-9), 1e-4, "azimuth"), "azimuth", "rad", 9e-5)
    told = replace(found, scored=(replace(found.scored[0], scores=(known,)), *found.scored[1:]))
    sentence = "Beyond the bound: a under p, azimuth: rms 0.000206 against 18.56 arcsec."
    assert sentence in words.summary(told) and sentence in to_html(told) and "beyond the bound" in words.summary(told)
    assert "eyond the bound" not in words.summary(found) + to_html(found)
    written = words.to_json(told)
    flags = [q["beyond_bound"] for pair in written["pairs"][:2] for q in pair["quantities"]]
    assert flags == [True, False] and written["beyond_bound_false_alarm"] == 1e-6


def test_the_text_has_a_row_for_each_pair() -> None:
    text = words.summary(made())
    assert "azimuth [arcsec]" in text and "difference from p with a" in text
    assert "Cramer-Rao bound of the deviation: p 18.56" in text
    assert "- estimator '<c>' failed" in text


def test_the_page_escapes_names_and_loads_nothing() -> None:
    page = to_html(made())
    assert "<c>" not in page and "&lt;c&gt;" in page
    assert page.count("<svg") == 1 + 2 and "http" not in page.replace("http-equiv", "")


def test_the_leaderboard_has_the_least_error_first_and_its_pictures_in_order() -> None:
    found = made()
    again = replace(found, scored=found.scored[::-1])
    rows = board(found, "azimuth")
    assert rows == board(again, "azimuth") and len(rows) == 2
    errors = [dict(zip(HEADER, row.cells, strict=True))["rms"][1] for row in rows]
    assert errors == sorted(errors)
    for row in rows:
        picture = row.picture
        assert 0 < picture.low <= picture.middle <= picture.high < 140 and 0 < picture.claimed < 140
    assert rows[0].picture.middle < rows[1].picture.middle


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"--env": "Sea"}, "environment 'Sea' given; there are NorthFinder, RateTable, SystemCalibration, TwoPosition"),
        ({"--estimator": "north_glls"}, "estimator 'north_glls' is not installed; did you mean 'north_gls'?"),
        ({"--policy": "constant"}, "policy 'constant"),
        ({"--estimator": "north_gls,"}, "--estimator 'north_gls,' given; wanted names"),
        ({"--estimator": "north_gls,north_gls"}, "each once"),
        ({"--scenario": "rate_table/kvh13"}, "a scenario of RateTable; wanted one of NorthFinder"),
        ({"--scenario": "north_finder/scale_factor_test"}, "asks for nothing"),
        ({"--scenario": "nowhere.toml"}, "nowhere.toml"),
        ({"--seeds": "1"}, "wanted two seeds or more"),
        ({"--jobs": "0"}, "one job or more"),
        ({"--json": "nowhere/a.json"}, "'nowhere' does not exist"),
    ],
)
def test_bad_input_ends_in_one_sentence(
    options: dict[str, str], sentence: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    given = {"--env": "NorthFinder", "--estimator": "north_gls", "--policy": "constant_rate", **options}
    ended = run(capsys, monkeypatch, "evaluate", *(part for pair in given.items() for part in pair))
    assert ended.status == 2 and sentence in ended.err and ended.err.count("\n") == 1, ended.err


@pytest.mark.slow
def test_a_pairing_that_cannot_work_ends_in_one_sentence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("--env", "NorthFinder", "--estimator", "two_position", "--policy", "constant_rate", "--seeds", "4")
    ended = run(capsys, monkeypatch, "evaluate", *options)
    assert ended.status == 2 and ended.out == ""
    assert "estimator 'two_position' tells installation_angle" in ended.err
