"""What pages show of the code, so that they cannot go stale.

``effects.md``: one section for each physical family (a module of `insenv.effects`), with the module's
docstring, which opens with its equations, and a table of its effects. It stands in the page itself, for those who read
it where Sphinx does not: ``python docs/fromcode.py`` renews it (`make format`), and tells with ``--check`` whether that
is to be done (`make check`). ``method.md``: the constants of `insenv.identify` with the comments above them, and
``gallery.md``: pictures of the effects (`gallery`), filled in by Sphinx.
"""

from __future__ import annotations

import inspect
import pkgutil
import re
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import groupby
from pathlib import Path
from typing import Any

import insenv.identify
from insenv.data.exposure import CHANNEL_OF
from insenv.effects.base import CurveEffect, DrivenEffect, Effect, LinearEffect, MemoryEffect, NoiseEffect, Param
from insenv.effects.own import ALL, CATALOGUE, RESERVED, TRIAD, TUMBLE

#: What stands in a page where text from the code is to come, at the build.
MARK = "<!-- %FROM-CODE% -->"
#: What stands in a page above the text from the code that is written into it, down to its end.
WRITTEN = "<!-- From the code, down to the end: make format renews it. -->"
#: From the special to the general: a `MemoryEffect` is a `CurveEffect` too.
_KINDS: tuple[type[Effect], ...] = (MemoryEffect, CurveEffect, LinearEffect, NoiseEffect, DrivenEffect)
_RULE = re.compile(r"^={3,}( +={3,})+$", re.MULTILINE)
#: Channels that a need stands for, where a page says more than the first of them.
_CHANNELS = {
    "rate": "table_rate or table_angle",
    "rate_edges": "table_rate or table_angle",
    "turn_rate": "table_rate or table_angle",
    "across": "an accelerometer at angles of a level `table_angle`",
    "force": "accel_x, accel_y, accel_z",
    "vibration": "accel_x, accel_y, accel_z",
    "cross_rate": "the other two axes",
}
#: A constant of a module, behind the comment that documents it.
_CONSTANT = re.compile(r"((?:^#: ?.*\n)+)^([A-Z][A-Z_, ]*) = ([0-9].*)$", re.MULTILINE)
_HEAD = "| identifier | what it is, its kind and source | parameters | needs |\n|---|---|---|---|"


def catalogue() -> str:
    """The catalogue as Markdown, and the names that are reserved for effects to come."""
    modules = list(dict.fromkeys(map(_module, ALL)))
    together = sorted(ALL, key=lambda effect: modules.index(_module(effect)))
    families = (_family(name, tuple(effects)) for name, effects in groupby(together, key=_module))
    return "\n\n".join([*families, _reserved()])


def _module(effect: Effect) -> str:
    return type(effect).__module__


def _family(module: str, effects: tuple[Effect, ...]) -> str:
    """Heading, equations and table of one module."""
    first, _, rest = (sys.modules.get(module) or import_module(module)).__doc__.strip().partition("\n")
    rows = [_row(tuple(same)) for _, same in groupby(effects, key=lambda effect: effect.id)]
    return "\n\n".join([f"## {first.rstrip('.:')}", _body(rest.strip("\n")), "\n".join([_HEAD, *rows])])


def _body(text: str) -> str:
    """A docstring as Markdown: its tables between rules are shown as they are typed."""
    parts = [
        f"```text\n{part}\n```" if _RULE.search(part) else part
        for part in re.split(r"\n{2,}(?! )", text)  # an indented block stays with the text before it
    ]
    return "\n\n".join(parts)


def _row(orders: tuple[Effect, ...]) -> str:
    """One row for an effect, whatever its orders."""
    effect = max(orders, key=lambda one: len(one.params))
    tried = f"order 1 to {len(orders)} tried" if len(orders) > 1 else ""
    places = ((CATALOGUE, tried), (TRIAD, "in several positions"), (TUMBLE, "on a dividing head"))
    note = next((words for those, words in places if effect in those), "in scenarios only")
    keys = f"`{effect.id}`" + (f" ({note})" if note else "")
    what = (type(effect).__doc__ or "").strip().partition("\n")[0]
    kind = next(kind.__name__ for kind in _KINDS if isinstance(effect, kind))
    cells = (keys, f"{what} *{kind}*. {effect.source}", _of_orders(effect, orders), _needs(effect))
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def _of_orders(effect: Effect, orders: tuple[Effect, ...]) -> str:
    """The parameters of an effect, and those of its orders that have other units."""
    listed = [_parameters(effect)]
    for order, other in enumerate(orders, start=1):
        if (own := _parameters(other)) not in listed and len(other.params) == len(effect.params):
            listed.append(f"order {order}: {own}")
    return "; ".join(listed)


def _parameters(effect: Effect) -> str:
    """Linear parameters, then shapes; a long row of alike coefficients is shortened."""
    listed = [_parameter(p) for p in effect.linear]
    if len(listed) > 4:
        listed = [listed[0], "...", listed[-1]]
    shapes = [f"shape {_parameter(p)}" for p in effect.shapes]
    return ", ".join([*listed, *shapes])


def _parameter(param: Param) -> str:
    return f"`{param.name}` [{param.unit}]"


def _needs(effect: Effect) -> str:
    """Channels of a manifest; instruments where not all can have the effect."""
    needs = [need.partition(".")[0] for need in effect.needs]
    channels = [_CHANNELS.get(need, CHANNEL_OF.get(need, need)) for need in needs]
    turned = "gyro" in effect.instruments
    channels += [f"a {'table rate' if turned else 'specific force'} that changes"] if effect.of_rate else []
    only = f"{effect.instruments[0]} only" if len(effect.instruments) == 1 else ""
    return "; ".join(filter(None, [*dict.fromkeys(channels), only])) or "nothing"


def _reserved() -> str:
    names = ", ".join(f"`{name}`" for name in RESERVED) or "none"
    return (
        f"## Names without a class\n\nOf effects that no class writes, and of errors of a table: {names}. A report may "
        "name `saturation`, found as equal largest values, and those of a table of several axes on such a table."
    )


def constants() -> str:
    """Table of the documented numbers in `insenv.identify`."""
    rows = [f"| `{name}` | {value} | {meaning} |" for name, value, meaning in _constants()]
    return "\n".join(["| constant | value | meaning |", "|---|---|---|", *rows])


def _constants() -> Iterator[tuple[str, str, str]]:
    """Name with its module, value and meaning of each."""
    for info in pkgutil.walk_packages(insenv.identify.__path__, "insenv.identify."):
        module = info.name.removeprefix("insenv.identify.")
        source = inspect.getsource(import_module(info.name))
        for comment, names, values in _CONSTANT.findall(source):
            meaning = " ".join(line.removeprefix("#:").strip() for line in comment.splitlines())
            yield ", ".join(f"{module}.{name}" for name in names.split(", ")), values, meaning


def _gallery() -> str:
    """Pictures of all effects; drawn where they are wanted, for it takes seconds."""
    sys.path.insert(0, str(Path(__file__).parent))
    from gallery import pictures

    return pictures()


PAGES: dict[str, Callable[[], str]] = {"method": constants, "gallery": _gallery}
_EFFECTS = Path(__file__).parent / "effects.md"


def written() -> str:
    """The page of effects as it should be."""
    above, mark, _ = _EFFECTS.read_text(encoding="utf-8").partition(WRITTEN)
    return f"{above}{mark}\n\n{catalogue()}\n"


def main() -> None:
    """Renew the page of effects; with --check say whether it is renewed."""
    found = written()
    if "--check" not in sys.argv:
        _EFFECTS.write_text(found, encoding="utf-8")
    elif _EFFECTS.read_text(encoding="utf-8") != found:
        sys.exit(f"{_EFFECTS}: is not what the code says; make format renews it")


def _fill(app: Any, docname: str, source: list[str]) -> None:
    del app
    if docname in PAGES:
        source[0] = source[0].replace(MARK, PAGES[docname]())


def _always_again(*given: Any) -> list[str]:
    """These pages are read at every build: what they show changes without their files."""
    del given
    return list(PAGES)


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", _fill)
    app.connect("env-get-outdated", _always_again)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    main()
