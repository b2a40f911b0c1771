"""Words of a converter that were read wrong: without their sign, or in two parts while they changed.

**Without a sign.** A word of n bits that holds k < 0 reads 2^n + k: near zero it leaps by nearly 2^n from row to row.
With

    k' = k - 2^n   for k >= 2^(n-1)

these leaps are gone. n is told by the largest number of an instrument. One channel that shows it says it for all of its
kind: an axis that points downwards through a whole file does not leap.

**In two parts.** Where the lower byte comes from one reading and the upper one from the next, a word that crosses a
multiple of T = 2^m between them is off by T, and by nothing else: at rest, rows are T above or below the median around
them, and the median is near a multiple of T. T is taken out of them again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.recording import Floats
from insenv.core.series.robust import OF_MEDIAN
from insenv.data.manifest.spec import ACCELEROMETERS, GYROS
from insenv.data.readers import Table

#: Fewest bits of a word; share of its range by which a leap changes it at least, and what is left of one at most.
FEWEST_BITS, LEAPS, LEFT = 8, 0.75, 0.25
#: Fewest leaps, and the largest share of them that may be left.
FEWEST_LEAPS, MOST_LEFT = 2, 0.05
#: Bits of the lower part of a word that is read in two, rows of a median, and fewest rows that must be off.
PARTS, AROUND, FEWEST_TORN = (5, 6, 7, 8, 10, 12), 33, 12
#: How far off T, and how noisy around it, such rows are at most, as a share of T; least share of them that is off by T.
OFF_BY, NOISE, TORN_SHARE = 0.125, 0.0625, 0.8

#: Whole numbers that floating-point ones hold exactly are below this.
EXACT = 2.0**53

#: What is said of words that were read in two parts.
TORN = "its two parts were read one after the other; the leaps are taken out"


@dataclass(frozen=True)
class Mended:
    """A table whose words are right, and in sentences what was mended."""

    table: Table
    notes: tuple[str, ...] = ()


def with_words(tables: Sequence[Table]) -> list[Mended]:
    """The runs of one unit with the words of its instruments as they were meant."""
    mended = [Mended(table) for table in tables]
    for kind in (GYROS, ACCELEROMETERS):
        names = [name for name in kind if all(name in table.values for table in tables)]
        bits = max((unsigned_bits(table.values[name]) for table in tables for name in names), default=0)
        mended = [_of_run(one, names, bits) for one in mended]
    return mended


def _of_run(run: Mended, names: Sequence[str], bits: int) -> Mended:
    """One run with the words of one kind of instruments as they were meant."""
    values, notes = dict(run.table.values), list(run.notes)
    turned = [name for name in names if bits and is_unsigned(values[name], bits)]
    for name in turned:
        values[name] = signed(values[name], bits)
    if turned:
        notes.append(f"{', '.join(turned)}: {sentence(bits)}")
    for name in names:
        whole, size, rows = _without_torn(values[name])
        if rows:
            values[name] = whole
            notes.append(f"{name}: {rows} rows leap by {size} counts where the upper part of the word changes: {TORN}")
    return Mended(replace(run.table, values=values), tuple(notes)) if notes != list(run.notes) else run


def sentence(bits: int) -> str:
    """What is said of words that were read without their sign."""
    whole = 1 << bits
    return (
        f"leaps between 0 and {whole - 1}: {bits} bits with a sign, read without; {whole} is taken from {whole // 2} on"
    )


def unsigned_bits(values: Floats) -> int:
    """Bits of the words of a channel that leaps between both ends of their range, as signed ones read so; 0 if none."""
    if len(values) < 2 or values.min() < 0 or not (values == np.rint(values)).all():
        return 0
    bits = max(FEWEST_BITS, int(values.max()).bit_length())
    leaps = np.abs(np.diff(values)) > LEAPS * (1 << bits)
    if leaps.sum() < FEWEST_LEAPS:
        return 0
    left = np.abs(np.diff(signed(values, bits)))
    return bits if (left > LEFT * (1 << bits)).sum() <= MOST_LEFT * leaps.sum() else 0


def is_unsigned(values: Floats, bits: int) -> bool:
    """Whether a channel holds words of so many bits, some of them negative, that were read without their sign."""
    whole = values.min() >= 0 and values.max() < 1 << bits and bool((values == np.rint(values)).all())
    return whole and bool((values >= 1 << (bits - 1)).any())


def signed(values: Floats, bits: int) -> Floats:
    """The words with their sign."""
    return np.where(values >= 1 << (bits - 1), values - (1 << bits), values)


def _without_torn(values: Floats) -> tuple[Floats, int, int]:
    """The channel with T taken out of rows that are off by it, T in counts, and how many rows were."""
    from scipy.ndimage import median_filter  # slow to import

    if len(values) < AROUND or not ((np.abs(values) < EXACT) & (values == np.rint(values))).all():
        return values, 0, 0
    # Numbers that all are so many times a whole one are no counts, but what a program made of them.
    count = max(int(np.gcd.reduce(np.diff(values).astype(np.int64))), 1)
    middle = median_filter(values, AROUND, mode="nearest")
    off = values - middle
    noise = OF_MEDIAN * median_filter(np.abs(off), AROUND, mode="nearest")
    best, most = np.zeros(len(values), bool), 0
    for part in (count << bits for bits in PARTS):
        near = np.abs(middle - part * np.rint(middle / part)) <= 2 * OFF_BY * part
        at_rest = near & (noise <= NOISE * part)
        torn = at_rest & (np.abs(np.abs(off) - part) <= OFF_BY * part)
        far = at_rest & (np.abs(off) > 0.5 * part)
        if torn.sum() >= max(FEWEST_TORN, best.sum() + 1, TORN_SHARE * far.sum()):
            best, most = torn, part
    return np.where(best, values - np.sign(off) * most, values), most // count, int(best.sum())


def signed_columns(columns: Mapping[str, Floats]) -> tuple[dict[str, Floats], str]:
    """Columns of a file of which nothing else is known with their signs, and what is said of them; "" if nothing."""
    bits = max(map(unsigned_bits, columns.values()), default=0)
    if not bits:
        return dict(columns), ""
    # A clock or a counter of rows only rises.
    found = [
        name for name, x in columns.items() if is_unsigned(x, bits) and (unsigned_bits(x) or _at_both_ends(x, bits))
    ]
    mended = {name: signed(x, bits) if name in found else x for name, x in columns.items()}
    return mended, f"{', '.join(found)}: {sentence(bits)}"


def _at_both_ends(values: Floats, bits: int) -> bool:
    """Whether words lie near either end of their range, and do not only rise."""
    middle = (values > LEFT * (1 << bits)) & (values < LEAPS * (1 << bits))
    return not middle.any() and bool((np.diff(values) < 0).any())
