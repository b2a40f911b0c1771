"""Recordings that other people measured and published: where they come from, and their manifests.

A recording is looked for in the folder that ``INSENV_DATA`` names, then in the cache of this user, into which
`fetch` brings it. Both are laid out alike: the manifest of a recording names its files relative to the
folder, as in ``psins/lasergyro.imu``. A file counts only with the sha256 that its manifest states.
"""

from insenv.datasets.download import fetch
from insenv.datasets.listing import table
from insenv.datasets.local import load, locate
from insenv.datasets.registry import describe, manifest_path, names

__all__ = ["describe", "fetch", "load", "locate", "manifest_path", "names", "table"]
