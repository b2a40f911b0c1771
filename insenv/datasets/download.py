"""Fetching recordings into the cache, whole and with the right sha256 or not at all."""

from __future__ import annotations

from pathlib import Path

from insenv.core.errors import InputError
from insenv.datasets.local import VARIABLE, cache, locate
from insenv.datasets.registry import RemoteFile, files

#: How long a server may stay silent [s].
TIMEOUT = 30.0


def fetch(name: str, progress: bool = True, timeout: float = TIMEOUT) -> Path:
    """Folder that holds the recording ``name``; what is missing or damaged in the cache is fetched first.

    Parameters
    ----------
    name : str
        One of `names`.
    progress : bool
        Whether to show a bar on standard error while fetching, if that is a terminal.
    timeout : float
        How long the server may stay silent [s].

    Raises
    ------
    InputError
        If there is no such recording, no connection, an answer other than the published file, or no place to
        write it. The cache then holds what it held before.
    """
    folder, cached = locate(name), cache()
    if folder is not None and folder != cached:
        return folder
    for file in files(name):
        _retrieve(file, cached, progress, timeout)
    return cached


def _retrieve(file: RemoteFile, folder: Path, progress: bool, timeout: float) -> None:
    """Bring one file into ``folder``: pooch writes to a temporary name and renames once the hash is right."""
    import pooch
    import requests
    from tqdm import tqdm

    pooch.get_logger().setLevel("WARNING")  # the bar says what is being fetched
    bar = tqdm(desc=file.path.name, unit="B", unit_scale=True, leave=False, disable=None if progress else True)
    try:
        pooch.retrieve(
            url=file.url,
            known_hash=f"sha256:{file.sha256}",
            fname=file.path.as_posix(),
            path=folder,
            downloader=pooch.HTTPDownloader(progressbar=bar, timeout=timeout),
        )
    except requests.RequestException as error:
        advice = f"wanted a connection, or the file as {file.path} in the folder that {VARIABLE} names"
        raise InputError(f"{file.url}: cannot be fetched ({_reason(error, timeout)}); {advice}") from None
    except ValueError:  # pooch's word for a wrong hash
        found = "what the server sent is not the published file (its sha256 differs)"
        raise InputError(f"{file.url}: {found}; nothing was kept") from None
    except OSError as error:
        where = folder / file.path
        raise InputError(f"{where}: cannot be written ({error.strerror or error})") from None
    finally:
        bar.close()


def _reason(error: Exception, timeout: float) -> str:
    """Why a request failed, in a few words: the library's own name half its layers."""
    import requests

    if isinstance(error, requests.Timeout):
        return f"no answer within {timeout:g} s"
    if isinstance(error, requests.HTTPError) and error.response is not None:
        return f"HTTP status {error.response.status_code}"
    if isinstance(error, requests.ConnectionError):
        return "no connection"
    return type(error).__name__
