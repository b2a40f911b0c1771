"""Words of a converter: those read without their sign or in two parts come back as they were, all others stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.core.recording import Floats
from insenv.data.init import init
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.readers import Table
from insenv.data.words import signed, unsigned_bits, with_words

ROWS = 1200
NAMES = tuple(f"accel_{axis}" for axis in "xyz")


def counts(seed: int, up: tuple[float, float, float], noise: float = 8.0) -> Floats:
    """Words of a triad at rest, shape (3, n)."""
    rng = np.random.default_rng(seed)
    return np.rint(np.array(up)[:, None] + noise * rng.standard_normal((3, ROWS)))


def tables(*files: Floats) -> list[Table]:
    return [Table(dict(zip(NAMES, file, strict=True))) for file in files]


def in_parts(k: Floats, seed: int, share: float = 0.4, part: int = 256) -> Floats:
    """Words whose upper part is now and then that of the reading before."""
    late = np.random.default_rng(seed).random(len(k)) < share
    upper, lower = np.floor_divide(k, part), np.mod(k, part)
    before = np.append(upper[:1], upper[:-1])
    return np.where(late, before, upper) * part + lower


@pytest.mark.parametrize("bits", [8, 10, 12, 16, 24])
@pytest.mark.parametrize("seed", range(3))
def test_words_without_their_sign_get_it_back(bits: int, seed: int) -> None:
    one = 0.25 * 2 ** (bits - 1)
    noise = max(1.0, one / 200)
    meant = [counts(seed, (0.0, one, 0.0), noise), counts(seed + 9, (2 * noise, 6 * noise, -one), noise)]
    mended = with_words(tables(*(np.mod(k, 2.0**bits) for k in meant)))
    for one_run, k in zip(mended, meant, strict=True):
        # Of a run in which no axis leaps the others tell.
        assert all(np.array_equal(one_run.table.values[name], x) for name, x in zip(NAMES, k, strict=True))
        assert any(f"{bits} bits with a sign, read without" in note for note in one_run.notes)


def test_what_is_no_word_without_a_sign_stays() -> None:
    rng = np.random.default_rng(1)
    zero = counts(2, (0.0, 8192.0, 0.0))
    others = [
        zero,  # with their sign
        zero + 32768,  # about a middle
        np.mod(zero, 65536.0) * 0.061,  # no whole numbers
        np.stack([np.mod(100.0 * np.arange(ROWS), 65536)] * 3),  # a counter
        rng.integers(0, 65536, (3, ROWS)).astype(float),  # noise over all of the range
        np.maximum(zero, 0.0),  # clipped at nothing
    ]
    for k in others:
        (mended,) = with_words(tables(k))
        assert mended.notes == ()
        assert all(np.array_equal(mended.table.values[name], x) for name, x in zip(NAMES, k, strict=True))


@pytest.mark.parametrize("level", [0.0, 256.0, -512.0])
def test_words_read_in_two_parts_are_put_together(level: float) -> None:
    meant = counts(3, (level, 4000.0, -130.0), 6.0)
    read = np.stack([in_parts(k, seed) for seed, k in enumerate(meant)])
    assert (read[0] != meant[0]).sum() > 50
    (mended,) = with_words(tables(read))
    assert all(np.array_equal(mended.table.values[name], x) for name, x in zip(NAMES, meant, strict=True))
    assert len(mended.notes) == 1
    assert "leap by 256 counts" in mended.notes[0]


@pytest.mark.parametrize("size", [100.0, 256.0, 180.0])
def test_spikes_that_are_no_parts_of_words_stay(size: float) -> None:
    k = counts(4, (0.0, 90.0, 1000.0), 6.0)
    hit = np.random.default_rng(5).choice(ROWS, 40, replace=False)
    k[1, hit] += size  # about 90 no upper byte changes
    k[0, hit] += size if size != 256 else 150.0
    assert with_words(tables(k))[0].notes == ()


@pytest.mark.parametrize("step", [35, 70, 250])
def test_whole_numbers_that_are_multiples_of_a_step_are_no_torn_words(step: int) -> None:
    """Of a chip with 70 mdeg/s a count, logged in mdeg/s, a count is nearly 64: a noise of one count is no leap."""
    rng = np.random.default_rng(step)
    read = step * np.rint(-12 + 0.3 * rng.standard_normal((3, 3000)))
    (kept,) = with_words(tables(read))
    assert not kept.notes
    assert all(np.array_equal(kept.table.values[name], x) for name, x in zip(NAMES, read, strict=True))


@pytest.mark.parametrize("count", [1, 3])
def test_torn_words_of_a_step_are_put_together_as_well(count: int) -> None:
    meant = counts(3, (520.0, 4000.0, -130.0), 6.0)
    read = np.stack([in_parts(k, seed) for seed, k in enumerate(meant)])
    (mended,) = with_words(tables(count * read))
    assert all(np.array_equal(mended.table.values[name], count * x) for name, x in zip(NAMES, meant, strict=True))
    assert "leap by 256 counts" in mended.notes[0]


def test_a_manifest_of_such_words_is_drafted_and_read(tmp_path: Path) -> None:
    meant = np.concatenate([counts(1, (0.0, 0.0, 4096.0)), counts(2, (4096.0, 10.0, 0.0))], axis=1)
    rows = np.column_stack([np.arange(2 * ROWS) * 10, *np.mod(meant, 65536.0)]).astype(int)
    file = tmp_path / "log.csv"
    file.write_text("time_ms,ax,ay,az\n" + "\n".join(",".join(map(str, row)) for row in rows) + "\n")
    drafted = init([file], answers={"accel.unit": "0.000244140625 g", "procedure": "static"})
    assert any("16 bits with a sign" in note for note in drafted.draft.notes)
    (read,) = read_recordings(load_manifest(drafted.path))
    assert np.allclose(read.channels["accel_z"].values, meant[2] * 9.80665 / 4096)
    assert any("16 bits with a sign" in note for note in read.notes)


@pytest.mark.parametrize("bits", [8, 16])
def test_the_bits_are_those_of_the_range(bits: int) -> None:
    k = counts(6, (0.0, 0.0, 0.0), 3.0)[0]
    assert unsigned_bits(np.mod(k, 2.0**bits)) == bits
    assert np.array_equal(signed(np.mod(k, 2.0**bits), bits), k)
