"""The documentation against the code: examples run, and every name that a user may write is explained."""

from __future__ import annotations

import importlib.util
import re
import shlex
import sys
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import click
import made_findings
import msgspec
import numpy as np
import pytest

from insenv.cli import insenv
from insenv.data.manifest import schema as manifest_schema
from insenv.data.manifest.checks import NOISE, SUFFIXES, VELOCITY_RANDOM_WALK
from insenv.data.manifest.spec import CHANNELS
from insenv.effects.catalogue import ALL, CATALOGUE, by_key
from insenv.effects.own import RESERVED
from insenv.identify.findings import VERDICTS
from insenv.report import to_json
from insenv.scenario import schema as scenario_schema
from insenv.scenario.plant import TEMPERATURES
from insenv.scenario.turntable import PROFILES

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"# ([\w.]+\.toml)\n")


def text(page: str) -> str:
    return (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")


def blocks(path: Path) -> list[tuple[str, str]]:
    """Language and content of each fenced block."""
    return _BLOCK.findall(path.read_text(encoding="utf-8"))


def unexplained(page: str, names: set[str]) -> list[str]:
    """Those of ``names`` that stand nowhere in the page's code: blocks and what is between backticks."""
    whole = text(page)
    code = [content for _, content in _BLOCK.findall(whole)] + re.findall(r"`([^`\n]+)`", _BLOCK.sub("", whole))
    return sorted(names - set(re.findall(r"[\w-]+", " ".join(code))))


def keys_of(table: type) -> set[str]:
    """Keys of a TOML table and of the tables inside it."""
    keys: set[str] = set()
    for field in msgspec.structs.fields(table):
        keys.add(field.name)
        for kind in _structs(msgspec.inspect.type_info(field.type)):
            keys |= keys_of(kind)
    return keys


def _structs(node: Any) -> list[type]:
    if isinstance(node, msgspec.inspect.StructType):
        return [node.cls]
    if isinstance(node, msgspec.inspect.UnionType):
        return [kind for part in node.types for kind in _structs(part)]
    return _structs(node.item_type) if isinstance(node, msgspec.inspect.ListType) else []


def fromcode(name: str = "fromcode") -> ModuleType:
    """The Sphinx extension that fills pages from the code, or another module of the documentation."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# ------------------------------------------------------------------------------------------------- examples


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_python_examples_run(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One after the other, beside the TOML files that the page names in their first line."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    for language, content in blocks(path):
        if language == "toml" and (name := _FILE.match(content)):
            Path(name[1]).write_text(content, encoding="utf-8")
    names: dict[str, Any] = {"__name__": f"docs_{path.stem}"}
    # A module of its own, for dataclasses look their class's module up.
    monkeypatch.setitem(sys.modules, names["__name__"], ModuleType(names["__name__"]))
    for language, content in blocks(path):
        if language == "python":
            exec(compile(content, str(path), "exec"), names)


def test_there_are_python_examples() -> None:
    with_examples = {path.stem for path in PAGES if "python" in dict(blocks(path))}
    assert {"README", "quickstart", "development", "scenario"} <= with_examples


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_toml_examples_are_accepted(path: Path, tmp_path: Path) -> None:
    for language, content in blocks(path):
        if language != "toml":
            continue
        file = tmp_path / "example.toml"
        file.write_text(content, encoding="utf-8")
        if "instrument" in tomllib.loads(content):
            from insenv.scenario import load

            load(file)
        else:
            from insenv.data.manifest import load_manifest

            load_manifest(file)


def commands() -> list[str]:
    """Every line of a shell block that calls a command of insenv."""
    lines = [line for path in PAGES for lang, content in blocks(path) if lang == "sh" for line in content.split("\n")]
    called = {line for line in lines if line.startswith(("insenv ", ".venv/bin/insenv "))}
    return sorted(line for line in called if not line.split()[1].startswith("-"))


@pytest.mark.parametrize("line", commands())
def test_commands_have_the_options_that_the_pages_use(line: str) -> None:
    words = shlex.split(line)[1:]
    command = insenv.commands[words[0]]
    assert command.make_context(words[0], words[1:]).params


# ----------------------------------------------------------------------------------------- nothing left out


def test_every_option_of_the_command_is_explained() -> None:
    parts = re.split(r"^## insenv (\S+)\n", text("command"), flags=re.MULTILINE)[1:]
    sections = dict(zip(parts[::2], parts[1::2], strict=True))
    assert set(sections) == set(insenv.commands)
    for name, command in insenv.commands.items():
        for option in command.params:
            if isinstance(option, click.Option):
                assert f"| `{option.opts[0]}` |" in sections[name], f"{name} {option.opts[0]}"


@pytest.mark.parametrize(
    "table", [manifest_schema.ManifestTable, manifest_schema.ChannelTable], ids=lambda t: t.__name__
)
def test_every_key_of_a_manifest_is_explained(table: type) -> None:
    assert unexplained("manifest", keys_of(table)) == []


def test_every_channel_format_and_noise_of_a_manifest_is_explained() -> None:
    names = {*CHANNELS, *SUFFIXES.values(), *NOISE, VELOCITY_RANDOM_WALK}
    assert unexplained("manifest", names) == []


def test_every_key_of_a_scenario_is_explained() -> None:
    kinds = {*PROFILES, *TEMPERATURES, *(key for keys in PROFILES.values() for key in keys)}
    shared = keys_of(manifest_schema.HeldOutTable)  # explained with the manifest, to which the page refers
    inside = {"carriers"}  # no table of a file: it holds those of plants that systems bring
    assert unexplained("scenario", (keys_of(scenario_schema.ScenarioTable) | kinds) - shared - inside) == []


@pytest.mark.parametrize("findings", [made_findings.one_target(), made_findings.several_targets()])
def test_every_field_of_the_json_is_explained(findings: Any) -> None:
    document = to_json(findings)
    names = set(document)
    for block in ("added", "rejected", "not_testable", "next_experiment"):
        names |= {key for entry in document[block] for key in entry}
    assert unexplained("report", names) == []


def test_a_word_of_the_text_is_no_explanation() -> None:
    assert unexplained("manifest", {"target", "recording"}) == ["recording"]


def test_every_verdict_is_explained() -> None:
    for page in ("report", "method"):
        assert unexplained(page, set(VERDICTS)) == []


def test_every_effect_is_on_its_page() -> None:
    """Those of the catalogue with their parameters, and those whose names are reserved."""
    page = text("effects")
    for effect in CATALOGUE:
        row = next(line for line in page.split("\n") if line.startswith(f"| `{effect.id}`"))
        assert f"`{effect.linear[0].name}`" in row
        assert effect.source.replace("|", r"\|") in row
    assert {name for name in {*RESERVED, *(effect.id for effect in ALL)} if f"`{name}`" not in page} == set()


def test_constants_come_with_their_values() -> None:
    page = fromcode().constants()
    assert "| `search.scan.NULL_RUNS` | 200 |" in page
    assert page.count("\n") > 15


def test_the_pages_leave_room_for_what_comes_from_the_code() -> None:
    code = fromcode()
    for page in code.PAGES:
        assert text(page).count(code.MARK) == 1
    assert text("effects") == code.written(), "make format renews it"


def test_the_gallery_shows_every_effect() -> None:
    gallery = fromcode("gallery")
    whole = gallery.motion()
    assert not [effect.key for effect in ALL if effect.missing(whole)]
    for key in ("tone", "angle_random_walk", "scale_factor"):
        section = gallery._section(by_key(key), whole, np.random.default_rng(0).standard_normal(whole.n))
        assert section.count("<svg") == 3 and "nan" not in section


# ------------------------------------------------------------------------------- as GitHub shows the pages

ALL_PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
ALL_PAGES = [page for page in ALL_PAGES if "_build" not in page.parts]


def links(page: Path) -> list[tuple[str, str]]:
    """Text and target of each link and picture outside of code."""
    bare = re.sub(r"`[^`\n]*`", "code", _BLOCK.sub("", page.read_text(encoding="utf-8")))
    return re.findall(r"\[([^\[\]]*)\]\(([^()\s]+)\)", bare)


def anchors(page: Path) -> set[str]:
    """What GitHub calls the headings of a page."""
    bare = _BLOCK.sub("", page.read_text(encoding="utf-8"))
    headings = re.findall(r"^#+ (.+)$", bare, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: page.stem)
def test_every_link_has_a_text_and_leads_somewhere(page: Path) -> None:
    for shown, target in links(page):
        assert shown.strip(), f"{page.name}: the link to {target} has no text"
        file, _, anchor = target.partition("#")
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        there = (page.parent / file).resolve() if file else page
        assert there.exists(), f"{page.name}: {target} is not there"
        assert not anchor or anchor in anchors(there), f"{page.name}: {target}: no such heading"


@pytest.mark.parametrize("page", [page for page in ALL_PAGES if page.stem != "contents"], ids=lambda page: page.stem)
def test_every_page_is_plain_markdown(page: Path) -> None:
    """Directives and roles of Sphinx would be shown as they are typed; so would a placeholder."""
    whole = page.read_text(encoding="utf-8")
    outside = re.sub(r"<!--.*?-->", "", _BLOCK.sub("", whole), flags=re.DOTALL)
    assert not re.search(r"^(```|:::)\{", whole, re.MULTILINE), page
    assert not re.search(r"\{(doc|ref|term|numref)\}`|%[A-Z-]+%", outside), page


def test_the_layers_are_those_of_the_import_contract() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    layers = next(c for c in contracts if c["id"] == "layers")["layers"]
    wanted = [re.findall(r"\w+", layer) for layer in layers if "__main__" not in layer]
    drawn = next(content for _, content in blocks(ROOT / "docs" / "architecture.md") if content.startswith("systems "))
    found = [re.findall(r"\w+", re.split(r" {2,}", line)[0]) for line in drawn.splitlines()]
    assert found == wanted
