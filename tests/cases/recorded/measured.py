"""Where the tests find measured recordings: in ``INSENV_DATA``, beside the repository, or in the cache."""

from __future__ import annotations

from pathlib import Path

import pytest

from insenv.data.manifest import Manifest, load_manifest
from insenv.datasets import local, registry

#: As the environment stood when the tests were collected; single tests change it.
FOLDERS = (local.given_folder(), Path(__file__).parents[3] / "shared" / "data", local.cache())


def manifest(name: str) -> Manifest:
    """Manifest of the recording ``name`` with its data; skips the test where they are not on this machine."""
    wanted = [file.path for file in registry.files(name)]
    for folder in FOLDERS:
        if folder is not None and all((folder / path).is_file() for path in wanted):
            return load_manifest(registry.manifest_path(name), folder=folder)
    pytest.skip(
        f"the measured recording {name!r} is not here: `insenv datasets --fetch {name}` brings it, "
        f"or {local.VARIABLE} may name a folder that has it"
    )
