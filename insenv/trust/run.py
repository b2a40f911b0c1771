"""What the loop's claims on a recording are worth: close it, make copies, close it on each, count."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from insenv.close import close_on, opened
from insenv.core.errors import InputError
from insenv.data.fingerprint import fingerprint
from insenv.data.load import read_recordings
from insenv.data.power import by_power_up
from insenv.sweep import Backend, Folder, Identity, Memory, Store, sweep
from insenv.trust.copies import base
from insenv.trust.rates import Trust, trust
from insenv.trust.screen import screen_of
from insenv.trust.trial import Trials, injections, read_row

#: Copies from which on a screen, which takes a close and a little, saves more than it takes.
WORTH = 8


@dataclass(frozen=True)
class Kept:
    """A folder for the copies that are done; ``resume``: to go on with what is there."""

    folder: Path
    resume: bool = False


def trust_of(  # noqa: PLR0913 -- as of `close`, and how the copies are worked off
    manifest: str | Path,
    copies: int = 200,
    alpha: float = 0.01,
    seed: int = 0,
    backend: Backend | None = None,
    kept: Kept | None = None,
    progress: Callable[[str], None] = lambda text: None,
    bar: bool = False,
) -> Trust:
    """How often the loop is right and wrong on a recording.

    Parameters
    ----------
    manifest : str or Path
        As of `insenv.close.close`.
    copies : int
        Half of them with nothing to find, half with one effect more.
    alpha : float
        Probability of a false discovery, per target.
    seed : int
        Of what is drawn.
    backend : Backend, optional
        In this process.
    kept : Kept, optional
        Where copies that are done are kept; in memory.
    progress : callable
        Told what is being done.
    bar : bool
        Whether to show on standard error how many copies are done.

    Raises
    ------
    InputError
        If anything given cannot be used.
    """
    if copies < 2:
        raise InputError(f"{copies} copies given; wanted 2 or more, half of them with an effect more")
    read = opened(manifest, progress)
    if read.procedure == "multi-position":
        raise InputError(f"{read.path}: rests in several positions have no series in time to make copies of")
    recordings = by_power_up(read_recordings(read))
    found = close_on(read, recordings, None, alpha, seed, progress)
    given = base(read, recordings, found)
    # What every copy has, such as a line that wanders, would be named whatever was injected.
    injected = tuple(one for one in injections(found) if one.effect not in given.left[one.target])
    store: Store = Memory()
    if kept is not None:
        text = read.path.read_bytes() + "".join(map(fingerprint, recordings)).encode()
        settings = {"manifest": str(manifest), "hash": hashlib.sha256(text).hexdigest(), "alpha": str(alpha)}
        identity = Identity("insenv.trust.trial:Trials", seed, copies, settings)
        store = Folder(kept.folder, identity, kept.resume)
    done = sweep(
        Trials(given, injected, alpha, seed, screen_of(given, alpha, seed)),
        0,
        copies,
        store,
        backend,
        chunk=1,
        progress=bar,
    )
    rows = [read_row(str(text)) for part in done.parts() for text in part["copy"]]
    return trust(found, given, injected, rows, seed)
