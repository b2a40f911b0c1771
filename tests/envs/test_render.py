"""Pictures of the environments: what they show, that they are the same twice, and the window."""

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from environments.pictures import (
    BLUE,
    ORANGE,
    SIZE,
    assert_every_text_is_read,
    assert_same_in_any_order,
    of_colour,
    tip,
)
from gymnasium.error import DependencyNotInstalled

from insenv.core.attitude import wrapped
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.units import ARCSEC, DEG, DEG_PER_HOUR, PPM
from insenv.envs.charts import plain
from insenv.envs.render import Window, plain_angle, plain_bearing
from insenv.systems.north_finder.env import NorthFinderEnv
from insenv.systems.north_finder.film import NorthFinderFilm
from insenv.systems.north_finder.frame import History, View, horizontal_earth_rate, residual
from insenv.systems.north_finder.view import Renderer, draw

STEPS = 300
PRIOR = np.pi / np.sqrt(3)
AZIMUTH, RATE = 226.5317 * DEG, 10 * DEG


def made(k: int, sd: float = 31 * ARCSEC, believes: bool = True, scale: bool = True) -> View:
    """A view after k of the steps; ``sd`` of the belief at its end."""
    t = np.arange(1.0, STEPS + 1)
    share = 5 * PPM * (1 - np.exp(-t / 120))
    left = 10 * DEG_PER_HOUR * np.cos(AZIMUTH - RATE * t) + share * RATE / 2
    deviation = np.minimum(PRIOR, sd * (max(k, 1) / t) ** 2)
    mean = AZIMUTH + np.clip(0.7 * deviation * np.cos(t / 40), -3, 3)
    history = History(
        t[:k],
        RATE * t[:k],
        left[:k],
        (left / 20)[:k] if believes else np.zeros(0),
        share[:k],
        np.stack([0.8 * share, 2 * PPM * (1 + 30 / t)], axis=1)[:k] if believes and scale else np.zeros((0, 2)),
        np.stack([mean, deviation], axis=1)[:k] if believes else np.zeros((0, 2)),
    )
    belief = (float(mean[k - 1]), float(deviation[k - 1])) if k else (0.0, PRIOR)
    rate = RATE if k else 0.0
    known = belief if believes else None
    return View(k, STEPS, RATE * k, AZIMUTH, known, rate, 30 * DEG, history, "north_finder/published", 30 * ARCSEC)


VIEWS = {
    "reset": made(0),
    "one step": made(1),
    "early": made(14, 40 * DEG),
    "middle": made(120, 120 * ARCSEC),
    "late": made(STEPS),
    "tiny deviation": made(STEPS, 1e-3 * ARCSEC),
    "deviation of zero": replace(made(50), belief=(AZIMUTH, 0.0)),
    "unbounded deviation": replace(made(50), belief=(0.0, np.inf)),
    "sure and wrong": replace(made(50), belief=(AZIMUTH + 3.0, 1e-9)),
    "without scale factor": made(50, scale=False),
    "no estimator": made(50, believes=False),
    "no estimator, reset": made(0, believes=False),
    "near the wrap": replace(made(50), azimuth_true=-1e-9, belief=(2 * np.pi - 2e-9, 1e-8)),
    "backwards": replace(made(50), rate=-123.45 * DEG, table_angle=-1e4),
    "long title": replace(made(50), title="a$b_{c " * 30),
}


@pytest.fixture(scope="module")
def drawn() -> Renderer:
    """One for all tests: what it draws does not depend on what it drew before, as a test of its own says."""
    return Renderer()


def is_open(window: Window) -> bool:
    return window.is_open


def test_a_frame_is_the_same_whatever_was_drawn_before() -> None:
    assert_same_in_any_order(Renderer(), [*VIEWS.values()])


@pytest.mark.parametrize("name", ["reset", "late", "no estimator"])
def test_a_new_renderer_draws_the_same(name: str) -> None:
    used = Renderer()
    used.draw(VIEWS["middle"])
    frame = draw(VIEWS[name])
    assert frame.shape == (600, 960, 3)
    assert frame.dtype == np.uint8
    np.testing.assert_array_equal(used.draw(VIEWS[name]), frame)


@pytest.mark.parametrize(
    "change",
    [
        {"time": 121.0},
        {"duration": 400.0},
        {"table_angle": 1.0},
        {"azimuth_true": 1.0},
        {"belief": (AZIMUTH, 1.0)},
        {"belief": (AZIMUTH + 1 * ARCSEC, 120 * ARCSEC)},
        {"rate": -RATE},
        {"rate": 0.0},
        {"tilt": 0.1},
        {"title": "other"},
        {"demanded": 60 * ARCSEC},
        {"demanded": None},
        {"history": made(119).history},
    ],
)
def test_a_frame_changes_with_what_it_shows(drawn: Renderer, change: dict[str, Any]) -> None:
    view = VIEWS["middle"]
    assert np.any(drawn.draw(view) != drawn.draw(replace(view, **change)))


@pytest.mark.parametrize("name", VIEWS)
def test_no_text_overlaps_another_or_leaves_the_picture(drawn: Renderer, name: str) -> None:
    view = VIEWS[name]
    drawn.draw(view)
    layout = drawn._layouts[view.belief is not None, len(view.history.believed_scale_factor) > 0, view.duration]
    assert_every_text_is_read(layout.canvas.figure)


@pytest.mark.parametrize("turned", np.deg2rad([0.0, 45.0, 170.0, -80.0, 725.0]))
def test_gyro_axis_points_to_azimuth_less_table_angle(drawn: Renderer, turned: float) -> None:
    places = of_colour(drawn.draw(replace(VIEWS["reset"], table_angle=turned)), ORANGE)
    assert wrapped(tip(places) - (AZIMUTH - turned)) == pytest.approx(0.0, abs=2 * DEG)


@pytest.mark.parametrize("error", np.deg2rad([20.0, 100.0, -60.0, 370.0]))
def test_who_believes_in_too_large_an_azimuth_sees_north_in_the_west(drawn: Renderer, error: float) -> None:
    view = replace(VIEWS["reset"], belief=(AZIMUTH + error, 1e-6))
    assert wrapped(tip(of_colour(drawn.draw(view), BLUE)) + error) == pytest.approx(0.0, abs=2 * DEG)


def test_a_whole_turn_of_the_azimuth_changes_nothing(drawn: Renderer) -> None:
    view = VIEWS["middle"]
    mean, sd = view.belief or (0.0, 0.0)
    turned = replace(view, azimuth_true=AZIMUTH - 2 * np.pi, belief=(mean + 4 * np.pi, sd))
    difference = np.abs(drawn.draw(turned).astype(int) - drawn.draw(view))
    # Sines of angles that differ by whole turns differ in the last digit, and so may an edge's shade.
    assert difference.max() <= 2


@pytest.mark.parametrize("size", [(160, 100), (480, 300), (961, 601), (700, 700), (1400, 500)])
def test_a_frame_has_the_size_that_is_asked_for(size: tuple[int, int]) -> None:
    assert draw(VIEWS["late"], size).shape == (size[1], size[0], 3)


@pytest.mark.parametrize("size", [(159, 600), (960, 99), (0, 0), (-1, 600)])
def test_a_picture_too_small_is_refused(size: tuple[int, int]) -> None:
    with pytest.raises(InputError, match=r"too small; wanted at least 160 x 100"):
        draw(VIEWS["late"], size)


def test_without_an_estimator_no_panel_is_empty() -> None:
    frame = draw(VIEWS["no estimator"])
    for rows, columns in (
        (slice(0, 300), slice(0, 480)),
        (slice(300, 600), slice(0, 480)),
        (slice(0, 300), slice(480, 960)),
    ):
        assert (frame[rows, columns] < 128).any()


def test_pyplot_is_not_used() -> None:
    program = "import sys; import insenv.systems.north_finder.view; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[2], check=False).returncode == 0


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (-0.5, "−0.5"), (1e-13, "0"), (1e6, "10⁶"), (-2.5e-7, "−2.5·10⁻⁷"), (1234.0, "1234")],
)
def test_tick_text(value: float, text: str) -> None:
    assert plain(value) == text


def test_angles_as_text() -> None:
    assert plain_bearing(-1e-9, 3) == "0.000°"
    assert plain_bearing(2 * np.pi - 1e-9, 1) == "0.0°"
    assert plain_bearing(-90 * DEG, 1) == "270.0°"
    assert plain_angle(-1e-9, 1) == "0.0°"
    assert plain_angle(-7.5 * DEG, 1) == "−7.5°"


def test_residual_of_an_exact_gyro_is_the_horizontal_earth_rate() -> None:
    tilt, latitude, dt = 0.5, 0.7, 0.01
    angle = np.linspace(0.3, 4.0, 101)
    middle, turning = 0.5 * (angle[1:] + angle[:-1]), np.diff(angle) / dt
    vertical = EARTH_RATE * np.sin(latitude) * np.sin(tilt)
    level = EARTH_RATE * np.cos(latitude) * np.cos(tilt)
    gyro = np.sin(tilt) * turning + vertical + level * np.cos(1.0 - middle)
    left = residual(gyro, turning, tilt, latitude) - horizontal_earth_rate(1.0, middle, tilt, latitude)
    assert abs(left) < 1e-15


def play(env: NorthFinderEnv, steps: int) -> View:
    """The view of an environment after some steps."""
    env.reset(seed=5)
    for _ in range(steps):
        env.step(np.array([RATE, 0.0]))
    film = env._film
    assert isinstance(film, NorthFinderFilm)
    assert film._view is not None
    return film._view


def test_history_of_a_run() -> None:
    env = NorthFinderEnv(estimator="correlation", render_mode="rgb_array")
    view = play(env, 80)
    h = view.history
    np.testing.assert_allclose(h.time, np.arange(1.0, 81.0))
    assert len(h.residual) == len(h.north) == len(h.unexplained) == len(h.scale_factor) == 80
    latitude, tilt = env.task.datasheet.site.latitude, env.task.datasheet.mounting.tilt
    assert latitude is not None
    level = EARTH_RATE * np.cos(latitude) * np.cos(tilt)
    middle = h.angle - 0.5 * RATE
    expected = level * np.cos(view.azimuth_true - middle) + h.scale_factor * RATE * np.sin(tilt)
    # Two steps for the table to gain its rate. Left are noise, 0.02 deg/h, and one pulse a second, 0.5 deg/h at most.
    assert np.abs(h.residual - expected)[2:].max() < 1.0 * DEG_PER_HOUR
    assert view.table_angle == pytest.approx(h.angle[-1], abs=10 * ARCSEC)
    assert view.rate == pytest.approx(RATE)
    env.step(np.array([RATE, 1.0]))
    assert len(play(env, 0).history.time) == 0


@pytest.fixture
def pygame(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    yield pytest.importorskip("pygame")


def test_window_shows_the_frame(pygame: Any) -> None:
    window, frame = Window("test", 1000), draw(VIEWS["late"])
    assert not is_open(window)
    window.show(frame)
    assert is_open(window)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    np.testing.assert_array_equal(shown, frame)
    window.close()
    assert not is_open(window)
    window.close()
    window.show(frame)
    assert is_open(window)
    window.close()


def test_a_window_that_the_user_closes_stays_closed(pygame: Any) -> None:
    window, frame = Window("test", 1000), draw(VIEWS["late"], (160, 100))
    window.show(frame)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.show(frame)
    assert not is_open(window)
    window.show(frame)
    assert not is_open(window)


def test_without_pygame_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    window = Window("test", 10)
    with pytest.raises(DependencyNotInstalled, match=r"insenv\[render\]"):
        window.show(np.zeros((100, 160, 3), np.uint8))
    window.close()


@pytest.mark.parametrize("estimator", [None, "correlation", "north_gls"])
def test_environment_renders_arrays(estimator: str | None) -> None:
    env = gymnasium.make("insenv/NorthFinder-v0", estimator=estimator, render_mode="rgb_array")
    env.reset(seed=1)
    frames = [env.render()]
    for _ in range(3):
        env.step(np.array([RATE, 0.0]))
        frames.append(env.render())
    for frame in frames:
        assert isinstance(frame, np.ndarray)
        assert frame.shape == (600, 960, 3)
    assert len({np.asarray(frame).tobytes() for frame in frames}) == len(frames)
    env.step(np.array([RATE, 1.0]))
    assert np.asarray(env.render()).shape == (600, 960, 3)
    env.close()


def test_environment_shows_itself_in_a_window(pygame: Any) -> None:
    env = gymnasium.make("insenv/NorthFinder-v0", estimator="correlation", render_mode="human")
    env.reset(seed=1)
    assert pygame.display.get_surface().get_size() == SIZE
    before = pygame.surfarray.array3d(pygame.display.get_surface())
    env.step(np.array([RATE, 0.0]))
    assert np.any(pygame.surfarray.array3d(pygame.display.get_surface()) != before)
    assert env.render() is None
    env.close()
    assert not pygame.display.get_init()


def test_environment_that_nobody_looks_at_imports_no_plotting() -> None:
    program = (
        "import gymnasium, insenv, sys\n"
        "env = gymnasium.make('insenv/NorthFinder-v0'); env.reset(seed=1); env.step(env.action_space.sample())\n"
        "sys.exit('matplotlib' in sys.modules or 'pygame' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[2], check=False).returncode == 0


def test_a_run_can_be_recorded_as_a_video(tmp_path: Path) -> None:
    pytest.importorskip("moviepy")
    env = gymnasium.make("insenv/NorthFinder-v0", render_mode="rgb_array")
    filmed = gymnasium.wrappers.RecordVideo(env, str(tmp_path / "new"), disable_logger=True)
    filmed.reset(seed=1)
    filmed.step(np.array([RATE, 0.0]))
    filmed.step(np.array([RATE, 1.0]))
    filmed.close()
    assert [path.suffix for path in (tmp_path / "new").iterdir()] == [".mp4"]
