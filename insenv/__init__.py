"""insenv: stepwise environments, calibration and closed-loop error attribution for inertial instruments.

Conventions, said once
----------------------
Frames
    Navigation frame ENU (east, north, up), body frame RFU (right, forward, up).
    An angle is counter-clockwise-positive about up unless its name says azimuth (clockwise from north).
Units
    SI and radians inside, temperature in kelvin. Other units live at the border only: manifests, readers,
    reports, and arguments whose name carries the unit (``rate_deg_s``).
Shapes
    Time is the last axis. A batch of runs stands in front of it: ``(..., n)``; one run is a batch of one.
Intervals
    Instruments integrate. A sample stands for the interval that ends at its time, so ``n`` intervals have
    ``n + 1`` edges: what is a state (angle, temperature) is given at the edges, what is a rate is given as
    the mean over the interval.
Randomness
    Generators live at the outer edge; kernels take unit normals and carry state in and out.
    Row ``i`` of a batch is the run with seed ``seed + i``, bit for bit.

The promised names stand in ``__init__.pyi`` (`insenv.close_loop`, `insenv.simulate`, `insenv.Recording`): each is
imported when it is used, so that ``import insenv`` costs next to nothing.
"""

from __future__ import annotations

import sys
import warnings
from typing import TYPE_CHECKING

from insenv.core.version import VERSION
from insenv.moved import install

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

__version__ = VERSION


def _promised() -> Mapping[str, tuple[str, str]]:
    """Module and attribute of each promised name."""
    import re
    from pathlib import Path

    text = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    return {name: (module, own) for module, own, name in re.findall(r"^from (\S+) import (\w+) as (\w+)$", text, re.M)}


def __getattr__(name: str) -> object:
    if name.startswith("__") or (found := _promised().get(name)) is None:
        raise AttributeError(f"module 'insenv' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(found[0]), found[1])


def __dir__() -> list[str]:
    return sorted({*globals(), *_promised()})


_REGISTRATION = "gymnasium.envs.registration"


def _register() -> None:
    """Tell gymnasium of the environments, by name: what they need is imported when one is made."""
    from gymnasium.envs.registration import register, registry

    from insenv.core.errors import InputError
    from insenv.core.system import systems

    try:
        found = systems()
    except InputError as error:  # `import gymnasium` goes on; every command says the same
        warnings.warn(f"the environments of insenv are not there: {error}", stacklevel=2)
        return
    for one in found.values():
        if one.id not in registry:
            register(id=one.id, entry_point=one.environment, vector_entry_point=one.vector)


class _WithGymnasium:
    """Registers the environments when gymnasium is imported: `insenv --version` need not wait for it."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Spec of gymnasium's registration, whose module registers ours at its end; of nothing else."""
        if fullname != _REGISTRATION:
            return None
        import importlib.util

        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is None or spec.loader is None:
            return None
        execute = spec.loader.exec_module

        def then_register(module: ModuleType) -> None:
            execute(module)
            _register()

        spec.loader.exec_module = then_register  # type: ignore[method-assign]
        return spec


install()
if _REGISTRATION in sys.modules:
    _register()
else:
    sys.meta_path.insert(0, _WithGymnasium())
