"""Copies of a recording, what the loop says of them, and the command."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import ASYMMETRY, MANIFEST, run, write
from scipy.fft import dct
from scipy.stats import binomtest

from insenv.close import close_on, opened
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.split import split
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.identify.findings import Findings
from insenv.identify.loop import trace
from insenv.trust.copies import Base, base, mirrored, scrambled, with_effect, without_effects
from insenv.trust.rates import Rate, trust
from insenv.trust.screen import Look, Screen, screen_of
from insenv.trust.trial import SCREENED, SIZES, Answer, Row, Trials, _plain, injections, read_row
from insenv.trust.words import to_json, verdict

#: Found everywhere at four times the smallest detectable size; in copies with nothing to find never. Of 5 copies each
#: a false alarm of 1 % per copy gives 2 or more in 1 of 1000 seeds, and a miss of 5 % 3 or more in 1 of 1000.
COPIES, MOST_WRONG, MOST_MISSED = 5, 1, 2


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> tuple[tuple[Recording, ...], Findings, Base]:
    manifest = opened(write(tmp_path_factory.mktemp("trust")))
    recordings = tuple(read_recordings(manifest))
    found = close_on(manifest, recordings)
    return recordings, found, base(manifest, recordings, found)


# ------------------------------------------------------------------------------------------ series


def test_a_mirrored_series_is_a_stretch_of_the_series_and_its_image() -> None:
    series = np.cumsum(np.random.default_rng(0).standard_normal(50))
    endless = np.tile(np.concatenate([series, series[::-1]]), 3)
    for start in (0, 1, 30, 50, 77, 99):
        assert np.array_equal(mirrored(series, start), endless[start : start + 50])
    assert np.array_equal(mirrored(series, 0), series)


def test_scrambling_keeps_the_power_of_every_mode() -> None:
    walk = np.cumsum(np.random.default_rng(1).standard_normal(4000))
    other = scrambled(walk, np.random.default_rng(2))
    assert np.allclose(np.abs(dct(other)), np.abs(dct(walk)), atol=1e-6)
    assert np.abs(np.diff(other)).max() < 2 * np.abs(np.diff(walk)).max()  # no jump
    assert abs(np.corrcoef(other, walk)[0, 1]) < 0.999


# ---------------------------------------------------------------------------------------- copies


def test_what_was_found_is_taken_out_and_the_rest_is_noise(
    closed: tuple[tuple[Recording, ...], Findings, Base],
) -> None:
    recordings, found, given = closed
    assert [one.effect for one in found.targets[0].added] == ["scale_factor_asymmetry"]
    rate = recordings[0].channels["table_rate"].values
    taken = recordings[0].channels["gyro"].values - given.recordings[0].channels["gyro"].values
    assert np.polyfit(np.abs(rate), taken, 1)[0] == pytest.approx(ASYMMETRY, abs=1.6e-4)  # 4 sd
    noise = given.noise[0]["gyro"]
    white = np.radians(0.1 / 60 / np.sqrt(0.1))
    assert np.nanstd(noise) == pytest.approx(white, rel=0.06)  # 4 sd of the scatter of 3000 rows
    measured = np.isfinite(noise)
    for regressor in (np.ones(len(rate)), rate, np.abs(rate)):  # fitted to all rows, so nothing of the model is left
        share = noise[measured] @ regressor[measured] / np.linalg.norm(noise[measured]) / np.linalg.norm(regressor)
        assert abs(share) < 1e-6


def test_a_copy_without_effects_has_the_references_and_the_noise_of_the_recording(
    closed: tuple[tuple[Recording, ...], Findings, Base],
) -> None:
    _, _, given = closed
    (own,) = given.recordings
    noise = given.noise[0]["gyro"]
    kept = np.isfinite(noise)
    for seed in range(6):
        (copy,) = without_effects(given, np.random.default_rng(seed))
        assert copy.channels["table_rate"] is own.channels["table_rate"]
        other = (copy.channels["gyro"].values - own.channels["gyro"].values)[kept] + noise[kept]
        assert np.std(other) == pytest.approx(np.std(noise[kept]), rel=0.1)  # a mirror image repeats some
        assert np.array_equal(copy.channels["gyro"].values[~kept], own.channels["gyro"].values[~kept])


def test_an_effect_is_added_as_its_own_text_says(closed: tuple[tuple[Recording, ...], Findings, Base]) -> None:
    _, _, given = closed
    (copy,) = with_effect(given, "gyro", by_key("scale_factor_asymmetry"), np.array([3e-4]))
    (own,) = given.recordings
    added = copy.channels["gyro"].values - own.channels["gyro"].values
    rate = own.channels["table_rate"].values
    held = np.r_[False, (rate[1:-1] == rate[:-2]) & (rate[1:-1] == rate[2:]), False]
    assert added[held] == pytest.approx(3e-4 * np.abs(rate[held]), rel=1e-9)


# ------------------------------------------------------------------------------------------- rates


def test_intervals_are_those_of_clopper_and_pearson() -> None:
    for count, of in ((0, 7), (3, 7), (7, 7), (1, 100)):
        wanted = binomtest(count, of).proportion_ci(method="exact")
        assert Rate(count, of).interval == pytest.approx((wanted.low, wanted.high), abs=1e-12)


def test_a_row_survives_the_store(closed: tuple[tuple[Recording, ...], Findings, Base]) -> None:
    _, found, given = closed
    job = Trials(given, injections(found), 0.01, 0)
    (text,) = job([1])["copy"]
    row = read_row(str(text))
    assert isinstance(row, Row) and row.injection is not None and row.size in SIZES
    assert job([1])["copy"][0] == text


def test_every_effect_has_its_turn_at_every_size(closed: tuple[tuple[Recording, ...], Findings, Base]) -> None:
    _, found, given = closed
    job = Trials(given, injections(found), 0.01, 0)
    each = len(job.injections) * len(SIZES)
    assert len({job._turn(k) for k in range(each)}) == each == len({job._turn(k) for k in range(each, 2 * each)})


@pytest.fixture(scope="module")
def screen(closed: tuple[tuple[Recording, ...], Findings, Base]) -> Screen:
    found = screen_of(closed[2], 0.01, 0)
    assert found is not None
    return found


def test_the_screen_lets_most_copies_of_noise_pass_and_none_with_a_large_effect(
    closed: tuple[tuple[Recording, ...], Findings, Base], screen: Screen
) -> None:
    """A copy of noise comes near the level in one of ten: 5 of 8 in 4 of 10,000 seeds."""
    _, found, given = closed
    quiet = [screen.quiet(without_effects(given, np.random.default_rng(seed))) for seed in range(8)]
    assert sum(quiet) >= 4
    for one in injections(found)[:6]:
        effect, theta = one.theta(SIZES[-1], np.random.default_rng(0))
        assert not screen.quiet(with_effect(given, one.target, effect, theta)), one.effect


def test_the_screen_sees_what_the_whole_search_sees_in_a_copy(
    closed: tuple[tuple[Recording, ...], Findings, Base], screen: Screen
) -> None:
    """The directions beside the fit to the copy itself give the evidence that the shared ones foretell."""
    _, _, given = closed
    copy = without_effects(given, np.random.default_rng(1))
    (track,) = trace(given.manifest, copy, split(given.manifest, copy), CATALOGUE, 0.01, 0).tracks
    own = Look.of(track, 0).log_p(np.zeros(track.problem.bins.n))
    problem = screen.looks[0].problem
    assert own == pytest.approx(screen.looks[0].log_p(track.problem.y - problem.y), abs=1.0)


def test_a_copy_that_the_screen_lets_pass_is_not_closed_and_named_nothing(
    closed: tuple[tuple[Recording, ...], Findings, Base], screen: Screen, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, found, given = closed
    known = injections(found)
    passing = Trials(given, known, 0.01, 0, screen)
    number = next(
        k
        for k in range(0, 20, 2)
        if screen.quiet(without_effects(given, np.random.default_rng(np.random.SeedSequence(0, spawn_key=(k,)))))
    )
    whole = Trials(given, known, 0.01, 0).row(number)
    monkeypatch.setattr(Trials, "_closed", lambda *_: pytest.fail("closed"))
    (answer,) = passing.row(number).answers
    assert answer.verdict == SCREENED and answer.added == whole.answers[0].added == ()


@pytest.mark.slow
def test_the_loop_is_quiet_on_nothing_and_finds_what_is_large(
    closed: tuple[tuple[Recording, ...], Findings, Base],
) -> None:
    _, found, given = closed
    known = injections(found)
    job = Trials(given, known, 0.01, 0)
    quiet = [job.row(2 * k) for k in range(COPIES)]
    large = [k for k in range(len(known) * len(SIZES)) if job._turn(k)[1] == SIZES[-1]][:COPIES]
    result = trust(found, given, known, [*quiet, *(job.row(2 * k + 1) for k in large)], 0)
    (one,) = result.reliability
    assert one.wrong.of == COPIES and one.wrong.count <= MOST_WRONG
    assert [name for name, _ in one.findings] == ["scale_factor_asymmetry"]
    seen = result.whole.sizes[-1].found
    assert seen.of == COPIES and seen.of - seen.count <= MOST_MISSED


def test_a_name_in_a_set_with_the_noise_is_counted_and_is_not_sure(
    closed: tuple[tuple[Recording, ...], Findings, Base],
) -> None:
    _, found, given = closed
    noisy = Answer("gyro", "confounded", ("bias_step",), ("rate_random_walk",), beside_noise=("bias_step",))
    both = replace(noisy, added=("bias_step", "tone"))
    rows = [Row(None, 0.0, 0.0, (one,)) for one in (Answer("gyro", "nothing-significant", ()), noisy, both)]
    assert [read_row(json.dumps(_plain(row))) for row in rows] == rows
    # A store of before knows no such sets.
    old = json.loads(json.dumps(_plain(rows[1])))
    old["answers"][0] = old["answers"][0][:6]
    assert read_row(json.dumps(old)).answers[0].beside_noise == ()
    result = trust(found, given, injections(found), rows, 0)
    (one,) = result.reliability
    assert (one.wrong, one.sure) == (Rate(2, 3), Rate(1, 3))
    assert "one that is told from noise in 1 of 3" in verdict(result)
    assert to_json(result)["reliability"][0]["sure"]["count"] == 1


# ----------------------------------------------------------------------------------------- command


def test_the_command_says_it_and_a_store_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest, store, out = write(tmp_path / "a"), tmp_path / "store", tmp_path / "trust.json"
    command = ("trust", manifest, "--copies", 2, "--store", store)
    ended = run(capsys, monkeypatch, *command, "--json", out)
    assert ended.status == 0
    assert "1 with nothing to find, 1 with one effect more" in ended.out
    said = json.loads(out.read_text())
    assert said["schema"] == "insenv.trust/1" and said["copies"] == 2
    assert run(capsys, monkeypatch, *command).status == 2  # the folder holds it already
    monkeypatch.setattr(Trials, "row", lambda *_: pytest.fail("done already"))
    page = tmp_path / "trust.html"
    again = run(capsys, monkeypatch, *command, "--resume", "--json", out, "--html", page)
    assert again.out.replace(f"\nReport: {page}\n", "") == ended.out
    assert json.loads(out.read_text()) | {"command": said["command"]} == said
    assert "scale_factor_asymmetry" in page.read_text() and "</svg>" in page.read_text()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--copies", "1"), "1 copies given; wanted 2 or more"),
        (("--resume",), "--resume given without --store"),
        (("--alpha", "2"), "alpha = 2; wanted a probability between 0 and 1"),
        (("--jobs", "0"), "0 processes given"),
    ],
)
def test_what_cannot_be_is_said_in_one_sentence(
    options: tuple[str, ...],
    sentence: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ended = run(capsys, monkeypatch, "trust", write(tmp_path, MANIFEST), *options)
    assert ended.status == 2 and sentence in ended.err and ended.err.count("\n") == 1
