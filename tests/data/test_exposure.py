"""What a target was exposed to, from the reference channels: times of rows, gaps, delays, signs."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from motions import edges
from numpy.testing import assert_allclose
from simulated_runs import GRAVITY, gyro_run, rocking_base, without_rows

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.motion import interval_mean
from insenv.core.recording import Channel, Covers, Floats, Mounting, Recording, Response, Site
from insenv.data.exposure import expose, up_direction

DT = 0.1
N = 400
FREQUENCY = 0.7


def angle(t: Floats) -> Floats:
    """A swing of the table [rad]."""
    return 0.8 * np.sin(FREQUENCY * t) + 0.1 * t


def rate(t: Floats) -> Floats:
    return 0.8 * FREQUENCY * np.cos(FREQUENCY * t) + 0.1


def mean_rate(start: Floats, stop: Floats) -> Floats:
    return (angle(stop) - angle(start)) / (stop - start)


def swing(covers: Covers, delay: float = 0.0, table_delay: float = 0.0, rate_delay: float = 0.0) -> Recording:
    """A perfect gyro on a swinging table; a delayed channel shows what was true ``delay`` before."""
    t = 3.0 + edges(N - 1, DT)
    shown = t - delay
    y = mean_rate(shown - DT, shown) if covers == "interval" else rate(shown)
    moved = t - rate_delay
    channels = {
        "gyro": Channel(y, "rad/s", covers, delay),
        "table_angle": Channel(angle(t - table_delay), "rad", delay=table_delay),
        "table_rate": Channel(mean_rate(moved - DT, moved), "rad/s", "interval", rate_delay),
    }
    return Recording(t, channels)


def test_an_interval_target_is_compared_with_the_interval_that_ends_at_its_row() -> None:
    e = expose(swing("interval"), "gyro")
    assert len(e.y) == N - 1
    assert_allclose(e.y, e.motion.rate, rtol=0, atol=1e-13)


def test_an_instantaneous_target_is_compared_with_the_interval_around_its_row() -> None:
    e = expose(swing("instant"), "gyro")
    t = 3.0 + edges(N - 1, DT)
    assert len(e.y) == N
    # The encoder is read at the rows, the edges lie between them: linear interpolation, error of order dt^2.
    exact = mean_rate(t - DT / 2, t + DT / 2)
    assert_allclose(e.motion.rate[2:-2], exact[2:-2], rtol=0, atol=FREQUENCY**3 * DT**2 / 2)
    assert_allclose(e.y[2:-2], e.motion.rate[2:-2], rtol=0, atol=FREQUENCY**3 * DT**2 / 2)


@pytest.mark.parametrize(("rows", "off"), [(25.0, 1e-6), (60.0, 6e-9), (200.0, 1e-11)])
def test_between_readings_of_an_encoder_a_swing_goes_on_as_it_turns(rows: float, off: float) -> None:
    """An instant is told to the sixth power of w dt, 1/140 of it or less, where the table turns about as elsewhere."""
    w, t = 2 * np.pi / (rows * DT), edges(N - 1, DT)
    channels = {
        "gyro": Channel(np.cos(w * t), "rad/s"),
        "table_angle": Channel(np.sin(w * t) / w, "rad", source="encoder"),
    }
    for rows_per_cell in (1, 4):
        e = expose(Recording(t, channels), "gyro", rows_per_cell=rows_per_cell)
        assert_allclose(e.motion.rate[8:-8], e.y[8:-8], rtol=0, atol=off)


@pytest.mark.parametrize("covers", ["interval", "instant"])
@pytest.mark.parametrize("delay", [0.3, 0.04])
@pytest.mark.parametrize("delayed", ["target", "references", "both"])
def test_delays_of_target_and_references_are_taken_back(covers: Covers, delay: float, delayed: str) -> None:
    own = delay if delayed != "references" else 0.0
    others = delay if delayed != "target" else 0.0
    e = expose(swing(covers, own, others, others), "gyro")
    inner = slice(6, -6)
    assert_allclose(e.y[inner], e.motion.rate[inner], rtol=0, atol=FREQUENCY**3 * DT**2)


def test_a_delay_that_is_not_declared_shows() -> None:
    """The test above can fail: 0.04 s at 0.3 rad/s^2 is 0.01 rad/s."""
    r = swing("interval", 0.04)
    hidden = replace(r, channels={**r.channels, "gyro": replace(r.channels["gyro"], delay=0.0)})
    e = expose(hidden, "gyro")
    assert np.abs(e.y - e.motion.rate).max() > 0.01


def test_angle_and_integrated_rate_give_one_reference() -> None:
    both = swing("interval")
    for left_out in ("table_angle", "table_rate"):
        channels = {name: c for name, c in both.channels.items() if name != left_out}
        alone = expose(replace(both, channels=channels), "gyro", rows_per_cell=4)
        together = expose(both, "gyro", rows_per_cell=4)
        assert_allclose(alone.motion.rate, together.motion.rate, rtol=0, atol=1e-12)
        assert_allclose(alone.u, together.u, rtol=0, atol=1e-12)
        assert alone.motion.angle is not None and together.motion.angle is not None
        turned, expected = np.diff(alone.motion.angle), np.diff(together.motion.angle)
        assert_allclose(turned, expected, rtol=0, atol=1e-12)


def test_the_commanded_rate_makes_regressors_and_the_encoder_the_reference() -> None:
    r = swing("interval")
    wrong = replace(r.channels["table_angle"], values=r.channels["table_angle"].values * 1.01)
    e = expose(replace(r, channels={**r.channels, "table_angle": wrong}), "gyro")
    assert_allclose(e.motion.rate, 1.01 * e.y, rtol=0, atol=1e-12)
    assert_allclose(e.u, e.y, rtol=0, atol=1e-12)


def test_cells_run_through_gaps_and_leave_out_the_first_row_of_a_piece() -> None:
    lost = (100, 130)
    whole, broken = swing("interval"), without_rows(swing("interval"), lost)
    e = expose(broken, "gyro")
    assert e.motion.n == N - 1  # the same grid as without the gap
    # Row 130 is the first after the gap: its interval began where no reference is known. Cell k is row k + 1.
    assert np.flatnonzero(e.count == 0).tolist() == list(range(99, 130))
    assert e.cell_of_row[0] == e.cell_of_row[100] == -1
    filled = e.count > 0
    assert_allclose(e.y[filled], e.motion.rate[filled], rtol=0, atol=1e-12)
    assert_allclose(e.y[filled], expose(whole, "gyro").y[filled], rtol=0, atol=0)


def test_an_instantaneous_target_keeps_the_first_row_of_a_piece() -> None:
    e = expose(without_rows(swing("instant"), (100, 130)), "gyro")
    assert np.flatnonzero(e.count == 0).tolist() == list(range(100, 130))
    assert np.all(e.cell_of_row >= 0)


def test_a_cell_is_the_mean_of_its_rows() -> None:
    fine, coarse = (expose(swing("interval"), "gyro", rows_per_cell=k) for k in (1, 7))
    whole = len(fine.y) // 7
    assert_allclose(coarse.y[:whole], fine.y[: 7 * whole].reshape(whole, 7).mean(1), rtol=0, atol=1e-14)
    assert_allclose(coarse.motion.rate[:whole], fine.motion.rate[: 7 * whole].reshape(whole, 7).mean(1), atol=1e-12)
    assert coarse.count.sum() == N - 1
    assert coarse.motion.dt == pytest.approx(7 * DT)


@pytest.mark.parametrize("rows", [1, 5])
def test_readings_at_instants_are_compared_with_the_rate_at_these_instants(rows: int) -> None:
    """Where a ramp begins a mean with the neighbours is a quarter of a step off: a curve of the rate near rest."""
    t = edges(N - 1, DT)
    rate = np.interp(t, [0, 5, 8, 20, 23, 30, 31, 40], [0, 0, 1, 1, -1, -1, 0, 0])
    recording = Recording(
        t, {"gyro": Channel(rate, "rad/s", "instant"), "table_rate": Channel(rate, "rad/s", "instant")}
    )
    e = expose(recording, "gyro", rows_per_cell=rows)
    assert_allclose(e.y, e.motion.rate, rtol=0, atol=1e-15)
    assert_allclose(e.u, e.motion.rate, rtol=0, atol=1e-15)


def test_a_rate_goes_on_at_the_ends() -> None:
    """A reference that begins later or ends earlier than the target goes on with the slope of its end."""
    t = edges(49, DT)
    channels = {
        "gyro": Channel(np.full(50, 0.25), "rad/s"),
        "table_angle": Channel(0.25 * t, "rad", delay=0.0),
    }
    e = expose(Recording(t, channels), "gyro")  # instantaneous: half a cell beyond both ends
    assert_allclose(e.motion.rate, 0.25, rtol=0, atol=1e-13)
    assert e.motion.rate_edges is not None and e.motion.angle is not None
    assert_allclose(e.motion.rate_edges, 0.25, rtol=0, atol=1e-12)
    assert_allclose(e.motion.angle, 0.25 * (np.arange(51) - 0.5) * DT, rtol=0, atol=1e-13)


def test_a_steady_acceleration_has_its_rate_at_every_edge() -> None:
    t = edges(50, DT)[1:]
    channels = {"gyro": Channel(t, "rad/s", "interval"), "table_angle": Channel(0.5 * t**2, "rad")}
    e = expose(Recording(t, channels), "gyro")
    assert e.motion.rate_edges is not None
    assert_allclose(e.motion.rate_edges, DT * np.arange(1, 51), rtol=0, atol=1e-12)


@pytest.mark.parametrize("tilt", [np.pi / 2, -np.pi / 2, 0.3, 0.0])
def test_a_tilted_gyro_sees_its_share_of_the_table_and_of_the_earth(tilt: float) -> None:
    r = replace(swing("interval"), mounting=Mounting(tilt), site=Site(0.8))
    table = expose(swing("interval"), "gyro").motion.rate
    plain, turning = expose(r, "gyro"), expose(r, "gyro", with_earth=True)
    assert_allclose(plain.motion.rate, np.sin(tilt) * table, rtol=0, atol=1e-15)
    vertical = EARTH_RATE * np.sin(0.8) * np.sin(tilt)
    assert_allclose(turning.motion.rate - plain.motion.rate, vertical, rtol=0, atol=1e-15)
    assert_allclose(turning.u - plain.u, vertical, rtol=0, atol=1e-15)
    assert plain.motion.projection == pytest.approx(np.sin(tilt))


@pytest.mark.parametrize("kind", ["constant", "staircase", "reversal", "sine"])
@pytest.mark.parametrize("rows", [1, 5])
def test_a_simulated_motion_is_read_back(kind: str, rows: int) -> None:
    """The first interval is left out: its beginning is in no row."""
    run = gyro_run(kind, 3, duration=100.0)
    e, truth = expose(run.recording, "gyro", rows), run.motion.interval(1, run.motion.n)
    whole = truth.n // rows
    mean = truth.rate[: whole * rows].reshape(whole, rows).mean(axis=1)
    assert_allclose(e.motion.rate[:whole], mean, rtol=0, atol=1e-12)
    assert_allclose(e.u[:whole], mean, rtol=0, atol=1e-12)
    assert e.motion.angle is not None and truth.angle is not None
    assert_allclose(e.motion.angle[: whole + 1], truth.angle[: whole * rows + 1 : rows], rtol=0, atol=1e-12)
    samples = run.recording.channels["gyro"].values[1 : 1 + whole * rows].reshape(whole, rows)
    assert_allclose(e.y[:whole], samples.mean(axis=1), rtol=0, atol=1e-15)
    assert_allclose(e.motion.t[: whole + 1], rows * run.motion.dt * np.arange(whole + 1), rtol=0, atol=1e-9)


def test_temperature_is_given_at_the_edges() -> None:
    """A ramp keeps its slope and its place under smoothing."""
    r = swing("interval")
    ramp = Channel(290.0 + 0.02 * (r.t - r.t[0]), "K")
    e = expose(replace(r, channels={**r.channels, "temperature": ramp}), "gyro")
    assert e.motion.temperature is not None
    assert_allclose(np.diff(e.motion.temperature)[20:-20] / DT, 0.02, rtol=1e-3)
    assert_allclose(e.motion.temperature[20:-20], 290.0 + 0.02 * DT * np.arange(N)[20:-20], rtol=0, atol=0.02 * DT)


def test_a_channel_that_is_not_there_has_no_exposure() -> None:
    r = swing("interval")
    e = expose(replace(r, channels={"gyro": r.channels["gyro"]}), "gyro")
    assert e.motion.angle is None and e.motion.rate_edges is None and e.motion.temperature is None
    assert e.motion.base_tilt is None
    assert not e.motion.rate.any() and not e.u.any()


def test_a_target_that_is_not_there_is_an_input_error() -> None:
    with pytest.raises(InputError, match=r"no channel 'gyro_z'; there are gyro, table_angle"):
        expose(swing("interval"), "gyro_z")


@pytest.mark.parametrize("axes", ["RFU", "FRD", "URF", "DRB"])
def test_base_tilt_times_gravity_is_what_the_level_accelerometers_read(axes: str) -> None:
    """Slope 9.81 within 1 %: the accelerometers' noise allows 0.1 %, the white gyros' far less."""
    r = rocking_base(4, axes=axes)
    up = up_direction(r)
    level = [axis for axis, letter in zip("xyz", axes, strict=True) if letter not in "UD"]
    for axis in level:
        e = expose(r, f"accel_{axis}", rows_per_cell=5)
        tilt = e.motion.base_tilt
        assert tilt is not None
        x = np.column_stack([tilt, np.ones_like(tilt), e.motion.middle])
        slope = np.linalg.lstsq(x, e.y, rcond=None)[0][0]
        assert slope == pytest.approx(GRAVITY, rel=0.01)
    vertical = "xyz"[int(np.abs(up).argmax())]
    assert vertical not in level
    # About the vertical axis: no tilt, to the accuracy with which the accelerometers tell where up is.
    tilts = [expose(r, f"accel_{axis}", rows_per_cell=5).motion.base_tilt for axis in (vertical, level[0])]
    assert tilts[1] is not None
    assert tilts[0] is None or np.abs(tilts[0]).max() < 1e-3 * np.abs(tilts[1]).max()


def test_without_accelerometers_the_mounting_says_where_up_is() -> None:
    r = rocking_base(4, axes="FRD")
    names = ("gyro_x", "gyro_y", "gyro_z", "accel_x")
    bare = replace(r, channels={name: r.channels[name] for name in names})
    assert up_direction(bare).tolist() == [0.0, 0.0, -1.0]
    tilts = [expose(x, "accel_x").motion.base_tilt for x in (r, bare)]
    assert tilts[0] is not None and tilts[1] is not None
    assert_allclose(tilts[1], tilts[0], rtol=0, atol=2e-3 * np.abs(tilts[0]).max())


def test_base_tilt_needs_the_gyro_that_the_axis_turns_about() -> None:
    r = rocking_base(4)
    for missing, known in (("gyro_y", False), ("gyro_x", True)):
        channels = {name: c for name, c in r.channels.items() if name != missing}
        tilt = expose(replace(r, channels=channels), "accel_x").motion.base_tilt
        assert (tilt is not None) == known


def test_a_gyro_triad_sees_the_forces_and_the_other_rates() -> None:
    r = rocking_base(5)
    e = expose(r, "gyro_x", rows_per_cell=3)
    assert set(e.motion.force) == {"x", "y", "z"} and set(e.motion.cross_rate) == {"y", "z"}
    values = r.channels["accel_z"].values[1:]
    whole = len(values) // 3
    assert_allclose(e.motion.force["z"][:whole], values[: 3 * whole].reshape(whole, 3).mean(1), rtol=1e-14)
    # An accelerometer's axes are tilted against the forces along the other two, not against rates.
    assert set(expose(r, "accel_x").motion.cross_rate) == {"y", "z"}
    assert interval_mean(e.motion.t) == pytest.approx(e.motion.middle)


def test_the_edges_of_a_noisy_rate_carry_no_noise_of_single_rows() -> None:
    """A tachometer alone; the noise of its steady rate is averaged away, to a tenth at least."""
    rng, n, noise = np.random.default_rng(6), 4000, 1e-4
    rate = np.repeat([0.2, -0.3], n // 2)
    channels = {
        "gyro": Channel(rate, "rad/s", "interval"),
        "table_rate": Channel(rate + noise * rng.standard_normal(n), "rad/s", "interval"),
    }
    e = expose(Recording(0.1 * np.arange(1.0, n + 1), channels), "gyro", rows_per_cell=4)
    assert e.motion.rate_edges is not None
    edges = e.motion.rate_edges
    steady = np.abs(np.arange(len(edges)) - len(edges) / 2) > 20
    steady[[0, 1, -2, -1]] = False
    inside = np.where(np.arange(len(edges)) < len(edges) / 2, 0.2, -0.3)
    assert np.std((edges - inside)[steady]) < 0.1 * noise


def test_an_accelerometer_on_a_table_sees_nothing_of_its_rate() -> None:
    recording = swing("instant")
    channels = {**recording.channels, "accel": Channel(np.full(N, GRAVITY), "m/s^2")}
    motion = expose(replace(recording, channels=channels), "accel").motion
    assert not motion.rate.any()
    assert motion.turn_rate is not None and np.ptp(motion.turn_rate) > 0.5


def test_a_measured_angle_without_noise_is_a_curve_between_its_readings() -> None:
    """Of a swing of 2 Hz read every 10 ms straight lines cut 0.2 % where cells end between the rows."""
    t = 0.01 * np.arange(2000.0)
    omega = 4 * np.pi
    channels = {
        "gyro": Channel(np.cos(omega * t), "rad/s", "instant"),
        "table_angle": Channel(np.sin(omega * t) / omega, "rad", "instant", source="encoder"),
    }
    e = expose(Recording(t, channels), "gyro")
    inside = slice(5, -5)
    gain = float(e.y[inside] @ e.motion.rate[inside] / (e.motion.rate[inside] @ e.motion.rate[inside]))
    assert abs(gain - 1) < 0.6 * (omega * 0.01) ** 2 / 8  # readings at instants are a third of that larger than means


def test_an_exposure_is_gathered_once_for_all_copies_that_share_its_data() -> None:
    recording = swing("interval")
    first = expose(recording, "gyro")
    channels = {name: replace(channel) for name, channel in recording.channels.items()}
    assert expose(replace(recording, channels=channels, label="a copy", notes=("read anew",)), "gyro") is first
    # Whatever it depends on makes another one.
    gyro = recording.channels["gyro"]
    out = np.zeros(N, bool)
    out[7] = True
    others = (
        replace(recording, channels={**recording.channels, "gyro": replace(gyro, values=gyro.values.copy())}),
        replace(recording, channels={**recording.channels, "gyro": replace(gyro, delay=0.01)}),
        replace(recording, mounting=Mounting(0.3)),
        replace(recording, responses={"gyro": Response(gain=-1.0)}),
        replace(recording, left_out={"gyro": out}),
    )
    assert all(expose(other, "gyro") is not first for other in others)
    assert expose(recording, "gyro", 2).count.max() == 2


def test_no_exposure_outlives_its_recording() -> None:
    recording = swing("interval")
    gone = weakref.ref(expose(recording, "gyro"))
    assert gone() is not None
    del recording
    gc.collect()
    assert gone() is None
