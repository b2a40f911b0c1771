"""Recordings that cannot be used: what goes wrong between an instrument and a desk.

Each fault names words of which a helpful message has at least one: where it is, and what was found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROWS = 1200
MANIFEST = """\
data = "run.csv"

[channels]
time = { column = "t", unit = "s" }
gyro = { column = "rate", unit = "deg/s", covers = "interval" }
table_angle = { column = "enc", unit = "deg" }
temperature = { column = "temp", unit = "degC" }

[model]
target = "gyro"
declared = ["bias", "scale_factor"]
"""


def good_lines(rng: np.random.Generator) -> list[str]:
    t = 0.1 * np.arange(1, ROWS + 1)
    angle = 8 * t + 40 * np.sin(2 * np.pi * t / 30)
    rate = np.diff(np.concatenate([[0.0], angle])) / 0.1 + 0.02 * rng.standard_normal(ROWS)
    kelvins = 24 + 0.01 * t + 0.02 * rng.standard_normal(ROWS)
    table = zip(t, rate, angle, kelvins, strict=True)
    return ["t,rate,enc,temp", *(f"{a:.3f},{b:.5f},{c:.5f},{d:.3f}" for a, b, c, d in table)]


@dataclass(frozen=True)
class Fault:
    """What is done to lines and manifest, and what a message must name."""

    name: str
    spoil: Callable[[list[str], str, int], tuple[list[str], str]]
    where: tuple[str, ...]
    what: tuple[str, ...]


def _cell(row: int, column: int, value: str) -> Callable[[list[str]], list[str]]:
    def changed(lines: list[str]) -> list[str]:
        cells = lines[row].split(",")
        cells[column] = value
        return [*lines[:row], ",".join(cells), *lines[row + 1 :]]

    return changed


def _in_cell(column: int, value: str) -> Callable[[list[str], str, int], tuple[list[str], str]]:
    return lambda lines, manifest, row: (_cell(row, column, value)(lines), manifest)


def _in_manifest(old: str, new: str) -> Callable[[list[str], str, int], tuple[list[str], str]]:
    return lambda lines, manifest, row: (lines, manifest.replace(old, new))


def _back(lines: list[str], manifest: str, row: int) -> tuple[list[str], str]:
    return _cell(row, 0, lines[row - 40].split(",")[0])(lines), manifest


def _swapped(lines: list[str], manifest: str, row: int) -> tuple[list[str], str]:
    return [*lines[:row], *lines[row + 200 :], *lines[row : row + 200]], manifest


def _by_events(lines: list[str], manifest: str, row: int) -> tuple[list[str], str]:
    """A logger that writes when something happens: the steps of time have no length in common."""
    steps = np.random.default_rng(row).exponential(0.1, len(lines) - 1)
    rows = zip(np.cumsum(steps), lines[1:], strict=True)
    return [lines[0], *(f"{t:.5f},{line.partition(',')[2]}" for t, line in rows)], manifest


def _wrapped(lines: list[str], manifest: str, row: int) -> tuple[list[str], str]:
    rows = [line.split(",") for line in lines[1:]]
    return [lines[0], *(",".join([a, b, f"{float(c) % 360:.5f}", d]) for a, b, c, d in rows)], manifest


def _twice(lines: list[str], manifest: str, row: int) -> tuple[list[str], str]:
    return [lines[0].replace("enc", "rate"), *lines[1:]], manifest


_DATA = ("run.csv",)
_MANIFEST = ("manifest.toml",)

FAULTS = (
    Fault("a NaN in the gyro", _in_cell(1, "nan"), _DATA, ("nan", "NaN")),
    Fault("an infinite temperature", _in_cell(3, "inf"), _DATA, ("inf",)),
    Fault("text in a number column", _in_cell(1, "ERR"), _DATA, ("ERR",)),
    Fault("an empty cell", _in_cell(2, ""), _DATA, ("enc", "empty", "''", '""', "nothing")),
    Fault("a row of dashes", lambda x, m, r: ([*x[:r], "----", *x[r + 1 :]], m), _DATA, ("----", "1 ", "one")),
    Fault(
        "a truncated line",
        lambda x, m, r: ([*x[:r], x[r][:9], *x[r + 1 :]], m),
        _DATA,
        ("1", "column", "field", "value"),
    ),
    Fault("time that steps back", _back, _DATA, ("back", "time", "t")),
    Fault("parts of a file in the wrong order", _swapped, _DATA, ("back", "time", "t")),
    Fault("time that is uneven", _by_events, _DATA, ("even", "time")),
    Fault("an undeclared wrapped angle", _wrapped, _DATA, ("wrapped", "jump")),
    Fault("a heading that stands twice", _twice, _DATA, ("rate", "enc")),
    Fault("a column that is not there", _in_manifest('"enc"', '"encoder"'), _DATA, ("encoder",)),
    Fault("a file that is not there", _in_manifest("run.csv", "run_1.csv"), ("run_1.csv",), ("no", "not")),
    Fault("an empty file", lambda x, m, r: ([], m), _DATA, ("empty", "no")),
    Fault("a heading alone", lambda x, m, r: (x[:1], m), _DATA, ("no", "0", "row")),
    Fault("two rows", lambda x, m, r: (x[:3], m), ("run.csv", "manifest.toml"), ("2", "few", "row")),
    Fault("a unit that is none", _in_manifest('"deg/s"', '"degrees/sek"'), _MANIFEST, ("degrees/sek",)),
    Fault("a unit of something else", _in_manifest('unit = "deg/s"', 'unit = "m/s"'), _MANIFEST, ("m/s",)),
    Fault("a key that is none", _in_manifest("covers", "cover"), _MANIFEST, ("cover",)),
    Fault("an effect that is none", _in_manifest('"scale_factor"', '"scalefactor"'), _MANIFEST, ("scalefactor",)),
    Fault("a table that is none", _in_manifest("[model]", "[models]"), _MANIFEST, ("models", "model")),
    Fault("TOML that is none", _in_manifest("[model]", "[model"), _MANIFEST, ("line", "9", "10")),
    Fault("a target that is not there", _in_manifest('target = "gyro"', 'target = "gyro_x"'), _MANIFEST, ("gyro_x",)),
    Fault(
        "noise in a wrong unit",
        lambda x, m, r: (x, m + '[noise]\nangle_random_walk = "0.1 deg"\n'),
        _MANIFEST,
        ("angle_random_walk",),
    ),  # fmt: skip
    Fault(
        "held-out rows beyond the end",
        lambda x, m, r: (x, m + "[held_out]\nrows = [[900, 9000]]\n"),
        _MANIFEST,
        ("9000",),
    ),  # fmt: skip
    Fault(
        "Earth rate without a latitude",
        _in_manifest('"scale_factor"]', '"scale_factor", "earth_rate"]'),
        _MANIFEST,
        ("latitude",),
    ),  # fmt: skip
)


def write(fault: Fault | None, folder: Path, seed: int) -> Path:
    """The spoilt recording; its manifest's path. Without a fault: a good one."""
    rng = np.random.default_rng(seed)
    lines, manifest = good_lines(rng), MANIFEST
    if fault is not None:
        lines, manifest = fault.spoil(lines, manifest, int(rng.integers(300, 800)))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "run.csv").write_text("".join(line + "\n" for line in lines), encoding="utf-8")
    path = folder / "manifest.toml"
    path.write_text(manifest, encoding="utf-8")
    return path


def shortcomings(fault: Fault, status: int, out: str, err: str, left: list[str]) -> list[str]:
    """What is wrong with how the command ended; ``left`` are files that it has left behind."""
    lines = [line for line in err.splitlines() if line.strip()]
    last = lines[-1] if lines else ""
    checks = {
        f"exit status {status}": status == 2,
        "a traceback": "Traceback" not in err + out,
        f"{len(lines)} lines instead of one": len(lines) == 1,
        "no file named": any(w in last for w in fault.where),
        "the fault is not named": any(w in last for w in fault.what),
        f"files left: {left}": not left,
    }
    return [text for text, fine in checks.items() if not fine]
