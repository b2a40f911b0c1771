"""Which recordings there are, and what their manifests say of the files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from insenv.core.errors import InputError

#: Name of each recording and the size of its files together [bytes], to be told before they are fetched.
SIZES: Mapping[str, int] = {
    "psins_lasergyro": 2_665_416,
    "tofupilot_thermal": 962_493,
    "ln100_updown": 2_152_248,
    "imu_tk": 6_652_750,
    "mikoff_imu0": 805_740,
    "mikoff_imu1": 806_745,
    "imucal": 995_473,
    "mahmood": 28_620,
    "xio_fusion": 1_410_960,
    "tomisuarez": 310_525,
    "bmi270": 297_057,
    "adis16405": 3_200_168,
}
_MANIFESTS = Path(__file__).parent / "manifests"


@dataclass(frozen=True)
class RemoteFile:
    """One published file: ``path`` relative to the data folder, where it is published, and its hash (hex)."""

    path: Path
    url: str
    sha256: str


def names() -> tuple[str, ...]:
    """Names of the recordings."""
    return tuple(SIZES)


def manifest_path(name: str) -> Path:
    """Manifest of the recording ``name``, inside the package.

    Raises
    ------
    InputError
        If there is no such recording.
    """
    if name not in SIZES:
        near = get_close_matches(name, SIZES, 1)
        wanted = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(SIZES)}"
        raise InputError(f"no recording {name!r}; {wanted}")
    return _MANIFESTS / f"{name}.toml"


def describe(name: str) -> str:
    """What the recording ``name`` is, who published it, and under which licence: one line.

    Raises
    ------
    InputError
        If there is no such recording.
    """
    from insenv.data.manifest import load_manifest  # here, so that asking for names costs nothing

    manifest = load_manifest(manifest_path(name))
    source = manifest.source
    assert source is not None, f"{name}: a published recording has a [source]"
    return f"{manifest.title} ({source.repository} at {source.commit[:12]}, {source.licence})"


def files(name: str) -> tuple[RemoteFile, ...]:
    """The files of the recording ``name``, in the order of its runs, then those that single channels have.

    Raises
    ------
    InputError
        If there is no such recording.
    """
    from insenv.data.manifest import load_manifest

    manifest = load_manifest(manifest_path(name), folder=Path())
    source = manifest.source
    assert source is not None, f"{name}: a published recording has a [source]"
    own = dict.fromkeys(spec.file for spec in manifest.channels.values() if spec.file is not None)
    return tuple(
        RemoteFile(file, url, sha256)
        for file, url, sha256 in zip([*(r.file for r in manifest.runs), *own], source.url, source.sha256, strict=True)
    )
