"""Files that are small and unfold to gigabytes, or are one endless line: a sentence, soon, in little memory."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

MANIFEST = """data = "{file}"
[channels]
time = {{ column = "t", unit = "s" }}
gyro = {{ column = "w", unit = "deg/s" }}
[model]
target = "gyro"
declared = ["bias"]
"""
READ = (
    "from insenv.data.load import read_recordings as r; from insenv.data.manifest import load_manifest as m; r(m({!r}))"
)


def wide(path: Path) -> None:
    names = ",".join(f"c{i}" for i in range(1_000_000))
    path.write_text(f"t,w,{names}\n" + ",".join("0" for _ in range(1_000_002)) + "\n")


def commas(path: Path) -> None:
    path.write_bytes(b"," * 50_000_000)


def rows_of_commas(path: Path) -> None:
    path.write_bytes(b"t,w\n" + b",\n" * 50_000_000)


def parquet(path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    rows = pa.table({"t": np.zeros(1_000_000), "w": np.zeros(1_000_000)})
    with pq.ParquetWriter(path, rows.schema) as writer:
        for _ in range(100):  # 1.6 GB
            writer.write_table(rows)


def npz(path: Path) -> None:
    np.savez_compressed(path, t=np.zeros(40_000_000), w=np.zeros(40_000_000))


BOMBS: dict[str, Callable[[Path], None]] = {
    "wide.csv": wide,
    "commas.csv": commas,
    "commas.txt": commas,
    "rows.csv": rows_of_commas,
    "bomb.parquet": parquet,
    "bomb.npz": npz,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_ends_in_a_sentence(tmp_path: Path, name: str) -> None:
    BOMBS[name](tmp_path / name)
    manifest = tmp_path / "run.toml"
    manifest.write_text(MANIFEST.format(file=name))
    limit = 1_000_000_000

    def little_memory() -> None:
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))

    found = subprocess.run(
        [sys.executable, "-c", READ.format(str(manifest))],
        capture_output=True, text=True, timeout=60, preexec_fn=little_memory, check=False,
    )  # fmt: skip
    last = found.stderr.strip().splitlines()[-1]
    assert last.startswith("insenv.core.errors.InputError: ") and name in last and "wanted" in last, found.stderr[-500:]
