"""The registry of published recordings: manifests, places, hashes, and fetching without a network."""

import hashlib
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pooch
import pytest
import requests
from recorded import measured

from insenv import datasets
from insenv.core.errors import InputError
from insenv.datasets import local, registry

NAMES = datasets.names()
ONE, TWO = "psins_lasergyro", "ln100_updown"  # of one file and of two

Server = Callable[[bytes | Exception], None]


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty cache, no folder of recordings, and no way to the network."""
    monkeypatch.delenv(local.VARIABLE, raising=False)
    monkeypatch.setattr(pooch, "os_cache", lambda project: tmp_path / "cache" / project)
    monkeypatch.setattr(pooch.HTTPDownloader, "__call__", _refuse)


def _refuse(self: object, url: str, *_: object, **__: object) -> None:
    raise AssertionError(f"{url} was asked for")


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Server:
    """Set what the server answers: a content, or an error halfway."""

    def answers(answer: bytes | Exception) -> None:
        def download(self: object, url: str, output_file: str, *_: object, **__: object) -> None:
            if isinstance(answer, Exception):
                Path(output_file).write_bytes(b"the first half of ")
                raise answer
            Path(output_file).write_bytes(answer)

        monkeypatch.setattr(pooch.HTTPDownloader, "__call__", download)

    return answers


def _response(status: int) -> requests.Response:
    response = requests.Response()
    response.status_code = status
    return response


def _want(monkeypatch: pytest.MonkeyPatch, name: str, content: bytes) -> None:
    """Make ``content`` the published one of every file of ``name``."""
    sha256 = hashlib.sha256(content).hexdigest()
    files = tuple(registry.RemoteFile(f.path, f.url, sha256) for f in registry.files(name))
    for module in (local, sys.modules["insenv.datasets.download"]):
        monkeypatch.setattr(module, "files", lambda asked: files if asked == name else registry.files(asked))


def _lay(folder: Path, name: str, content: bytes = b"x") -> None:
    for file in registry.files(name):
        (folder / file.path).parent.mkdir(parents=True, exist_ok=True)
        (folder / file.path).write_bytes(content)


def _left(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_every_manifest_is_registered() -> None:
    manifests = Path(registry.__file__).parent / "manifests"
    assert sorted(path.stem for path in manifests.iterdir()) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_file_has_its_source(name: str) -> None:
    from insenv.data.manifest import load_manifest

    source = load_manifest(datasets.manifest_path(name)).source
    assert source is not None and source.licence
    files = registry.files(name)
    assert len({file.path for file in files}) == len(files) == len(source.path)
    for file, path in zip(files, source.path, strict=True):
        assert file.url == f"https://raw.githubusercontent.com/{source.repository}/{source.commit}/{path}"
        assert re.fullmatch("[0-9a-f]{64}", file.sha256)
        assert file.path.name == Path(path).name and not file.path.is_absolute()


@pytest.mark.parametrize("name", NAMES)
def test_a_recording_is_described_in_one_line(name: str) -> None:
    text = datasets.describe(name)
    assert "\n" not in text and re.search(r"MIT|BSD|CC-BY", text)


@pytest.mark.parametrize(
    "ask", [datasets.manifest_path, datasets.describe, datasets.locate, datasets.load, datasets.fetch]
)
def test_an_unknown_name_is_told_the_known_ones(ask: Callable[[str], object]) -> None:
    with pytest.raises(InputError, match="no recording 'psins'; there are psins_lasergyro, "):
        ask("psins")


def test_a_recording_that_is_nowhere_is_not_located() -> None:
    assert datasets.locate(ONE) is None
    with pytest.raises(InputError, match=r"'psins_lasergyro' is not on this machine; .*--fetch .*INSENV_DATA"):
        datasets.load(ONE)


def test_the_given_folder_goes_before_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _lay(local.cache(), ONE)
    assert datasets.locate(ONE) == local.cache()
    monkeypatch.setenv(local.VARIABLE, str(tmp_path / "data"))
    assert datasets.locate(ONE) == local.cache()  # the folder has nothing of it
    _lay(tmp_path / "data", ONE)
    assert datasets.locate(ONE) == tmp_path / "data"
    assert datasets.fetch(ONE) == tmp_path / "data"  # nothing was asked for


def test_half_a_recording_does_not_count() -> None:
    _lay(local.cache(), TWO)
    assert datasets.locate(TWO) == local.cache()
    (local.cache() / registry.files(TWO)[1].path).unlink()
    assert datasets.locate(TWO) is None


def test_a_local_file_that_is_not_the_published_one_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(local.VARIABLE, str(tmp_path))
    _lay(tmp_path, ONE, b"something else")
    with pytest.raises(InputError, match=r"lasergyro\.imu: is not the published file \(sha256 f41f3fa625ff"):
        datasets.load(ONE)
    _want(monkeypatch, ONE, b"something else")
    assert datasets.load(ONE).runs[0].file == tmp_path / "psins" / "lasergyro.imu"


@pytest.mark.parametrize("name", [ONE, TWO])
def test_what_is_fetched_is_found_and_not_fetched_again(
    name: str, server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    _want(monkeypatch, name, b"as published")
    server(b"as published")
    folder = datasets.fetch(name, progress=False)
    assert folder == datasets.locate(name) == local.cache()
    assert _left(folder) == sorted(str(file.path) for file in registry.files(name))
    assert datasets.load(name).runs[0].file.read_bytes() == b"as published"
    monkeypatch.setattr(pooch.HTTPDownloader, "__call__", _refuse)
    assert datasets.fetch(name) == folder


def test_a_damaged_file_in_the_cache_is_fetched_again(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    _lay(local.cache(), ONE, b"damaged")
    _want(monkeypatch, ONE, b"as published")
    server(b"as published")
    datasets.fetch(ONE)
    assert (local.cache() / registry.files(ONE)[0].path).read_bytes() == b"as published"


def test_a_wrong_hash_is_one_sentence_and_leaves_nothing(server: Server) -> None:
    server(b"sign in to this network")
    with pytest.raises(InputError) as caught:
        datasets.fetch(ONE)
    url = registry.files(ONE)[0].url
    found = "what the server sent is not the published file (its sha256 differs)"
    assert str(caught.value) == f"{url}: {found}; nothing was kept"
    assert _left(local.cache()) == []
    assert datasets.locate(ONE) is None


def test_a_wrong_hash_keeps_what_the_cache_had(server: Server) -> None:
    _lay(local.cache(), ONE, b"damaged")
    server(b"sign in to this network")
    with pytest.raises(InputError, match="nothing was kept"):
        datasets.fetch(ONE)
    assert _left(local.cache()) == [str(registry.files(ONE)[0].path)]
    assert (local.cache() / registry.files(ONE)[0].path).read_bytes() == b"damaged"


@pytest.mark.parametrize(
    ("failure", "reason"),
    [
        (requests.ConnectionError("HTTPSConnectionPool(host=...)"), "no connection"),
        (requests.Timeout("read timed out"), "no answer within 7 s"),
        (requests.HTTPError(response=_response(404)), "HTTP status 404"),
        (requests.exceptions.ChunkedEncodingError("cut off"), "ChunkedEncodingError"),
    ],
)
def test_a_failed_connection_is_one_sentence_and_leaves_nothing(
    server: Server, failure: Exception, reason: str
) -> None:
    server(failure)
    with pytest.raises(InputError) as caught:
        datasets.fetch(TWO, timeout=7)
    message = str(caught.value)
    assert f"cannot be fetched ({reason}); wanted a connection, or the file as ln100_updown" in message
    assert registry.files(TWO)[0].url in message and "\n" not in message
    assert _left(local.cache()) == []


def test_a_cache_that_cannot_be_written_is_one_sentence(server: Server) -> None:
    local.cache().parent.mkdir(parents=True)
    local.cache().write_text("a file where the folder should be")
    server(b"as published")
    with pytest.raises(InputError, match=r"psins.*lasergyro\.imu: cannot be written \("):
        datasets.fetch(ONE)


def test_the_table_says_where_each_recording_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(local.VARIABLE, str(tmp_path))
    _lay(tmp_path, ONE)
    blocks = dict(zip(NAMES, datasets.table().split("\n\n"), strict=False))
    for name, block in blocks.items():
        assert block.startswith(name) and re.search(r"\d MB  (MIT|BSD-2-Clause|CC-BY-NC-SA-4.0)\n", block)
        assert block.endswith(f"in {tmp_path}" if name == ONE else "not fetched")


def test_names_cost_nothing() -> None:
    program = "import sys, insenv.datasets as d; d.names(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, text=True).stdout
    assert {"pooch", "pint", "scipy", "requests"}.isdisjoint(loaded.split())


@pytest.mark.parametrize("name", NAMES)
def test_a_recording_here_is_the_published_one(name: str) -> None:
    manifest = measured.manifest(name)
    own = dict.fromkeys(spec.file for spec in manifest.channels.values() if spec.file is not None)
    paths = [*(run.file for run in manifest.runs), *own]
    found = [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]
    assert found == [file.sha256 for file in registry.files(name)]
    assert sum(path.stat().st_size for path in paths) == registry.SIZES[name]
