"""Modules that have moved are found by the names of the release before, and say so."""

from __future__ import annotations

import importlib
import sys
import warnings

import pytest

from insenv.moved import MOVED


@pytest.mark.parametrize("old", sorted(MOVED))
def test_the_old_name_is_the_same_module_and_warns(old: str) -> None:
    new = importlib.import_module(MOVED[old])
    name, own = new.__name__, new.__spec__
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            assert importlib.import_module(old) is new
    finally:
        for one in (old, old.rpartition(".")[0]):
            if one in sys.modules and sys.modules[one].__name__ != one:  # an old name
                del sys.modules[one]
    assert f"{old} is now {MOVED[old]}; the old name goes with the next release" in [str(each.message) for each in told]
    assert new.__name__ == name
    assert new.__spec__ is own


def test_a_module_of_a_package_that_has_moved_is_the_same_too() -> None:
    try:
        with warnings.catch_warnings(action="ignore"):
            old = importlib.import_module("insenv.core.manifest.spec")
    finally:
        for one in [name for name in sys.modules if name.startswith("insenv.core.manifest")]:
            del sys.modules[one]
    assert old is importlib.import_module("insenv.data.manifest.spec")
