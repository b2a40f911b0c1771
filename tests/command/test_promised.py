"""The promised names: each is there, each is on the page, and importing insenv imports none of them."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import insenv

PAGE = Path(__file__).parents[2] / "docs" / "python.md"
NAMES = sorted(insenv._promised())


@pytest.mark.parametrize("name", NAMES)
def test_a_promised_name_is_there_and_has_words(name: str) -> None:
    found = getattr(insenv, name)
    assert callable(found) and inspect.getdoc(found)
    assert name in dir(insenv) and f"`insenv.{name}" in PAGE.read_text(encoding="utf-8")


def test_the_list_for_type_checkers_is_the_same() -> None:
    stub = Path(insenv.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    assert sorted(re.findall(r'^    "(\w+)",$', stub, re.MULTILINE)) == NAMES


def test_no_promised_name_hides_a_module() -> None:
    folder = Path(insenv.__file__).parent
    assert not {path.stem for path in folder.iterdir() if path.suffix in ("", ".py")} & set(NAMES)


def test_what_is_not_promised_is_not_there() -> None:
    with pytest.raises(AttributeError, match="module 'insenv' has no attribute 'closed_loop'"):
        getattr(insenv, "closed_loop")  # noqa: B009


def test_importing_insenv_imports_none_of_them() -> None:
    code = "import sys, insenv; assert not {'numpy', 'scipy', 'gymnasium', 'insenv.close'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
