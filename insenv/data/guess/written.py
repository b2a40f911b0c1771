"""A draft as text: the manifest with every open question marked, and the table that a terminal shows."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from insenv.core.files import toml_value
from insenv.data.guess.draft import Channel, Draft, Question
from insenv.data.manifest.schema import OPEN

#: What "sure" means, from the surest on.
SURE: Mapping[str, str] = {
    "stated": "the file says so",
    "answered": "you say so",
    "numbers": "its numbers leave one reading",
    "assumed": "nobody writes it otherwise; look at it",
    "open": "a question",
}
_WIDTH = 110


def manifest_text(draft: Draft, out: Path | None) -> str:
    """The manifest that ``out`` is to hold, with the paths of the data files relative to it."""
    folder = Path.cwd() if out is None else out.resolve().parent
    files = [Path(os.path.relpath(file.resolve(), folder)).as_posix() for file in draft.files]
    lines = [
        "# Written by insenv init. Behind each line stands how it is known; change what is wrong.",
        *(['# Put an answer in place of each "?": insenv close-loop waits for it.'] if draft.questions else []),
        f"title = {toml_value(draft.files[0].stem)}",
        f"data = {toml_value(files[0] if len(files) == 1 else files)}",
        f"format = {toml_value(draft.format)}",
    ]
    if draft.read:
        lines += ["", "[read]", *(f"{key} = {toml_value(value)}" for key, value in draft.read.items())]
    lines += ["", "[channels]", *_channels(draft)]
    if draft.mounting:
        lines += ["", "[mounting]"]
        for key, choice in draft.mounting.items():
            lines += _question_lines(draft, f"mounting.{key}")
            lines.append(f"{key} = {toml_value(OPEN if choice.value is None else choice.value)}  # {choice.why}")
    lines += ["", "[model]", *_model(draft)]
    if draft.resample:
        lines += ["", "[fit]", f'resample = "{draft.resample}"  # the rows are not evenly sampled']
    if draft.rest:
        lines += ["", "[fit]", f"rows = {[list(draft.rest)]}  # its longest rest; it moves in the others"]
    return "\n".join(lines) + "\n"


def _model(draft: Draft) -> Iterator[str]:
    asked = [q.key.removesuffix(".column") for q in draft.questions if q.key.endswith(".column")]
    targets = draft.targets or tuple(t for t in asked if t.startswith(("gyro", "accel"))) or ("gyro",)
    yield f"target = {toml_value(targets[0] if len(targets) == 1 else list(targets))}"
    yield f"declared = {toml_value(list(draft.declared))}  # the errors that your model has already"
    yield from _question_lines(draft, "procedure")
    if draft.procedure.value != "static" or draft.procedure.sure == "answered":
        value = OPEN if draft.procedure.value is None else draft.procedure.value
        if value != "rate-table":
            yield f"procedure = {toml_value(value)}  # {draft.procedure.why}"


def _channels(draft: Draft) -> Iterator[str]:
    asked: set[str] = set()
    for channel in draft.channels:
        for key in (f"{_kind(channel)}.offset", f"{_kind(channel)}.unit", f"{_kind(channel)}.rate"):
            if key not in asked:
                asked.add(key)
                yield from _question_lines(draft, key)
        yield f"{channel.name} = {{ {', '.join(_entries(channel))} }}{_why(channel)}"
    names = {channel.name for channel in draft.channels}
    for question in draft.questions:
        if question.key in ("columns", "table.is") or question.key.endswith(".column"):
            yield from _question_lines(draft, question.key)
            name = {"columns": "gyro", "table.is": "table_rate"}.get(question.key, question.key.partition(".")[0])
            if name not in names:
                yield f'{name} = {{ column = "{OPEN}", unit = "{OPEN}" }}'


def _kind(channel: Channel) -> str:
    """What a question calls a channel: the gyros are asked together."""
    kind = channel.name.split("_")[0]
    return kind if kind in ("gyro", "accel") else channel.name


def _entries(channel: Channel) -> Iterator[str]:
    if channel.name == "time" and channel.column is None:
        yield f"rate = {toml_value(OPEN if channel.unit.value is None else channel.unit.value)}"
        return
    yield f"column = {toml_value(OPEN if channel.column is None else channel.column)}"
    if channel.unit.value != "":
        yield f"unit = {toml_value(OPEN if channel.unit.value is None else channel.unit.value)}"
    yield from (f"{key} = {toml_value(value)}" for key, value in channel.extra.items())


def _why(channel: Channel) -> str:
    heading = f"{channel.heading}: " if isinstance(channel.column, int) and channel.heading else ""
    return f"  # {heading}{channel.unit.why}"


def _question_lines(draft: Draft, key: str) -> Iterator[str]:
    """The question of ``key`` as comments, if it is open."""
    for question in draft.questions:
        if question.key == key:
            yield from (f"# ? {line}" for line in textwrap.wrap(_with_hint(question), _WIDTH))


def _with_hint(question: Question) -> str:
    return f"{question.text} The numbers speak for {question.hint}." if question.hint else question.text


# ---------------------------------------------------------------------------------------------- for a terminal


def rows(draft: Draft) -> Sequence[tuple[str, str, str, str, str]]:
    """The table: channel, column, unit or value, how sure, how it is known."""
    found = []
    for channel in draft.channels:
        column = channel.heading or ("" if channel.column is None else f"column {channel.column}")
        unit = OPEN if channel.unit.value is None else channel.unit.value
        extra = "".join(f", {_extra(key, value)}" for key, value in channel.extra.items())
        found.append((channel.name, column, f"{unit}{extra}".removeprefix(", "), channel.unit.sure, channel.unit.why))
    for key, choice in draft.mounting.items():
        found.append((key, "", OPEN if choice.value is None else choice.value, choice.sure, choice.why))
    procedure = draft.procedure
    found.append(("procedure", "", procedure.value or OPEN, procedure.sure, procedure.why))
    if draft.resample:
        found.append(("resample", "", draft.resample, "numbers", "the rows are not evenly sampled"))
    return found


def _extra(key: str, value: object) -> str:
    if value is True:
        return key
    return str(value) if key == "quantity" else f"{key} {value}"


def question_text(question: Question) -> str:
    """A question with its name, as ``--set`` takes it."""
    return f"{question.key}: {_with_hint(question)}"
