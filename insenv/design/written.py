"""A procedure as a scenario file: the scenario that it was designed for, its changes in it, and what it promises."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from insenv.core.files import write_whole
from insenv.scenario import load
from insenv.scenario.source import source

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_WIDTH = 116


def write_scenario(scenario: str, changes: Mapping[str, Any], promise: str, path: str | os.PathLike[str]) -> Path:
    """Write the changed scenario with a comment, whole or not at all, and read it back.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    written = write_whole(path, scenario_text(scenario, changes, promise))
    load(written)
    return written


def scenario_text(scenario: str, changes: Mapping[str, Any], promise: str) -> str:
    """The TOML text of a changed scenario under a comment."""
    tree, _ = source(scenario, changes)
    comment = "\n".join(f"# {line}" for line in _lines(promise))
    return comment + "\n" + "\n".join(_tables(tree, ()))


def _lines(text: str) -> Iterator[str]:
    line = ""
    for word in text.split():
        if line and len(line) + 1 + len(word) > _WIDTH:
            yield line
            line = word
        else:
            line = f"{line} {word}".strip()
    yield line


def _tables(tree: Mapping[str, Any], where: tuple[str, ...]) -> Iterator[str]:
    """Entries of a table, then the tables in it; those of the third level on are written inline."""
    deep = len(where) > 0
    own = {k: v for k, v in tree.items() if deep or not isinstance(v, Mapping)}
    yield from (f"{_key(key)} = {_value(value)}" for key, value in own.items())
    for key, value in tree.items():
        if key not in own:
            yield ""
            yield f"[{_key(key)}]"
            yield from _tables(value, (*where, key))
    if not where:
        yield ""


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(key)} = {_value(one)}" for key, one in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple):
        parts = [_value(one) for one in value]
        line = f"[{', '.join(parts)}]"
        return line if len(line) <= _WIDTH else "[\n" + "".join(f"    {part},\n" for part in parts) + "]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
