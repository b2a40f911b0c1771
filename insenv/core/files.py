"""Files that appear whole or not at all: tables of columns, TOML and other text.

Each is written under a temporary name beside its own and takes that name only when everything is on disk.
"""

from __future__ import annotations

import csv
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

from insenv.core.errors import InputError
from insenv.core.names import is_standard_output

Format = Literal["npz", "csv", "parquet"]
Columns = Mapping[str, Any]


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Temporary name beside ``path``: moved to ``path`` when the block ends well, else removed.

    A link is followed, and what it points to replaced. What is no regular file (a device, a pipe) is written through
    to, and ``-`` is the standard output.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    through = is_standard_output(path) or (path.exists() and not path.is_file())
    path = path if through else Path(os.path.realpath(path))
    folder = Path(tempfile.gettempdir()) if through else path.parent
    temporary = folder / f".{path.name}.{os.getpid()}.part"
    try:
        yield temporary
        if through:
            _write_through(path, temporary.read_bytes())
        else:
            os.replace(temporary, path)
    except BrokenPipeError:
        raise InputError(f"{path}: nobody reads it any more") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        with suppress(OSError):  # moved, never made, or with a name that the disk does not take
            temporary.unlink()


def _write_through(path: Path, content: bytes) -> None:
    if not is_standard_output(path):
        with path.open("wb") as device:
            device.write(content)
        return
    sys.stdout.flush()
    if hasattr(sys.stdout, "buffer"):
        sys.stdout.buffer.write(content)
    else:
        sys.stdout.write(content.decode("utf-8", "backslashreplace"))
    sys.stdout.flush()


def write_whole(path: str | os.PathLike[str], text: str) -> Path:
    """Write ``text`` to ``path`` in UTF-8; what stood there before is replaced.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    path = Path(path)
    with replacing(path) as temporary:
        # A name from a file may hold what UTF-8 cannot: it is shown, not a reason to lose the rest.
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")
    return path


def json_text(document: Mapping[str, Any]) -> str:
    """A document as all of them are written: indented, any letter as it is, and no number that JSON does not know."""
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def toml(tables: Sequence[tuple[str, Mapping[str, object]]]) -> str:
    """TOML text of tables: a head such as "[site]" ("" for the top) and its entries, left out where empty."""
    return "\n".join("\n".join(_lines(head, entries)) for head, entries in tables if entries)


def _lines(head: str, table: Mapping[str, object]) -> Iterator[str]:
    if head:
        yield head
    yield from (f"{key} = {toml_value(value)}" for key, value in table.items())
    yield ""


def toml_value(value: object) -> str:
    """A TOML value: its texts and numbers are written as in JSON, but for one control character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _write_npz(path: Path, columns: Columns) -> None:
    import numpy as np  # here and not above: commands that compute nothing need not wait for it

    with path.open("wb") as file:  # a name would be given a suffix
        np.savez(file, **columns)


def _write_csv(path: Path, columns: Columns) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def _write_parquet(path: Path, columns: Columns) -> None:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise InputError(f"{path}: Parquet needs pyarrow; install insenv[io]") from None
    parquet.write_table(pa.table(dict(columns)), path, write_page_checksum=True)


#: Writers of columns by name, for each format; they know nothing of temporary names.
WRITERS: Mapping[Format, Callable[[Path, Columns], None]] = {
    "npz": _write_npz,
    "csv": _write_csv,
    "parquet": _write_parquet,
}
