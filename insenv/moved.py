"""Modules by the names of the release before: they are the same objects, and the import warns.

What stands in `MOVED` was documented under its old name. The table goes with the next release.
"""

from __future__ import annotations

import importlib
import sys
import warnings
from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

#: Old name -> new name.
MOVED = {
    "estimators.horizon": "estimators.common.horizon",
    "estimators.north_gls": "estimators.north_finder.gls",
    "estimators.rate_gls": "estimators.rate_table.rate_gls",
    "estimators.rate_policies": "estimators.common.rate_policies",
    "estimators.static_alignment": "estimators.at_rest.static_alignment",
    "estimators.static_bias": "estimators.at_rest.static_bias",
    "insenv.core.allan": "insenv.core.series.allan",
    "insenv.core.exposure": "insenv.data.exposure",
    "insenv.core.load": "insenv.data.load",
    "insenv.core.manifest": "insenv.data.manifest",
    "insenv.core.strapdown": "insenv.navigation.strapdown",
    "insenv.core.strapdown_kernel": "insenv.navigation.kernel",
    "insenv.core.strapdown_truth": "insenv.navigation.truth",
    "insenv.design.alignment": "insenv.information.alignment",
    "insenv.design.alignment_response": "insenv.information.alignment_response",
    "insenv.design.information": "insenv.information.fisher",
    "insenv.design.means": "insenv.information.means",
    "insenv.design.north": "insenv.information.north",
    "insenv.design.scale_factor": "insenv.information.scale_factor",
    "insenv.design.sensitivity": "insenv.information.sensitivity",
    "insenv.design.table_motion": "insenv.information.table_motion",
    "insenv.effects.scale": "insenv.effects.rate.scale",
    "insenv.envs.asked": "insenv.envs.setup",
    "insenv.envs.north_finder": "insenv.systems.north_finder.env",
    "insenv.envs.two_position": "insenv.systems.two_position.env",
    "insenv.identify.problem": "insenv.identify.fit.problem",
    "insenv.procedure.north_finder": "insenv.systems.north_finder.procedure",
    "insenv.procedure.rate_table": "insenv.systems.rate_table.procedure",
    "insenv.procedure.two_position": "insenv.systems.two_position.procedure",
    "insenv.procedure": "insenv.design",
}


class _Same:
    """Gives the module as it is, under another name too."""

    def __init__(self, module: ModuleType) -> None:
        self.module, self.spec = module, module.__spec__

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module itself: nothing is made."""
        return self.module

    def exec_module(self, module: ModuleType) -> None:
        """Keep what the module is called: nothing is run again."""
        module.__spec__ = self.spec  # the import has just written the old name into it


class _Finder:
    """Finds what has moved."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Spec of the module that now has another name; None for all others."""
        old = next((old for old in MOVED if f"{fullname}.".startswith(f"{old}.")), None)
        if old is None:
            return None
        new = MOVED[old] + fullname[len(old) :]
        warnings.warn(f"{fullname} is now {new}; the old name goes with the next release", DeprecationWarning, 2)
        return ModuleSpec(fullname, _Same(importlib.import_module(new)))  # type: ignore[arg-type]


def install() -> None:
    """Let imports by the old names work; once is enough."""
    if not any(isinstance(one, _Finder) for one in sys.meta_path):
        sys.meta_path.insert(0, _Finder())  # before the one that would load a moved package's files a second time
