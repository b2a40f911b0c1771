"""The magnitude of the fitted horizontal Earth rate against the one that latitude and tilt make.

A gyro on a tilted table, means over half a second: 0.004 deg/h of the Earth rate per run of 600 s at
3e-4 deg/sqrt(h), so an encoder that is wrong by an arcsecond (0.09 deg/h at 10 deg/s and 30 deg) is plain.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from motions import edges
from scipy.stats import binom
from simulated_runs import DEG_PER_HOUR, closed, manifest, use

from insenv.close import close
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Mounting, Recording, Site
from insenv.effects.catalogue import by_key
from insenv.identify.earth.hidden import Hidden, hidden
from insenv.identify.findings import Estimate, TargetFindings
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Problem
from insenv.identify.next.procedures import TableTurning, procedures
from insenv.identify.prepare.declared import declared_model
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.earth_rate import LATITUDE_SD, TILT_SD, Check, check, due_level, horizontal

DEG = np.pi / 180
ARCSEC = DEG / 3600
LATITUDE, TILT, AZIMUTH = 40 * DEG, 30 * DEG, 40 * DEG
LEVEL = EARTH_RATE * np.cos(LATITUDE) * np.cos(TILT)
DECLARED = ("bias", "scale_factor", "earth_rate")
WHITE = 3e-4 * DEG / 60
Added = tuple[str, Sequence[float] | Floats]


def table_run(
    seed: int,
    rates: Sequence[float] = (10.0,),
    added: Sequence[Added] = (),
    duration: float = 600.0,
    place: tuple[float, float] = (LATITUDE, TILT),
    azimuth: float = AZIMUTH,
    bias: float = 0.05 * DEG_PER_HOUR,
    base_turned: float = 0.0,
) -> Recording:
    """A table at each of ``rates`` [deg/s] for the same time; the site and the mount are as told up to ``place``."""
    rng = np.random.default_rng(seed)
    dt = 0.5
    n = round(duration / dt)
    rate = np.repeat(np.array(rates) * DEG, -(-n // len(rates)))[:n]
    angle = np.concatenate([[0.0], np.cumsum(rate * dt)])
    t = edges(n, dt)
    latitude, tilt = place
    vertical = EARTH_RATE * np.sin(latitude) * np.sin(tilt)
    u, share = rate * np.sin(tilt) + vertical, float(np.sin(tilt))
    motion = Motion(t=t, rate=u, angle=angle, projection=share, base_turned=base_turned)
    level = EARTH_RATE * np.cos(latitude) * np.cos(tilt)
    earth = ("earth_rate", (level * np.cos(azimuth), level * np.sin(azimuth)))
    y = motion.rate + bias + WHITE / np.sqrt(dt) * rng.standard_normal(n)
    for key, theta in (earth, *added):
        y = y + by_key(key).apply(motion.rate, motion, np.array(theta))[0]
    channels = {
        "gyro": Channel(y, "rad/s", "interval"),
        "table_angle": Channel(angle[1:], "rad"),
        "table_rate": Channel(rate, "rad/s", "interval"),
    }
    mounting = Mounting(TILT, base_turned=base_turned)
    return Recording(t[1:], channels, site=Site(LATITUDE), mounting=mounting, label=f"run {seed}")


def fitted(recording: Recording, declared: tuple[str, ...] = DECLARED) -> tuple[Problem, Fit]:
    prepared = prepare(
        manifest(declared=declared), (recording,), (use(len(recording)),), "gyro", tones=False, holds=False
    )
    return prepared.problem, solve(prepared.problem, prepared.model)


def checked(recording: Recording) -> Check | None:
    problem, fit = fitted(recording)
    return check(problem, fit, due_level((recording,)), 1)


def found_in(*recordings: Recording, declared: tuple[str, ...] = DECLARED) -> TargetFindings:
    return closed(recordings, manifest(declared=declared)).targets[0]


def estimate(rows: Sequence[Estimate], effect: str, name: str) -> Estimate:
    return next(row for row in rows if (row.effect, row.parameter) == (effect, name))


# ---------------------------------------------------------------------------------------------- end to end


ECCENTRIC: Added = ("encoder_harmonic:1", (0.0, 2 * ARCSEC))


@pytest.fixture(scope="module")
def one_way() -> TargetFindings:
    return found_in(table_run(1, added=(ECCENTRIC,)))


def test_an_eccentric_encoder_at_one_rate_shows_in_the_magnitude(one_way: TargetFindings) -> None:
    assert one_way.verdict == "confounded"
    (added,) = one_way.added
    assert (added.effect, added.order) == ("encoder_harmonic", 1)
    assert added.confounded_with == ("angle_locked_rate:1",)
    assert added.p_value < 1e-10
    assert added.held_out_before == added.held_out_after == one_way.held_out.before == one_way.held_out.after
    assert "tilt" in added.remark and "latitude" in added.remark
    assert any("latitude of" in reason and "tilt of" in reason for reason in one_way.reasons)


def test_no_figure_of_it_pretends(one_way: TargetFindings) -> None:
    """The part across the Earth rate is as uncertain as the prior, and so is the azimuth."""
    (added,) = one_way.added
    for parameter, truth in zip(added.parameters, (0.0, 2 * ARCSEC), strict=True):
        assert abs(parameter.value - truth) < parameter.sd
        assert parameter.sd > 5 * ARCSEC
    for name in ("c", "s"):
        before, after = (estimate(e, "earth_rate", name) for e in (one_way.estimates_before, one_way.estimates_after))
        assert after.sd > 100 * before.sd
    (azimuth,) = one_way.derived
    assert (azimuth.name, azimuth.unit) == ("azimuth", "rad")
    assert azimuth.before.sd < 60 * ARCSEC and azimuth.after.sd > 1 * DEG
    assert abs(azimuth.before.value - AZIMUTH) > 10 * azimuth.before.sd
    assert abs(azimuth.after.value - AZIMUTH) < azimuth.after.sd
    (caution,) = one_way.cautions
    # Omega sin(tilt) / level arcsec per arcsec: 1804 at latitude 40 deg, tilt 30 deg and 10 deg/s.
    assert "1 arcsec of encoder_harmonic:1 by up to 1804 arcsec" in caution
    assert "does not bound" in caution


def test_the_first_experiment_is_the_reversal_and_a_table_can_run_it(one_way: TargetFindings) -> None:
    ours = [one for one in one_way.next_experiment if one.separates == ("encoder_harmonic:1", "angle_locked_rate:1")]
    assert ours == list(one_way.next_experiment[: len(ours)])
    reversal = {"kind": "reversal", "rate": "10 deg/s", "dwell": "300 s"}
    (back,) = (one for one in ours if one.profile == reversal)
    assert back.expected_separation_sigma is not None and back.expected_separation_sigma > 10
    index = next(one for one in one_way.next_experiment if "earth_rate" in one.separates)
    assert index.separates == ("angle_locked_rate:1", "earth_rate")
    assert index.changes == {"base_turned": "180 deg", "duration": "600 s"} and index.profile is not None


def test_what_a_table_would_run_follows_from_what_it_did() -> None:
    """A quarter of the time at rest, the angle alone logged by an encoder with noise of an arcsecond."""
    run = table_run(16, (10.0, 10.0, 10.0, 0.0))
    angle = run.channels["table_angle"].values + ARCSEC * np.random.default_rng(0).standard_normal(len(run))
    channels = {"gyro": run.channels["gyro"], "table_angle": Channel(angle, "rad")}
    turning = TableTurning.of((replace(run, channels=channels),))
    assert turning is not None
    made = {one.profile["kind"]: one.profile for one in procedures((replace(run, channels=channels),)) if one.profile}
    rates = [f"{sign * rate:g} deg/s" for sign in (1, -1) for rate in (10, 7.5, 5, 2.5)]
    assert made["staircase"] == {"kind": "staircase", "rates": rates, "dwell": "75 s"}
    assert made["reversal"] == {"kind": "reversal", "rate": "10 deg/s", "dwell": "300 s"}
    (turned, rested) = made["steps"]["steps"]
    assert (turned[1], rested[1]) == ("10 deg/s", "0 deg/s")
    assert float(turned[0][:-2]) == pytest.approx(450, abs=2) and float(rested[0][:-2]) == pytest.approx(150, abs=2)
    still = {"gyro": run.channels["gyro"], "table_angle": Channel(angle % (2 * ARCSEC), "rad")}
    assert TableTurning.of((replace(run, channels=still),)) is None


BOTH_WAYS = {
    "one run with a reversal": (table_run(2, (10.0, -10.0, 10.0, -10.0), (ECCENTRIC,)),),
    "a run each way": (table_run(3, (10.0,), (ECCENTRIC,)), table_run(4, (-10.0,), (ECCENTRIC,))),
}


@pytest.mark.parametrize("runs", BOTH_WAYS.values(), ids=BOTH_WAYS)
def test_the_reversal_settles_it(runs: tuple[Recording, ...]) -> None:
    found = found_in(*runs)
    assert found.verdict == "effects-found"
    (added,) = found.added
    assert (added.effect, added.order, added.confounded_with) == ("encoder_harmonic", 1, ())
    size = estimate(added.parameters, "encoder_harmonic:1", "s")
    assert abs(size.value - 2 * ARCSEC) < 5 * size.sd and size.sd < 0.1 * ARCSEC
    (azimuth,) = found.derived
    assert abs(azimuth.after.value - AZIMUTH) < 5 * azimuth.after.sd and azimuth.after.sd < 100 * ARCSEC
    index = next(one for one in found.next_experiment if "angle_locked_rate:1" in one.separates)
    assert "earth_rate" in index.separates and (index.changes or {})["base_turned"] == "180 deg"
    assert all("encoder_harmonic" not in caution for caution in found.cautions)


def test_a_rate_locked_to_the_table_that_both_ways_leave_has_the_earth_for_its_rival() -> None:
    locked: Added = ("angle_locked_rate:1", (0.2 * DEG_PER_HOUR, 0.2 * DEG_PER_HOUR))
    found = found_in(table_run(5, (10.0, -10.0, 10.0, -10.0), (locked,)))
    assert found.verdict == "confounded"
    (added,) = found.added
    assert (added.effect, added.confounded_with) == ("angle_locked_rate", ("earth_rate",))
    first = found.next_experiment[0]
    assert (first.changes or {})["base_turned"] == "180 deg" and (first.expected_separation_sigma or 0) > 10


BOTH_BASES = (0.0, np.pi)


def on_both_bases(*added: Added) -> TargetFindings:
    """Both ways on a base, and again after it was turned."""
    rates = (10.0, -10.0, 10.0, -10.0)
    return found_in(*(table_run(30 + i, rates, added, base_turned=b) for i, b in enumerate(BOTH_BASES)))


def test_what_turns_with_the_base_is_told_by_turning_it_and_what_stands_with_the_earth_is_not() -> None:
    locked = on_both_bases(("angle_locked_rate:1", (0.2 * DEG_PER_HOUR, 0.2 * DEG_PER_HOUR)))
    assert [(one.effect, one.confounded_with) for one in locked.added] == [("angle_locked_rate", ())]
    assert abs(locked.derived[0].after.value - AZIMUTH) < 5 * locked.derived[0].after.sd
    along = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH)])
    across = np.array([-along[1], along[0]])
    hidden_field = on_both_bases(("magnetic_field", 0.2 * DEG_PER_HOUR * across))
    (azimuth,) = hidden_field.derived
    assert abs(azimuth.after.value - AZIMUTH) > 10 * azimuth.after.sd  # nothing in the recording can show it ...
    (caution,) = hidden_field.cautions  # ... and that is said
    assert "magnetic_field" in caution and "shielding" in caution
    seen = on_both_bases(("magnetic_field", 0.2 * DEG_PER_HOUR * along))
    assert seen.verdict == "confounded"
    assert [one.effect for one in seen.added] == ["magnetic_field"]


def test_a_sound_instrument_keeps_its_verdict_and_a_caution() -> None:
    found = found_in(table_run(6))
    assert found.verdict == "nothing-significant" and found.added == ()
    assert any("encoder_harmonic:1" in caution for caution in found.cautions)
    (azimuth,) = found.derived
    assert azimuth.before == azimuth.after
    assert abs(azimuth.after.value - AZIMUTH) < 5 * azimuth.after.sd


def test_a_declared_encoder_error_is_no_news() -> None:
    """It stands in the model, and the recording does not tell it from the Earth rate: nothing is undeclared."""
    found = found_in(table_run(7, added=(ECCENTRIC,)), declared=(*DECLARED, "encoder_harmonic:1"))
    assert found.verdict == "nothing-significant"


# ------------------------------------------------------------------------------------------- false alarms


RUNS = 400
MOST_ALARMS = 10


def test_false_alarms_of_the_magnitude_are_as_rare_as_they_are_said_to_be() -> None:
    """400 sound instruments; latitude, tilt, azimuth, bias and rate drawn; alpha = 1 % for the check alone.

    At 1 % more than 10 alarms have a probability of 3e-3 (exact binomial); at 2 % up to 10 have 0.8: what is shown is
    that the share is not much beyond 2 %. It is far less, for a tilt that is off shows in the bias as well, where a
    scale factor that no single rate tells may be the reason.
    """
    p_values = []
    for seed in range(RUNS):
        rng = np.random.default_rng([seed, 1])
        place = LATITUDE + LATITUDE_SD * rng.standard_normal(), TILT + TILT_SD * rng.standard_normal()
        rate = rng.uniform(5, 20) * rng.choice([-1, 1])
        bias = 0.05 * DEG_PER_HOUR * rng.standard_normal()
        run = table_run(seed, (rate,), place=place, azimuth=rng.uniform(-np.pi, np.pi), bias=bias, duration=300.0)
        one = checked(run)
        assert one is not None
        p_values.append(one.p_value)
    assert binom.sf(MOST_ALARMS, RUNS, 0.01) < 4e-3
    assert sum(p < 0.01 for p in p_values) <= MOST_ALARMS


def test_the_noise_of_the_magnitude_is_as_large_as_it_is_said_to_be() -> None:
    """With latitude and tilt exact, departure over its noise has unit spread.

    Of 400 runs the spread is within 0.88 to 1.12 with a probability of 0.999 (chi-square).
    """
    deviates = []
    for seed in range(RUNS):
        one = checked(table_run(10_000 + seed, azimuth=0.1 * seed, duration=300.0))
        assert one is not None
        deviates.append(one.departure / one.noise_sd)
    assert 0.88 < np.sqrt(np.mean(np.square(deviates))) < 1.12


def test_a_scale_factor_that_no_single_rate_tells_is_no_departure() -> None:
    """1000 ppm stand in the bias as 18 deg/h, and make the Earth rate 0.1 % larger too."""
    k = 1e-3
    run = table_run(8, bias=k * 10 * DEG * np.sin(TILT), added=(("earth_rate", (k * LEVEL, 0.0)),))
    one = checked(run)
    assert one is not None and abs(one.deviate) < 3


@pytest.mark.parametrize(
    "change",
    [
        {"mounting": Mounting(90 * DEG)},
        {"mounting": Mounting(-90 * DEG)},
        {"mounting": Mounting()},
        {"site": Site(90 * DEG)},
        {"site": Site()},
    ],
)
def test_without_a_horizontal_part_there_is_no_check(change: dict[str, Mounting | Site]) -> None:
    run = replace(table_run(9), **change)  # type: ignore[arg-type]
    assert due_level((run,)) is None


@pytest.mark.parametrize("upright", [False, True])
def test_runs_at_other_tilts_and_latitudes_see_their_shares(upright: bool) -> None:
    place = (10 * DEG, 60 * DEG)
    other = replace(table_run(10, place=place), site=Site(place[0]), mounting=Mounting(place[1]))
    along = replace(table_run(13, place=(LATITUDE, 90 * DEG)), mounting=Mounting(90 * DEG))
    runs = (*[along] * upright, table_run(11), table_run(12, (-10.0,)), other)
    assert due_level(runs) == due_level(runs[1:] if upright else runs[:1])
    uses = tuple(use(len(run)) for run in runs)
    prepared = prepare(manifest(declared=DECLARED), runs, uses, "gyro", tones=False, holds=False)
    earth = horizontal(prepared.problem, solve(prepared.problem, prepared.model))
    assert earth is not None
    # A false alarm once in a million runs of this test; with one level for all it is off by 4 deg/h, thousands of sd.
    assert abs(earth.magnitude - LEVEL) < 5 * np.sqrt(np.linalg.eigvalsh(earth.cov)[-1])


def test_a_recording_that_hardly_feels_the_earth_is_not_judged() -> None:
    gyro = table_run(11).channels["gyro"]
    noise = 20 * DEG_PER_HOUR * np.sqrt(600) * np.random.default_rng(0).standard_normal(len(gyro.values))
    run = table_run(11)
    loud = replace(run, channels={**run.channels, "gyro": replace(gyro, values=gyro.values + noise)})
    assert checked(loud) is None


# ---------------------------------------------------------------------------------------- what would explain it


def suspect(seed: int, theta: Floats) -> Hidden:
    """The encoder as the suspect on a run whose encoder is wrong by ``theta``."""
    run = table_run(seed, added=(("encoder_harmonic:1", theta),), duration=300.0)
    problem, fit = fitted(run)
    one = check(problem, fit, due_level((run,)), 1)
    assert one is not None
    (found,) = hidden(problem, fit, (by_key("encoder_harmonic:1"),), one.level)
    return found


def test_what_is_said_of_a_suspect_holds() -> None:
    """Over 100 encoders drawn from the prior, deviates of its parameters and of the azimuth have unit spread.

    Their mean squares are chi-square over 100: beyond 0.64 to 1.44 (spread 0.8 to 1.2) with 1e-3 at most, were the
    circle its tangent; the variance for the circle is meant for the worst direction, so the lower bound is 0.6.
    """
    prior = by_key("encoder_harmonic:1").linear[0].sd
    deviates = []
    for seed in range(100):
        theta = prior * np.random.default_rng([seed, 2]).standard_normal(2)
        found = suspect(seed, theta)
        turned = np.angle(np.exp(1j * (found.earth.azimuth - AZIMUTH)))
        deviates.append([*(found.theta - theta) / found.sd, turned / found.earth.azimuth_sd])
    spread = np.sqrt(np.mean(np.square(deviates), axis=0))
    assert (spread > 0.6).all() and (spread < 1.2).all(), spread


def test_the_least_size_is_the_part_along_the_earth_rate() -> None:
    along = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH)])  # s adds to c of the Earth rate, c takes from its s
    for size in (3 * ARCSEC, -3 * ARCSEC):
        found = suspect(1, size * along)
        assert abs(found.least - 3 * ARCSEC) < 5 * found.least_sd
        assert found.least_sd < 0.2 * ARCSEC
        assert found.theta == pytest.approx(size * along, abs=5 * found.least_sd)


def test_an_effect_that_adds_no_turn_of_its_own_is_no_suspect() -> None:
    problem, fit = fitted(table_run(12, added=(ECCENTRIC,)))
    keys = ("encoder_harmonic:2", "angle_locked_rate:3", "bias_drift", "scale_factor_asymmetry")
    level = due_level((table_run(12),))
    assert hidden(problem, fit, tuple(map(by_key, keys)), level) == ()


def test_a_table_at_rest_tells_no_azimuth() -> None:
    assert horizontal(*fitted(table_run(13, (0.0,)))) is None


# ----------------------------------------------------------------------------------- effects that no search tries


def test_a_declared_wobble_is_fitted_like_any_effect() -> None:
    truth = (0.0, 0.0, 3 * ARCSEC, -2 * ARCSEC)
    run = table_run(14, (10.0, -10.0, 10.0, -10.0), (("wobble:1", truth),))
    found = found_in(run, declared=(*DECLARED, "wobble:1"))
    assert found.verdict == "nothing-significant"
    for name, value in zip(("c_r", "s_r"), truth[2:], strict=True):
        row = estimate(found.estimates_after, "wobble:1", name)
        assert abs(row.value - value) < 5 * row.sd and row.sd < 0.2 * ARCSEC


def test_what_chance_drives_is_refused_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'lock_in_wander', which is driven by chance") as refused:
        declared_model(manifest(declared=("bias", "lock_in_wander")), (table_run(15),), "gyro")
    assert "\n" not in str(refused.value)
    with pytest.raises(InputError, match="'lock_in_wander' is driven by chance"):
        close(tmp_path / "none.toml", effects=("lock_in_wander",))


def test_the_earths_rate_of_a_table_whose_angle_nobody_logged_is_no_tone() -> None:
    """It stands with a thousand deviations at the frequency of the turns, beside an encoder's rate with some noise."""
    run = table_run(3)
    rate = run.channels["table_rate"]
    noisy = rate.values + 1e-6 * np.random.default_rng(4).standard_normal(len(run))
    channels = {"gyro": run.channels["gyro"], "table_rate": replace(rate, values=noisy, source="encoder")}
    found = found_in(replace(run, channels=channels))
    assert "tone" not in {added.effect for added in found.added}
    assert any("once a turn of the table" in reason for reason in found.reasons)
    assert any("recording has no table_angle" in caution for caution in found.cautions)
    assert not any("no table_angle" in caution for caution in found_in(run).cautions)
