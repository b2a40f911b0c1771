"""The list of recordings for people."""

from __future__ import annotations

from insenv.datasets.local import VARIABLE, locate
from insenv.datasets.registry import SIZES, manifest_path, names


def table() -> str:
    """One block per recording: name, size, licence, what it is, where it comes from, where it is."""
    blocks = [_block(name) for name in names()]
    footer = f"Fetch with: insenv datasets --fetch NAME. A folder named in {VARIABLE} is looked in first."
    return "\n\n".join([*blocks, footer])


def _block(name: str) -> str:
    from insenv.data.manifest import load_manifest

    manifest = load_manifest(manifest_path(name))
    source, folder = manifest.source, locate(name)
    assert source is not None, f"{name}: a published recording has a [source]"
    return "\n".join(
        [
            f"{name:<20} {SIZES[name] / 1e6:4.1f} MB  {source.licence}",
            f"    {manifest.title}; explains {', '.join(manifest.model.targets)}",
            f"    from {source.repository} at {source.commit[:12]}",
            f"    {'not fetched' if folder is None else f'in {folder}'}",
        ]
    )
