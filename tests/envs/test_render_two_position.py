"""Pictures of the two-position calibration: what they show, and that they are the same twice."""

from collections.abc import Iterator
from dataclasses import replace
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
from two_position_cases import ID, SHORT, STAY, STOP, SURE, TURN, made

from insenv.core.attitude import wrapped
from insenv.core.errors import InputError
from insenv.core.units import ARCMIN, ARCSEC, DEG
from insenv.systems.two_position.film import TwoPositionFilm
from insenv.systems.two_position.frame import History, View, residual
from insenv.systems.two_position.view import Renderer, draw

STEPS = 620
PRIOR = np.pi / np.sqrt(3)
INSTALLATION, HEADING = 30 * ARCMIN, 20 * DEG
PUBLISHED = SHORT | {"sight.installation": "30 arcmin"}


def viewed(k: int, sd: float = 20 * ARCSEC, believes: bool = True) -> View:
    """A view after k of the steps, with a turn by 170 deg in the middle; ``sd`` of the belief at its end."""
    t = np.arange(1.0, STEPS + 1)
    turned = np.interp(t, [300, 320], [0, 170 * DEG])
    wave = 2e-4 * np.stack([np.sin(t), np.cos(1.3 * t)], axis=-1)
    velocity = np.stack([1e-2 * t - 3e-5 * t**2, -8e-3 * t + 1e-8 * t**3], axis=-1) + wave
    deviation = np.minimum(PRIOR, sd * (max(k, 1) / t) ** 1.5)
    mean = INSTALLATION + 0.7 * deviation * np.cos(t / 40)
    believed = np.stack([mean, deviation], axis=-1)
    history = History(t[:k], ((t > 300) & (t <= 320)).astype(float)[:k], velocity[:k], believed[: k if believes else 0])
    now = (float(mean[k - 1]), float(deviation[k - 1])) if k else (0.0, PRIOR)
    heading = HEADING - (turned[k - 1] if k else 0.0)
    return View(
        time=k,
        duration=STEPS,
        heading=heading,
        turned=float(turned[k - 1]) if k else 0.0,
        rate=8.5 * DEG if 300 < k <= 320 else 0.0,
        installation=INSTALLATION,
        believed_heading=(heading + INSTALLATION - now[0], now[1]) if believes else None,
        believed_installation=now if believes else None,
        sighting=HEADING + INSTALLATION if k else None,
        history=history,
        title="two_position/published_a",
        demanded=20 * ARCSEC,
    )


VIEWS = {
    "reset": viewed(0),
    "one step": viewed(1),
    "early": viewed(14, 2 * DEG),
    "turning": viewed(310, 2 * ARCMIN),
    "late": viewed(STEPS),
    "tiny deviation": viewed(STEPS, 1e-3 * ARCSEC),
    "deviation of zero": replace(
        viewed(50), believed_heading=(HEADING, 0.0), believed_installation=(INSTALLATION, 0.0)
    ),
    "no heading": replace(viewed(50), believed_heading=None),
    "unbounded deviation": replace(viewed(50), believed_heading=(0.0, np.inf), believed_installation=(0.0, np.inf)),
    "sure and wrong": replace(viewed(50), believed_heading=(HEADING + 3.0, 1e-9), believed_installation=(-3.0, 1e-9)),
    "no estimator": viewed(400, believes=False),
    "no estimator, reset": viewed(0, believes=False),
    "near the wrap": replace(viewed(50), heading=-1e-9, believed_heading=(2 * np.pi - 2e-9, 1e-8)),
    "backwards": replace(viewed(310), rate=-123.45 * DEG, turned=-1e3),
    "long title": replace(viewed(50), title="a$b_{c " * 30),
}


@pytest.fixture(scope="module")
def drawn() -> Renderer:
    """One for all tests: what it draws does not depend on what it drew before, as a test of its own says."""
    return Renderer()


def test_a_frame_is_the_same_whatever_was_drawn_before() -> None:
    used = Renderer()
    assert_same_in_any_order(used, [*VIEWS.values()])
    np.testing.assert_array_equal(draw(VIEWS["late"]), used.draw(VIEWS["late"]))


@pytest.mark.parametrize(
    "change",
    [
        {"time": 311.0},
        {"duration": 700.0},
        {"heading": 1.0},
        {"turned": 1.0},
        {"rate": -8.5 * DEG},
        {"rate": 0.0},
        {"installation": 1 * DEG},
        {"believed_heading": (1.0, 1.0)},
        {"believed_heading": None},
        {"believed_installation": (INSTALLATION, 1 * ARCMIN)},
        {"sighting": None},
        {"title": "other"},
        {"demanded": 60 * ARCSEC},
        {"demanded": None},
        {"history": viewed(309, 2 * ARCMIN).history},
    ],
)
def test_a_frame_changes_with_what_it_shows(drawn: Renderer, change: dict[str, Any]) -> None:
    view = VIEWS["turning"]
    assert np.any(drawn.draw(view) != drawn.draw(replace(view, **change)))


@pytest.mark.parametrize("name", VIEWS)
def test_no_text_overlaps_another_or_leaves_the_picture(drawn: Renderer, name: str) -> None:
    view = VIEWS[name]
    drawn.draw(view)
    assert_every_text_is_read(drawn._layouts[view.believed_installation is not None, view.duration].canvas.figure)


@pytest.mark.parametrize("heading", np.deg2rad([0.0, 45.0, 170.0, -80.0, 725.0]))
def test_the_sight_points_to_heading_and_installation_angle(drawn: Renderer, heading: float) -> None:
    view = replace(VIEWS["reset"], heading=heading, installation=5 * DEG)
    assert wrapped(tip(of_colour(drawn.draw(view), ORANGE)) - heading - 5 * DEG) == pytest.approx(0.0, abs=2 * DEG)


@pytest.mark.parametrize("error", np.deg2rad([20.0, 100.0, -60.0]))
def test_the_believed_heading_stands_where_it_is_believed(drawn: Renderer, error: float) -> None:
    view = replace(VIEWS["reset"], believed_heading=(HEADING + error, 1e-6))
    assert wrapped(tip(of_colour(drawn.draw(view), BLUE)) - HEADING - error) == pytest.approx(0.0, abs=2 * DEG)


@pytest.mark.parametrize("size", [(160, 100), (480, 300), (961, 601), (1400, 500)])
def test_a_frame_has_the_size_that_is_asked_for(size: tuple[int, int]) -> None:
    assert draw(VIEWS["late"], size).shape == (size[1], size[0], 3)


def test_a_picture_too_small_is_refused() -> None:
    with pytest.raises(InputError, match=r"too small; wanted at least 160 x 100"):
        draw(VIEWS["late"], (159, 600))


def test_residual_is_what_the_cubic_of_each_rest_leaves() -> None:
    t = np.arange(1.0, 101.0)
    turning = ((t > 40) & (t <= 50)).astype(float)
    smooth = np.stack([3 + t - 0.2 * t**2 + 1e-3 * t**3, np.where(t > 45, 7.0, -t)], axis=-1)
    left = residual(t, turning, smooth)
    assert np.isnan(left[40:50]).all()
    assert np.nanmax(np.abs(left)) < 1e-9
    bump = smooth.copy()
    bump[70] += 1.0
    assert residual(t, turning, bump)[70].min() > 0.9
    assert np.isnan(residual(t[:4], turning[:4], smooth[:4])).all()
    assert residual(t[:0], turning[:0], smooth[:0]).shape == (0, 2)


def play(env: Any, actions: Any) -> View:
    """The view of an environment after some steps."""
    env.reset(seed=5)
    for action in actions:
        env.step(action)
    film = env._film
    assert isinstance(film, TwoPositionFilm) and film._view is not None
    return film._view


@pytest.mark.parametrize("estimator", [None, SURE])
def test_history_of_a_run(estimator: str | None) -> None:
    changes = PUBLISHED | {"vehicle.heading": "30 deg", "sight.readings": "turns"}
    env = gymnasium.make(ID, changes=changes, estimator=estimator, render_mode="rgb_array").unwrapped
    view = play(env, [STAY, TURN, *[STAY] * 5])
    np.testing.assert_allclose(view.history.time, np.arange(1.0, 8.0))
    assert view.history.turning.tolist() == [0, 1, 1, 1, 0, 0, 0]
    assert len(view.history.installation) == (0 if estimator is None else 7)
    assert view.turned == pytest.approx(9 * DEG)
    assert view.heading == pytest.approx(21 * DEG)
    assert view.rate == 0
    # Ten deviations of orientation and tracking.
    assert view.sighting == pytest.approx(21.5 * DEG, abs=300 * ARCSEC)
    # A level that is off by 5 and 3 arcmin lets gravity in; a first guess of the attitude, not one of zero.
    speed = np.abs(view.history.velocity[-1])
    assert (speed > 1e-3).all() and (speed < 7 * 9.8 * 10 * ARCMIN).all()
    assert play(env, [STAY, TURN]).rate == pytest.approx(2.5 * DEG)
    assert len(play(env, []).history.time) == 0


def test_without_an_estimated_heading_the_gyro_carries_the_sighting_on() -> None:
    env = gymnasium.make(ID, changes=PUBLISHED, estimator="two_position_cases:OnlyTheAngle", render_mode="rgb_array")
    view = play(env.unwrapped, [STAY, TURN, *[STAY] * 4])
    assert view.believed_heading is not None and view.believed_installation is not None
    believed = view.believed_heading[0] + view.believed_installation[0]
    assert believed == pytest.approx(view.heading + INSTALLATION, abs=300 * ARCSEC)


@pytest.mark.parametrize("estimator", [None, SURE])
def test_environment_renders_arrays(estimator: str | None) -> None:
    env = gymnasium.make(ID, changes=SHORT, estimator=estimator, render_mode="rgb_array")
    env.reset(seed=1)
    frames = [env.render()]
    for action in (STAY, TURN, STAY):
        env.step(action)
        frames.append(env.render())
    assert all(isinstance(frame, np.ndarray) and frame.shape == (600, 960, 3) for frame in frames)
    assert len({np.asarray(frame).tobytes() for frame in frames}) == len(frames)
    env.step(STOP)
    assert np.asarray(env.render()).shape == (600, 960, 3)
    env.close()


@pytest.fixture
def pygame(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    yield pytest.importorskip("pygame")


def test_environment_shows_itself_in_a_window(pygame: Any) -> None:
    env = gymnasium.make(ID, changes=SHORT, estimator=SURE, render_mode="human")
    env.reset(seed=1)
    assert pygame.display.get_surface().get_size() == SIZE
    before = pygame.surfarray.array3d(pygame.display.get_surface())
    env.step(TURN)
    assert np.any(pygame.surfarray.array3d(pygame.display.get_surface()) != before)
    assert env.render() is None
    env.close()
    assert not pygame.display.get_init()


def test_rendering_without_a_mode_is_refused() -> None:
    env = made()
    env.reset(seed=1)
    with pytest.raises(InputError, match="made without render_mode"):
        env.render()
