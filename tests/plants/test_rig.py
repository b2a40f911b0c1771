"""Sensors and rigs: the chain is a sum, chunks and batches do not matter, memory is bounded."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from motions import rich_motion
from scipy.stats import chi2

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.core.units import DEG_PER_HOUR
from insenv.effects.base import DrivenEffect, Effect
from insenv.effects.catalogue import ALL, by_key
from insenv.plants import profile, thermal
from insenv.plants.static import Disturbance, StaticBase
from insenv.plants.turntable import Encoder, Ripple, Turntable
from insenv.rig import AHEAD, Fitted, Normals, Readings, Rig
from insenv.sensors import instruments
from insenv.sensors.chain import Sensor

#: Shapes at which the effects show on the motions of these tests; others stand at their standard deviation.
SHAPES = {"hold": 0.35, "f": 0.31, "tau": 7.0, "t0": 11.3, "u0": 0.2, "s": 0.1}
MODELLED = tuple(effect for effect in ALL if not isinstance(effect, DrivenEffect))
#: Every effect that a gyro on a turntable can show.
ON_TABLE = tuple(
    e
    for e in ALL
    if not set(e.needs) & {"base_tilt", "force", "vibration", "turn_rate", "cross_rate", "body_rate", "across"}
)


def usual(effect: Effect) -> list[float]:
    """Linear parameters of a tenth of their standard deviation, shapes that matter."""
    return [0.1 * p.sd for p in effect.linear] + [SHAPES.get(p.name, p.sd) for p in effect.shapes]


def chain(effects: tuple[Effect, ...], target: str = "gyro") -> Fitted:
    sensor = Sensor(target, effects)
    return Fitted(sensor, sensor.theta([usual(e) for e in effects]))


def alone(effect: Effect, motion: Motion) -> Floats:
    theta = np.array(usual(effect))
    return effect.apply(motion.rate, motion, theta, effect.begin(motion, theta))[0]


def test_a_reading_is_the_true_input_plus_every_addition() -> None:
    motion, fitted = rich_motion(), chain(MODELLED)
    reading, _ = fitted.sensor.measure(motion, fitted.theta)
    parts = [alone(effect, motion) for effect in MODELLED]
    np.testing.assert_allclose(reading, motion.rate + sum(parts), rtol=1e-12, atol=1e-15)
    backwards = chain(MODELLED[::-1])
    other, _ = backwards.sensor.measure(motion, backwards.theta)
    np.testing.assert_allclose(other, reading, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("effect", MODELLED, ids=lambda e: e.key)
def test_adding_an_effect_adds_its_addition_and_its_regressors(effect: Effect) -> None:
    motion, before = rich_motion(), chain((by_key("scale_factor"), by_key("bias_thermal_lag")))
    after = before.sensor + effect
    theta = np.concatenate([before.theta, usual(effect)])
    assert after.names[: len(before.theta)] == before.sensor.names
    assert len(after.names) == len(after.units) == len(theta)
    old, new = before.sensor.measure(motion, before.theta)[0], after.measure(motion, theta)[0]
    np.testing.assert_allclose(new - old, alone(effect, motion) * np.ones(motion.n), atol=1e-12)
    columns = after.regressors(motion, theta)
    assert columns.shape == (motion.n, len(theta))
    assert np.array_equal(columns[:, : len(before.theta)], before.sensor.regressors(motion, before.theta))


def test_regressors_are_derivatives_of_the_reading() -> None:
    effects = tuple(e for e in MODELLED if e.id not in ("bias_step", "sample_hold"))  # these jump in their shapes
    motion, fitted = rich_motion(n=120), chain(effects)
    params = [p for e in effects for p in e.params]
    # Of a time constant no more than a share of its value: the curve bends within a second.
    steps = [1e-3 * (min(p.sd, value) if p.low > 0 else p.sd) for p, value in zip(params, fitted.theta, strict=True)]
    columns = fitted.sensor.regressors(motion, fitted.theta)
    for j, step in enumerate(steps):
        up, down = fitted.theta.copy(), fitted.theta.copy()
        up[j] += step
        down[j] -= step
        slope = (fitted.sensor.measure(motion, up)[0] - fitted.sensor.measure(motion, down)[0]) / (2 * step)
        scale = np.abs(columns[:, j]).max()
        rounding = 1e-13 / step
        np.testing.assert_allclose(columns[:, j], slope, rtol=1e-5, atol=1e-6 * scale + rounding)


def test_noise_has_no_part_in_the_expected_reading() -> None:
    sensor = Sensor("gyro") + by_key("bias") + by_key("angle_random_walk")
    columns = sensor.regressors(rich_motion(), np.array([1.0, 1.0]))
    assert np.array_equal(columns[:, 0], np.ones(600)) and not columns[:, 1].any()


def test_names_and_units() -> None:
    sensor = Sensor("accel_x") + by_key("bias") + by_key("tone") + by_key("tone")
    assert sensor.names == ("bias.c", "tone.c", "tone.s", "tone.f", "tone#2.c", "tone#2.s", "tone#2.f")
    assert sensor.units[0] == "m/s^2" and sensor.unit == "m/s^2"
    with pytest.raises(ValueError, match="has 3 parameters, given 1"):
        sensor.theta([[1.0], [1.0], [1.0, 1.0, 1.0]])


def table_rig() -> Rig:
    """A gyro with every effect that it can show, on a table that has everything."""
    table = Turntable(
        tilt=0.5,
        latitude=0.6,
        max_acceleration=2.0,
        ripple=Ripple(1e-3, 3),
        encoder=Encoder(1e-6, 1e-6, 1e-5),
        temperature=thermal.cycle([298, 310, 290], 1.0, 3.0),
        profile=profile.staircase([0.2, -0.3, 0.0, 0.1], 9.3) + profile.sine(0.2, 0.3, 50.0),
    )
    return Rig(table, (chain(ON_TABLE),), 12.8)


def base_rig() -> Rig:
    """A triad of gyros and one of accelerometers on a base that tilts."""
    common = (
        "bias",
        "scale_factor",
        "angle_random_walk",
        "bias_instability",
        "rate_random_walk",
        "quantization",
    )
    gyro, accel = ("g_sensitivity", "cross_axis"), ("base_tilt",)
    fitted = [chain(tuple(map(by_key, common + gyro)), f"gyro_{a}") for a in "xyz"]
    fitted += [chain(tuple(map(by_key, common + accel)), f"accel_{a}") for a in "xyz"]
    return Rig(StaticBase(latitude=0.6, disturbance=Disturbance(1e-3, 5.0)), tuple(fitted), 10.0)


def joined(chunks: list[Readings]) -> dict[str, Floats]:
    names = {**chunks[0].outputs, **chunks[0].references}
    return {name: np.concatenate([np.atleast_1d(_values(c, name)) for c in chunks], axis=-1) for name in names} | {
        "t": np.concatenate([c.t for c in chunks])
    }


def _values(chunk: Readings, name: str) -> Floats:
    return chunk.outputs[name] if name in chunk.outputs else chunk.references[name].values


RIGS = pytest.mark.parametrize("make", [table_rig, base_rig])


@RIGS
@pytest.mark.parametrize("chunk", [1, 17, 333])
def test_the_size_of_the_chunks_does_not_change_the_run(make: Callable[[], Rig], chunk: int) -> None:
    rig = make()
    whole = joined([rig.run(5, 400)])
    parts = joined(list(rig.stream(5, 400, chunk=chunk)))
    for name, values in whole.items():
        # Last digits: the sampling period is the difference of two times of the chunk.
        np.testing.assert_allclose(parts[name], values, rtol=1e-10, atol=1e-12 * np.abs(values).max(), err_msg=name)


@RIGS
def test_a_row_of_a_batch_is_the_run_with_its_seed_bit_for_bit(make: Callable[[], Rig]) -> None:
    rig = make()
    batch = joined(list(rig.stream(40, 300, batch=3, chunk=128)))
    for i in range(3):
        single = joined(list(rig.stream(40 + i, 300, chunk=128)))
        for name, values in single.items():
            row = batch[name][i] if batch[name].ndim > 1 else batch[name]
            assert np.array_equal(row, values), name


@RIGS
def test_advance_is_pure(make: Callable[[], Rig]) -> None:
    rig = make()
    normals = Normals(rig, 1)
    _, state = rig.advance(rig.begin(normals.start()), None, 50, normals.draw(50))
    z = normals.draw(60)
    first, second = rig.advance(state, None, 60, z.copy())[0], rig.advance(state, None, 60, z)[0]
    for name, values in joined([first]).items():
        assert np.array_equal(values, joined([second])[name])


def test_rows_may_have_their_own_parameters_and_commands() -> None:
    rig = table_rig()
    (fitted,) = rig.instruments
    thetas = fitted.theta * np.array([[1.0], [0.5], [0.0]]) + np.array([[0.0], [0.0], [1e-9]])
    batch = replace(rig, instruments=(Fitted(fitted.sensor, thetas),))
    normals = Normals(batch, 9, 3)
    commands = np.array([0.1, -0.2, 0.3])
    readings, _ = batch.advance(batch.begin(normals.start()), commands, 200, normals.draw(200))
    for i in range(3):
        one = replace(rig, instruments=(Fitted(fitted.sensor, thetas[i]),))
        own = Normals(one, 9 + i)
        alone_, _ = one.advance(one.begin(own.start()), commands[i], 200, own.draw(200))
        assert np.array_equal(readings.outputs["gyro"][i], alone_.outputs["gyro"])


def test_an_effect_at_the_end_of_a_chain_leaves_all_other_noise_as_it_was() -> None:
    rig = base_rig()
    noise = by_key("angle_random_walk")
    changed = replace(rig.instruments[1], sensor=rig.instruments[1].sensor + noise)
    changed = replace(changed, theta=np.append(changed.theta, 0.0))
    other = replace(rig, instruments=(rig.instruments[0], changed, *rig.instruments[2:]))
    before, after = joined([rig.run(3, 100)]), joined([other.run(3, 100)])
    for name, values in before.items():
        assert np.array_equal(after[name], values), name


def test_different_seeds_and_instruments_have_different_noise() -> None:
    rig = base_rig()
    z = Normals(rig, 0, 2).draw(50).reshape(-1, 50)
    assert len(np.unique(z[:, 0])) == len(z)


def test_normals_are_the_same_whatever_is_read_ahead() -> None:
    rig = base_rig()
    normals, blocks = Normals(rig, 4, 3), [7, 1, 300, AHEAD + 1, 50, 50]
    parts = np.concatenate([normals.draw(n) for n in blocks], axis=-1)
    np.testing.assert_array_equal(parts, Normals(rig, [4, 5, 6]).draw(sum(blocks)))
    np.testing.assert_array_equal(parts[1], Normals(rig, 5).draw(sum(blocks)))


def test_rows_of_normals_go_on_alone() -> None:
    rig = base_rig()
    seeds = [9, 2, 30]
    whole = Normals(rig, seeds).draw(500)
    normals = Normals(rig, seeds)
    normals.draw(33)
    kept = normals.rows(np.array([2, 0]))
    np.testing.assert_array_equal(np.concatenate([kept.draw(200), kept.draw(267)], -1), whole[[2, 0], :, 33:])
    for one, two in zip(kept.start(), Normals(rig, [30, 9]).start(), strict=True):
        np.testing.assert_array_equal(one, two)


def test_memory_of_a_stream_does_not_grow_with_its_length() -> None:
    rig = base_rig()

    def peak(samples: int) -> int:
        tracemalloc.start()
        for _ in rig.stream(0, samples, chunk=1000):
            pass
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size

    peak(1000)  # what is made once and kept, such as the flicker filter
    assert peak(40_000) < 1.2 * peak(4_000)
    assert peak(40_000) < 6 * 40_000 * 8 / 3  # a third of what its six outputs alone would take


def test_an_effect_without_its_exposure_is_refused() -> None:
    rig = Rig(Turntable(), (chain((by_key("g_sensitivity"),)),), 10.0)
    with pytest.raises(ValueError, match="does not give force"):
        rig.run(0, 10)


ALL_INSTRUMENTS = (
    instruments.rate_biased_rlg,
    instruments.dithered_rlg,
    instruments.fog_b215,
    instruments.fog_kvh13,
    instruments.quartz_accelerometer,
)


@pytest.mark.parametrize("make", ALL_INSTRUMENTS)
def test_every_instrument_runs_and_names_its_source(make: Callable[..., instruments.Instrument]) -> None:
    target = "accel_z" if make is instruments.quartz_accelerometer else "gyro_z"
    unit = make(target)
    readings = Rig(StaticBase(), (Fitted(unit.sensor, unit.theta),), unit.rate).run(0, 100)
    assert np.isfinite(readings.outputs[target]).all() and unit.source
    assert len(unit.sensor.names) == len(unit.theta)


def test_bias_stability_of_the_fibre_optic_gyro_is_as_its_noise_says() -> None:
    unit = instruments.fog_b215()
    rig = Rig(Turntable(profile=profile.rest(np.inf)), (Fitted(unit.sensor, unit.theta),), unit.rate)
    rate = rig.run(0, 720_000).outputs["gyro"] / DEG_PER_HOUR
    # Closed form sqrt(N^2 / tau + 2 Q^2 / tau^2): 1041.00 deg/h at 0.5 ms and 87.37 deg/h at 10 ms.
    # Deviation of a deviation: 0.1 % of 720 000 samples, 0.5 % of 36 000: 1 % and 3 % are above 6 sigma.
    assert np.std(rate) == pytest.approx(1041.0, rel=0.01)
    assert np.std(rate.reshape(-1, 20).mean(axis=1)) == pytest.approx(87.37, rel=0.03)


def test_dither_turns_lock_in_into_a_random_walk() -> None:
    """Adler's equation integrated: the departure d of the beat's phase from the dither's own, d' = -w_L sin(psi + d).

    In phases: one fringe is 2 pi. The peak rate is drawn anew at every peak, which makes the phases of the turning
    points random.
    """
    runs, periods, steps, lock_in, peak = 1000, 20, 600, 0.02, 60.0
    rng = np.random.default_rng(0)
    phase = rng.uniform(0, 2 * np.pi, runs)
    away, h = np.zeros(runs), 2 * np.pi / steps  # the dither has the angular frequency 1
    sizes = peak + 3 * np.pi * rng.uniform(-1, 1, (2 * periods, runs))  # three whole fringes: phases without order
    for half, size in enumerate(sizes):  # from one peak of the rate to the next
        swing = size if half % 2 else -size
        for k in range(steps // 2):
            # Midpoint rule: the phase turns by 0.7 rad in a step at most.
            away -= h * lock_in * np.sin(phase + swing * np.sin((k + 0.5) * h) + away)
    variance = np.mean(1 / sizes) * peak * instruments.dither_random_walk(lock_in, 2 * np.pi, peak) ** 2
    total = np.sum(away**2) / (variance * 2 * np.pi * periods)
    # Chi-square of 1000 runs, false alarm 2e-6: within 24 %; a stationary phase of 60 rad is good to 2 %.
    assert 1e-6 < chi2.cdf(total, runs) < 1 - 1e-6
