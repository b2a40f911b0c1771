"""A page of results: sections of Markdown with tables, pictures and a verdict each."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from matplotlib.figure import Figure
from pages import engine, written
from tqdm import tqdm


@dataclass(frozen=True)
class Section:
    """A part of the page: title, lines of Markdown, verdict, and pictures by the name of their file."""

    title: str
    lines: tuple[str, ...]
    verdict: str
    pictures: Mapping[str, Figure] = field(default_factory=dict)


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> tuple[str, ...]:
    """A table of Markdown."""
    return (
        "| " + " | ".join(header) + " |",
        "|" + " --- |" * len(header),
        *("| " + " | ".join(str(cell) for cell in row) + " |" for row in rows),
    )


def kept(folder: Path | None, script: Path, made: Mapping[str, Callable[[], Section]]) -> Iterator[Section]:
    """Sections without pictures, each kept in the folder: what today's engine made already is not made again."""
    mark = "" if folder is None else engine(script)
    for name, make in made.items():
        place = None if folder is None else folder / f"{name}_{mark}.json"
        if place is not None and place.exists():
            told = json.loads(place.read_text(encoding="utf-8"))
            yield Section(told["title"], tuple(told["lines"]), told["verdict"])
            continue
        section = make()
        if place is not None:
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(json.dumps(asdict(section)), encoding="utf-8")
        yield section


def write(path: Path, head: str, sections: Iterator[Section], count: int) -> None:
    """Write the page and its pictures; each of the ``count`` sections is worked out when its turn comes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = [head]
    for section in tqdm(sections, total=count, unit="section"):
        shown = [f"![{section.title}]({name}.png)\n" for name in section.pictures]
        text += [f"\n## {section.title}\n", *section.lines, "", *shown, f"**Verdict.** {section.verdict}"]
        for name, picture in section.pictures.items():
            picture.savefig(path.parent / f"{name}.png", dpi=110)
    written(path, "\n".join(text) + "\n")
