"""From a data file to its manifest: read, guess, ask, write.

Where there is a terminal the open questions are asked, one by one: an answer may settle the next. Where there is
none they are written into the manifest, which then waits for them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from insenv.core.errors import InputError
from insenv.core.files import write_whole
from insenv.core.names import is_standard_output
from insenv.core.units import quantity, scale_to_si
from insenv.data.guess.decide import draft
from insenv.data.guess.draft import Draft, Question
from insenv.data.guess.heading import is_unit
from insenv.data.guess.listing import listing
from insenv.data.guess.written import manifest_text
from insenv.data.manifest.schema import DATA

#: Asks a question, and gives the answer; None ends the asking.
Ask = Callable[[Draft, Question], str | None]


@dataclass(frozen=True)
class Written:
    """The draft of a manifest, and where it was written."""

    draft: Draft
    path: Path


def init(
    data: Sequence[Path],
    out: Path | None = None,
    answers: Mapping[str, str] | None = None,
    ask: Ask | None = None,
    force: bool = False,
) -> Written:
    """Write the manifest of data files, runs of one instrument.

    Parameters
    ----------
    data : sequence of Path
    out : Path, optional
        Where to write it; beside the first data file by default, with the suffix ``.toml``.
    answers : mapping, optional
        What is known beforehand, as "gyro.unit" to "deg/s".
    ask : callable, optional
        Without it questions stay open, and are marked in the manifest.
    force : bool
        Whether a file that is there may be replaced.

    Raises
    ------
    InputError
        If a file cannot be read, the manifest is there already, or an answer is none.
    """
    out = data[0].with_suffix(".toml") if out is None else out
    if not is_standard_output(out) and out.exists() and not force:
        raise InputError(f"{out}: is there already; wanted --force to replace it, or another name with --out")
    listings = [listing(path) for path in data]
    given = dict(answers or {})
    made = draft(listings, given)
    check_keys(given, made)
    while ask is not None and made.questions:
        answer = ask(made, made.questions[0])
        if answer is None:
            break
        given[made.questions[0].key] = answer
        made = draft(listings, given)
    write_whole(out, manifest_text(made, None if is_standard_output(out) else out))
    return Written(made, out)


#: Questions that there are; a channel's column may be asked too.
KEYS = ("columns", "time.unit", "time.rate", "gyro.unit", "gyro.offset", "accel.unit", "accel.offset") + (
    "table_rate.unit",
    "table_angle.unit",
    "table.is",
    "temperature.unit",
    "mounting.tilt",
    "mounting.axes",
    "mounting.table_axis",
    "procedure",
)


def check_keys(answers: Mapping[str, str], made: Draft) -> None:
    """Refuse answers to what is no question.

    Raises
    ------
    InputError
        If there is one; names the nearest.
    """
    from insenv.core.errors import nearest
    from insenv.data.manifest.spec import CHANNELS

    known = [*KEYS, *(f"{channel}.column" for channel in CHANNELS)]
    for key in answers:
        if key not in known:
            raise InputError(f"--set {key}: no such question; {nearest(key, known)}")


def fault(question: Question, answer: str) -> str:
    """What is wrong with an answer; "" where it is one."""
    if answer in question.choices or (not question.dimensions and not question.choices):
        return ""
    if not question.dimensions:
        return f"wanted one of {', '.join(question.choices)}"
    try:
        if question.quantity:
            quantity(answer, question.dimensions[0], "")
        elif not any(is_unit(answer, dimension) for dimension in question.dimensions):
            scale_to_si(answer, question.dimensions[0], "")
    except InputError as error:
        return str(error).strip()
    return ""


def is_data(path: Path) -> bool:
    """Whether a file is one of data, given where a manifest might be: by its suffix, or because it is no TOML."""
    if path.suffix.lower() == ".toml" or not path.is_file():
        return False
    if path.suffix.lower() in DATA:
        return True
    try:
        tomllib.loads(path.read_bytes()[:1_000_000].decode())
    except ValueError:
        return True
    return False


def manifest_beside(data: Path) -> Path | None:
    """The manifest beside a data file that is of this file, if there is one.

    Raises
    ------
    InputError
        If what stands under its name is of other data.
    """
    path = data.with_suffix(".toml")
    if not path.exists():
        return None
    try:
        found = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        found = {}
    files = found.get("data", [])
    named = [files] if isinstance(files, str) else files
    named = [*named, *(run.get("file") for run in found.get("runs", []) if isinstance(run, dict))]
    if any(isinstance(name, str) and (path.parent / name).resolve() == data.resolve() for name in named):
        return path
    hint = f"wanted its manifest written elsewhere: insenv init {data} --out NAME.toml"
    raise InputError(f"{path}: is no manifest of {data.name}; {hint}")
