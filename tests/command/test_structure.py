"""Facts about how the code is built: no circle of imports, small folders, short functions.

And plants and effects that say of themselves what others must know.
"""

from __future__ import annotations

import ast
from collections import Counter
from functools import cache
from pathlib import Path

from insenv.effects.own import ALL
from insenv.plants.base import Plant
from insenv.plants.static import StaticBase
from insenv.plants.turntable import Turntable
from insenv.plants.vehicle import Vehicle

ROOT = Path(__file__).parents[2]
#: Modules of a folder, and lines of a function, at most.
FOLDER, FUNCTION = 20, 60
#: Loops that numba compiles as one function: in pieces they would hand dozens of numbers to and fro.
COMPILED = {
    "estimators/north_finder/kernel.py:accumulate",
    "estimators/two_position/alignment_kernel.py:gather",
    "estimators/two_position/joint_kernel.py:gather",
    "estimators/two_position/rests_ahead.py:_looked",
}
#: Names of effects outside insenv.effects, at most: 31 now, half of them below the effects (readers, units) or
#: words that are also names of other things (the bias of an estimator). Who must know one effect names its class.
IDS = 35

#: Public classes that share their name with another one, at most; those of a part that each system has apart.
HOMONYMS, OF_EACH_SYSTEM = 24, {"Electronics", "History", "Renderer", "View"}


@cache
def trees() -> dict[str, ast.Module]:
    """Syntax tree of every module of the packages, by its path from the root of the repository."""
    paths = (path for root in ("insenv", "estimators") for path in (ROOT / root).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in sorted(paths)}


def imports() -> dict[str, set[str]]:
    """Modules that each module of the packages imports, inside functions and for type checkers too."""
    modules = {_module(path): tree for path, tree in trees().items()}
    found: dict[str, set[str]] = {}
    for name, tree in modules.items():
        told = found[name] = set()
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                inner = {f"{node.module}.{one.name}" for one in node.names}
                told |= inner & modules.keys() or {node.module} & modules.keys()
            elif isinstance(node, ast.Import):
                told |= {one.name for one in node.names} & modules.keys()
        told.discard(name)
    return found


def _module(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def test_no_modules_import_each_other_in_a_circle() -> None:
    left = imports()
    while free := {name for name, told in left.items() if not told & left.keys()}:
        left = {name: told for name, told in left.items() if name not in free}
    assert {name: sorted(told & left.keys()) for name, told in left.items()} == {}


def test_nobody_but_a_system_asks_which_plant_it_is() -> None:
    plants = {kind.__name__ for kind in (Plant, StaticBase, Turntable, Vehicle)}
    asked = [
        f"{path}:{node.lineno}"
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance"
        if plants & {name.id for name in ast.walk(node.args[1]) if isinstance(name, ast.Name)}
    ]
    assert [place for place in asked if not place.startswith("insenv/systems/")] == []


def test_names_of_effects_stay_where_the_effects_are() -> None:
    ids = {effect.id for effect in ALL}
    outside = sum(
        isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.partition(":")[0] in ids
        for path, tree in trees().items()
        if not path.startswith("insenv/effects/")
        for node in ast.walk(tree)
    )
    assert outside <= IDS


def test_a_name_of_a_class_has_one_meaning() -> None:
    classes = Counter(
        node.name
        for tree in trees().values()
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert len({name for name, n in classes.items() if n > 1} - OF_EACH_SYSTEM) <= HOMONYMS


def test_folders_are_small() -> None:
    roots = ("insenv", "estimators", "scripts", "tests")
    counts = Counter(str(path.parent.relative_to(ROOT)) for root in roots for path in (ROOT / root).rglob("*.py"))
    assert {folder: n for folder, n in counts.items() if n > FOLDER} == {}


def test_functions_are_short() -> None:
    long = {
        f"{path}:{node.name}": length
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and (length := _lines(node)) > FUNCTION
    }
    assert long.keys() - COMPILED == set(), long


def _lines(node: ast.FunctionDef) -> int:
    """Lines of a function without its docstring."""
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    return 0 if not body else (body[-1].end_lineno or 0) - body[0].lineno + 1
