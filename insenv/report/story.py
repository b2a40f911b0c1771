"""How a recording was settled, as a summary and as JSON by the contract ``insenv.close-loop-story/1`` (SI units)."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

from insenv.core.files import json_text, write_whole
from insenv.core.filing import stamp
from insenv.core.quantities import ShownUnit, number, span, unit_for
from insenv.core.units import ARCSEC, PPM
from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.story import Chapter, FirstRun, Story, Wanted
from insenv.report import words
from insenv.report.json import strict
from insenv.report.json import to_json as findings_json

SCHEMA = "insenv.close-loop-story/1"
#: A standard deviation of an angle beyond this is no knowledge of it [rad].
_LITTLE = 3600 * ARCSEC

Block = dict[str, Any]

_NAMES = {"azimuth": "north", "installation_angle": "the installation angle", ScaleFactor.id: "the scale factor"}
_ENDINGS = {
    "settled": "Nothing is confounded any more.",
    "budget": "The instrument time is spent before it is settled.",
    "no-procedure": "No procedure that this environment can play is left: it is not settled.",
}


def to_json(story: Story) -> Block:
    """A story as plain dictionaries, lists, texts and finite numbers."""
    wanted = story.wanted
    block = {
        "schema": SCHEMA,
        "scenario": story.scenario,
        "seed": story.seed,
        "budget_s": story.budget,
        "ending": story.ending,
        "verdict": story.verdict,
        "wanted": None
        if wanted is None
        else {"name": wanted.name, "unit": wanted.unit, "demanded": wanted.demanded, "estimator": wanted.estimator},
        "before": _answer(story.raw),
        "steps": [_step(chapter) for chapter in story.chapters],
        **stamp(),
    }
    return {key: strict(value) for key, value in block.items()}


def write_json(story: Story, path: str | os.PathLike[str]) -> Path:
    """Write `to_json` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, json_text(to_json(story)))


def _step(chapter: Chapter) -> Block:
    return {
        "procedure": chapter.procedure,
        "separates": list(chapter.separates),
        "expected_separation_sigma": chapter.expected_sigma,
        "profile": dict(chapter.profile),
        "changes": dict(chapter.changes),
        "duration_s": chapter.duration,
        "elapsed_s": chapter.elapsed,
        "verdict": chapter.found.verdict,
        "after": _answer(chapter.answer),
        "own_estimate": _answer(chapter.own),
        "found": findings_json(chapter.found),
    }


def _answer(answer: FirstRun | None) -> Block | None:
    return None if answer is None else {"error": answer.error, "sd": answer.sd}


def summary(story: Story, width: int = 100) -> str:
    """A story as text of at most ``width`` columns; no final line break."""
    lines = [*_paragraph(headline(story), width), ""]
    for k, chapter in enumerate(story.chapters, 1):
        lines += _paragraph(f"{k}. {sentence(chapter.procedure)} ({span(chapter.duration)})", width)
        for line in filter(None, (why(chapter), *chapter_lines(story, k - 1))):
            lines += _paragraph(line, width, "   ")
    lines += ["", *_paragraph(ending(story), width)]
    return "\n".join("".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in line) for line in lines)


def headline(story: Story) -> str:
    """What it is about."""
    about = f"{story.title or story.scenario}, instrument {story.seed}"
    if story.raw is None or story.wanted is None:
        return f"{about}."
    found = f"the error of {quantity_name(story.wanted)} by {story.wanted.estimator} is {shown(story, story.raw)}"
    return f"{about}: as measured, {found}."


def why(chapter: Chapter) -> str:
    """What an experiment was to tell apart; nothing for the first run."""
    if not chapter.separates:
        return ""
    sigma = "" if chapter.expected_sigma is None else f", with {number(chapter.expected_sigma, 2)} standard deviations"
    return f"To tell {words.listing(map(words.name, chapter.separates))} apart{sigma}."


def chapter_lines(story: Story, index: int) -> Iterator[str]:
    """What an experiment and all before it told: verdict, effects, error."""
    chapter = story.chapters[index]
    several = len(chapter.found.targets) > 1
    yield f"Verdict: {chapter.found.verdict}."
    for target in chapter.found.targets:
        where = f" on {target.target}" if several else ""
        for added in target.added:
            rivals = added.confounded_with
            other = f", which may as well be {words.listing(map(words.name, rivals), 'or')}" if rivals else ""
            yield f"Found{where}: {words.name(words.key_of(added))}{other}."
    if story.wanted is not None and chapter.answer is not None:
        name, error = quantity_name(story.wanted), shown(story, chapter.answer)
        yield f"Error of {name} with that taken out of the first run: {error}."
        if doubtful(chapter):
            yield "No unique cause can be named."


def ending(story: Story) -> str:
    """How it ends, and what it was worth."""
    said = f"{_ENDINGS[story.ending]} {span(story.chapters[-1].elapsed)} of {span(story.budget)} were used."
    last = story.chapters[-1].answer
    if story.wanted is None or story.raw is None or last is None:
        return said
    unit = unit_of(story)
    return (
        f"{said} Error of {quantity_name(story.wanted)}: {number(unit.of(story.raw.error))} {unit.label} before, "
        f"{number(unit.of(last.error))} {unit.label} after."
    )


def doubtful(chapter: Chapter) -> bool:
    """Whether the loop's own estimate says that nothing is known."""
    return chapter.own is not None and chapter.own.sd > _LITTLE


def quantity_name(wanted: Wanted) -> str:
    """In plain words."""
    return _NAMES.get(wanted.name, wanted.name)


def unit_of(story: Story) -> ShownUnit:
    """One unit for all errors of a story."""
    if story.wanted is None:
        return ShownUnit("", 1.0)
    if story.wanted.unit == "1":
        return ShownUnit("ppm", PPM)
    last = story.chapters[-1].answer
    return unit_for(story.wanted.unit, *(() if last is None else (last.error, last.sd)))


def shown(story: Story, answer: FirstRun) -> str:
    """An error beside the standard deviation that was told with it."""
    unit = unit_of(story)
    return f"{number(unit.of(answer.error))} {unit.label} (claimed: ± {number(unit.of(answer.sd), 2)})"


def sentence(text: str) -> str:
    """With a capital letter."""
    return text[:1].upper() + text[1:]


def _paragraph(text: str, width: int, indent: str = "") -> Sequence[str]:
    return wrap(text, width, initial_indent=indent, subsequent_indent=indent, break_long_words=False)
