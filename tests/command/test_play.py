"""An environment in the browser: what its server allows, what it tells, and what a saved run is good for."""

from __future__ import annotations

import json
import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from command import run

from insenv.close import close
from insenv.core.plugins import POLICIES, names
from insenv.core.system import systems
from insenv.core.units import ARCSEC
from insenv.play.page import page
from insenv.play.scene import plain
from insenv.play.server import ADDRESS, Server
from insenv.play.session import Session, game

Frame = dict[str, Any]


@contextmanager
def served(session: Session) -> Iterator[Server]:
    """A server of the session, which ends with the block."""
    with Server() as server:
        thread = threading.Thread(target=server.play, args=(session, page("north")))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def asked(server: Server, what: str, value: Any, **headers: str) -> int:
    """Status of a request to do something."""
    connection = HTTPConnection(ADDRESS, server.port, timeout=10)
    connection.request("POST", "/", json.dumps({"what": what, "value": value}), {"X-Token": server.token, **headers})
    return connection.getresponse().status


def got(server: Server, path: str, **headers: str) -> int:
    """Status of a page."""
    connection = HTTPConnection(ADDRESS, server.port, timeout=10)
    connection.request("GET", path, headers=headers)
    return connection.getresponse().status


def events(server: Server) -> Iterator[dict[str, Any]]:
    """What the server tells, as it happens."""
    with urlopen(f"http://{ADDRESS}:{server.port}/events?token={server.token}", timeout=20) as stream:
        for line in stream:
            if line.startswith(b"data: "):
                yield from json.loads(line[6:])


def until(stream: Iterator[dict[str, Any]], kind: str, enough: Callable[[Any], bool]) -> Any:
    """The first event of a kind that is enough."""
    return next(event[kind] for event in stream if kind in event and enough(event[kind]))


@pytest.fixture
def north(tmp_path: Path) -> Session:
    return Session(game("NorthFinder", None, None), seed=1, out=tmp_path)


def test_a_person_finds_north_and_the_saved_run_closes_the_loop(north: Session) -> None:
    with served(north) as server:
        stream = events(server)
        first = until(stream, "frame", bool)
        assert first["angle"] == 0 and first["t"] == 0
        assert asked(server, "speed", 200) == asked(server, "control", [0, np.radians(10)]) == 204
        turned = until(stream, "frame", lambda frame: frame["t"] >= 5)
        assert turned["angle"] > 0.1 and turned["values"] == pytest.approx([np.radians(10)])
        last = until(stream, "frame", lambda frame: frame["over"])
        assert last["t"] == 300 and last["sd"][0] < 100 * ARCSEC
        error = (last["mean"][0] - last["true"][0] + np.pi) % (2 * np.pi) - np.pi
        assert abs(error) < 6 * last["sd"][0]  # false alarm 2e-9
        assert last["bound"][0] == pytest.approx(last["sd"][0], rel=0.2)
        asked(server, "save", False)
        manifest = Path(until(stream, "saved", bool)["path"])
    assert north.saved == (manifest,)
    found = close(str(manifest), ["scale_factor_warm_up"])  # one of the catalogue: this is about the files
    assert found.rows == 30_000 and len(found.targets) == 1


def test_a_run_in_the_middle_is_seen_whole_by_who_comes_late(north: Session) -> None:
    with served(north) as server:
        early = events(server)
        asked(server, "speed", 200)
        until(early, "frame", lambda frame: frame["t"] >= 20)
        times, late = [], events(server)
        for event in late:
            times += [event["frame"]["t"]] if "frame" in event else []
            if len(times) > 20:
                break
        assert times == list(range(len(times)))


def test_a_foreign_host_or_a_missing_token_is_forbidden(north: Session) -> None:
    with served(north) as server:
        token = f"?token={server.token}"
        assert got(server, f"/{token}") == 200
        for path in ("/", "/?token=", "/?token=guess", "/events", "/report?run=0", "/nothing"):
            assert got(server, path) == 403
        for host in ("evil.example", f"evil.example:{server.port}", "127.0.0.1", f"127.0.0.1:{server.port + 1}"):
            assert got(server, f"/{token}", Host=host) == 403
            assert asked(server, "pause", True, Host=host) == 403
        assert got(server, f"/{token}", Host=f"localhost:{server.port}") == 200
        for wrong in ({"X-Token": ""}, {"X-Token": "guess"}):
            assert asked(server, "pause", True, **wrong) == 403
        assert got(server, f"/nothing{token}") == got(server, f"/report{token}&run=../x") == 404
        assert asked(server, "x" * 5000, True) == 413
        connection = HTTPConnection(ADDRESS, server.port, timeout=10)
        connection.request("POST", "/", "{", {"X-Token": server.token})
        assert connection.getresponse().status == 400


def _until(tab: Any, true: str, seconds: float = 20.0) -> None:
    """Wait for a script to be true; the page's policy forbids the scripts by which Playwright itself would wait."""
    end = time.monotonic() + seconds
    while not tab.evaluate(f"Boolean({true})"):
        assert time.monotonic() < end, f"not true within {seconds:g} s: {true}"
        tab.wait_for_timeout(50)


#: Pairs of labels of a chart that touch, and those that leave it, of curves between each two values.
CROWDED = """ranges => ranges.flatMap(([low, high, log]) => {
  const svg = document.getElementById("commands");
  chart(svg, [{points: [[0, low], [run.duration, high]], kind: "claimed"}], "turned by hand [deg]", log);
  const texts = [...svg.querySelectorAll("text")], whole = svg.getBoundingClientRect();
  const boxes = texts.map(one => one.getBoundingClientRect());
  const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top + 2 || b.bottom <= a.top + 2;
  return texts.flatMap((one, k) => [
    ...(boxes[k].left < whole.left - 1 || boxes[k].right > whole.right + 1 ? [one.textContent] : []),
    ...texts.filter((_, j) => j > k && !apart(boxes[k], boxes[j])).map(two => [one, two].map(t => t.textContent)),
  ]);
})"""
RANGES = [
    [-1.12e6, 0.0, False],
    [-561_000.0, 1_200.0, False],
    [0.0, 3e-5, False],
    [-40.0, 40.0, False],
    [7.0, 7.0, False],
    [0.4, 9e5, True],
    [2e-5, 4e-3, True],
    [30.0, 50.0, True],
]


def test_an_arrow_turns_the_table_in_a_browser(north: Session) -> None:
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright here: pip install insenv[browser]")
    axe = pytest.importorskip(
        "axe_playwright_python.sync_playwright", reason="no axe here: pip install insenv[browser]"
    )
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        pytest.skip("no Chromium here (Debian: apt install chromium)")
    with served(north) as server, sync_api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": 390, "height": 800})
        said: list[str] = []
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.goto(f"http://{ADDRESS}:{server.port}/?token={server.token}")
        _until(tab, "insenvPlay.run && insenvPlay.frames.length > 0")
        still = tab.evaluate("insenvPlay.frames.at(-1).angle")
        for _ in range(5):
            tab.keyboard.press("Shift+ArrowRight")
        _until(tab, "insenvPlay.frames.at(-1).values[0] > 0 && insenvPlay.frames.at(-1).angle > 0.01")
        assert still == 0 and said == []
        assert tab.evaluate("document.documentElement.scrollWidth") <= 390
        assert tab.evaluate(CROWDED, RANGES) == []
        found = axe.Axe().run(tab)
        assert found.violations_count == 0, found.generate_report()
        browser.close()


@pytest.mark.parametrize(
    ("what", "value"),
    [("fly", 1), ("control", [7, 0.1]), ("control", "fast"), ("seed", -1), ("seed", "x"), ("drive", "no_such_policy")],
)
def test_what_cannot_be_done_is_said_and_the_run_goes_on(north: Session, what: str, value: Any) -> None:
    with served(north) as server:
        stream = events(server)
        asked(server, what, value)
        assert until(stream, "note", bool)
        assert until(stream, "frame", lambda frame: frame["t"] >= 2)


def test_the_last_tab_ends_it(north: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("insenv.play.server._GONE", 0.1)
    with Server() as server:
        thread = threading.Thread(target=server.play, args=(north, ""))
        thread.start()
        stream = events(server)
        until(stream, "frame", bool)
        assert thread.is_alive()
        stream.close()  # type: ignore[attr-defined]
        thread.join(8)
        assert not thread.is_alive()


@pytest.mark.parametrize("name", list(systems()))
def test_a_policy_drives_every_system(name: str, tmp_path: Path) -> None:
    trial = systems()[name].trial
    played = game(name, None, trial.estimator)
    session = Session(played, seed=2, policy=played.policies[0], out=tmp_path)
    for _ in range(3):
        session._step()
    frames = [event["frame"] for event in session._events if "frame" in event]
    assert [frame["t"] for frame in frames] == [k * played.task.step_s for k in range(4)]
    assert frames[-1]["policy"] == played.policies[0]
    assert not [event for event in session._events if event.get("bad")]
    json.dumps(session._events, allow_nan=False)
    assert set(played.policies) <= set(names(POLICIES))


@pytest.mark.parametrize("name", list(systems()))
def test_a_scene_names_what_the_system_has(name: str) -> None:
    played = game(name, None, None)
    task, scene = played.task, played.scene
    size = task.action_space.shape[0]
    assert {one.axis for one in scene.controls} | {one.axis for one in scene.signals} == set(range(size))
    assert {pointer.quantity for pointer in scene.pointers} <= {q.name for q in task.quantities}
    assert scene.body and scene.zero and not any(control.name.startswith("action") for control in scene.controls)
    for signal in scene.signals:
        action = np.zeros((1, size))
        action[0, signal.axis] = signal.value
        assert task.world.command(action)[1][0] == signal.ends


def test_a_system_without_a_scene_is_played_by_the_numbers_of_its_action(tmp_path: Path) -> None:
    from dataclasses import replace

    known = game("NorthFinder", None, None)
    played = replace(known, system=replace(known.system, scene=""), scene=plain(known.task))
    assert [control.name for control in played.scene.controls] == ["action 1", "action 2"]
    session = Session(played, out=tmp_path)
    session._do("control", [0, 0.2])
    session._step()
    frame = session._events[-1]["frame"]
    assert frame["angle"] > 0 and [pointer.name for pointer in played.scene.pointers] == ["azimuth"]
    session._do("control", [1, 1.0])
    session._step()
    assert session._events[-1]["frame"]["over"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["NorthFindr"], "did you mean 'NorthFinder'?"),
        (["--scenario", "north_finder/publishd"], "did you mean 'north_finder/published'?"),
        (["TwoPosition", "--scenario", "north_finder/published"], "task.kind = 'north-finder'"),
        (["--estimator", "north_gsl"], "did you mean 'north_gls'?"),
        (["--policy", "bidirectonal"], "did you mean 'bidirectional'?"),
        (["--seed", "-1"], "--seed -1 given"),
        (["--port", "99999"], "--port 99999"),
    ],
)
def test_bad_input_is_one_sentence(
    given: list[str], said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = run(capsys, monkeypatch, "play", *given, "--no-browser")
    assert ended.status == 2 and said in ended.err
    assert ended.err.count("\n") == 1 and not ended.out


def test_a_port_in_use_is_said(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as other:
        other.bind((ADDRESS, 0))
        other.listen()
        port = other.getsockname()[1]
        ended = run(capsys, monkeypatch, "play", "--port", port, "--no-browser")
    assert ended.status == 2 and f"--port {port}: cannot be had (Address already in use)" in ended.err
