"""Which recording a result was made from: a hash of what was measured, whatever file it is kept in."""

from __future__ import annotations

import hashlib

import numpy as np

from insenv.core.recording import Recording


def fingerprint(recording: Recording) -> str:
    """SHA-256 of times and channels (name, unit, meaning, samples); label, site and mounting do not count."""
    sha = hashlib.sha256()

    def add(values: object) -> None:
        # + 0.0: minus zero is zero, as a reader makes it that adds an offset.
        sha.update(np.ascontiguousarray(np.asarray(values, "<f8") + 0.0).tobytes())

    add(recording.t)
    for name, channel in sorted(recording.channels.items()):
        sha.update(f"\n{name} {channel.unit} {channel.covers} {channel.delay!r}\n".encode())
        add(channel.values)
    return sha.hexdigest()
