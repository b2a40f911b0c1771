"""A draft of a manifest: what each column is, how sure that is, and what must be asked.

Four ways to know a thing: the file states it (or the user answered it); its numbers leave one reading; it is assumed,
where no number depends on it or nobody writes it otherwise; or it is open. What would change a number is never assumed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

Sure = Literal["stated", "answered", "numbers", "assumed", "open"]
Extra = Mapping[str, str | bool | float | int]


#: What is declared of every channel.
DECLARED = ("bias",)


@dataclass(frozen=True)
class Choice:
    """A value of the manifest, None while it is open; how it is known, and how surely."""

    value: str | None
    why: str
    sure: Sure


@dataclass(frozen=True)
class Channel:
    """A line of ``[channels]``.

    Attributes
    ----------
    name : str
    column : str, int or None
        None: open, or the time, which is known by its rate.
    heading : str
        What a reader sees at the top of the column.
    unit : Choice
        Of a time without a column: its rate.
    extra : mapping
        Further keys: quantity, wrapped, offset.
    """

    name: str
    column: str | int | None
    heading: str
    unit: Choice
    extra: Extra = field(default_factory=dict)


@dataclass(frozen=True)
class Question:
    """What the file does not tell.

    Attributes
    ----------
    key : str
        Name of the question, as ``--set`` takes it: "gyro.unit".
    text : str
        The question in a sentence.
    hint : str
        What the numbers speak for, "" for nothing: an answer that a terminal offers.
    dimensions : tuple of str
        Of which a unit, or with ``quantity`` a number with its unit, is wanted; empty: one of ``choices``, or any text.
    choices : tuple of str
        Answers that are meant beside a unit.
    """

    key: str
    text: str
    hint: str = ""
    dimensions: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    quantity: bool = False


@dataclass(frozen=True)
class Draft:
    """What is known of a manifest, and the questions that are open, the first to be asked first.

    ``rest`` are the rows of a unit that moves in all others, which alone are fitted.
    """

    files: tuple[Path, ...]
    format: str
    rows: int
    channels: tuple[Channel, ...]
    questions: tuple[Question, ...] = ()
    targets: tuple[str, ...] = ()
    declared: tuple[str, ...] = DECLARED
    procedure: Choice = Choice("static", "no table", "assumed")
    mounting: Mapping[str, Choice] = field(default_factory=dict)
    read: Mapping[str, str | int] = field(default_factory=dict)
    resample: str | None = None
    rest: tuple[int, int] | None = None
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
