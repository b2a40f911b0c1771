"""How many rows a bin has: enough bins to fit, few enough to search, whole cells, whole turns and whole holds."""

from __future__ import annotations

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.manifest.spec import Manifest
from insenv.data.split import RowUse
from insenv.identify.clean.holds import Hold

#: Fitted bins aimed at, and the most that are used.
BINS, MOST_BINS = 2000, 20000
#: Cells of all runs together: where curves are evaluated.
MOST_CELLS = 60000
#: Bins per turn of the table, so that angle harmonics survive.
BINS_PER_TURN = 8
#: Longest bin chosen unasked [s].
LONGEST_BIN = 5.0
#: Part of a row by which a hold time may be off a whole number of them; fitted bins that must be left of whole holds.
WHOLE_ROWS, FEWEST_BINS = 1e-3, 200
#: Fitted bins that must be left of means whose gain shorter ones are asked to have.
FEWEST_AGREEING = 24


def rows_per_bin(
    manifest: Manifest, recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], least: float = 0.0
) -> int:
    """Rows of a bin, which is at least ``least`` seconds long where the manifest says nothing."""
    dt = recordings[0].dt
    for recording in recordings:
        if abs(recording.dt / dt - 1) > 0.02:
            raise InputError(
                f"{recording.label}: sampled every {recording.dt:.6g} s, {recordings[0].label} every {dt:.6g} s; "
                "wanted one rate for all runs"
            )
    if manifest.held_out.averaging is not None:
        rows = int(round(manifest.held_out.averaging / dt))
        if rows < 1:
            raise InputError(
                f"{manifest.path}: held_out.averaging = {manifest.held_out.averaging:g} s is shorter than the "
                f"sampling period, {dt:g} s"
            )
        if rows > max(map(len, recordings)):
            raise InputError(
                f"{manifest.path}: held_out.averaging = {manifest.held_out.averaging:g} s is longer than the "
                f"recording, {max(len(r) * r.dt for r in recordings):g} s"
            )
        return rows
    if least:
        return round(least / dt)
    fitted = sum(int(use.fit.sum()) for use in uses) * dt
    width = min(_nice(fitted / BINS), LONGEST_BIN)
    turn = min((_quickest_turn(r) for r in recordings), default=np.inf)
    width = max(min(width, turn / BINS_PER_TURN), fitted / MOST_BINS)
    return _divisible(max(_fewest_rows(recordings), int(round(width / dt))), sum(map(len, recordings)))


def rows_of_motion(manifest: Manifest, uses: tuple[RowUse, ...], told: int, rows: int) -> int:
    """Rows of a bin that holds no faster motion than measured references tell, if enough bins are left."""
    if manifest.held_out.averaging is not None:
        return rows
    wide = min(told, sum(int(use.fit.sum()) for use in uses) // FEWEST_BINS)
    return _divisible(wide, sum(len(use.fit) for use in uses)) if wide > rows else rows


def whole_rows(hold: Hold, dt: float) -> bool:
    """Whether a hold lasts whole rows."""
    return abs(hold.hold / dt - round(hold.hold / dt)) < WHOLE_ROWS


def whole_holds(
    manifest: Manifest, recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], hold: Hold | None, rows: int
) -> int:
    """Rows of a bin that holds whole renewals: within one, noise is held too, and is not white."""
    dt = recordings[0].dt
    if hold is None or manifest.held_out.averaging is not None or not whole_rows(hold, dt):
        return rows
    each = round(hold.hold / dt)
    wide = each * -(-rows // each)
    return wide if sum(int(use.fit.sum()) for use in uses) >= FEWEST_BINS * wide else rows


def _fewest_rows(recordings: tuple[Recording, ...]) -> int:
    """Two rows of a bin where a noisy angle is read between its edges: neighbouring bins would share a reading."""
    noisy = [r.table is not None and not r.table.still and r.table.of == "angle" for r in recordings]
    return 2 if any(noisy) else 1


def _nice(x: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that does not exceed ``x``."""
    power = 10.0 ** np.floor(np.log10(x))
    return float(power * max(m for m in (1, 2, 5) if m * power <= x * (1 + 1e-9)))


def _quickest_turn(recording: Recording) -> float:
    """Shortest time that the table takes for a turn [s]."""
    n = min(max(2, len(recording) // 1000), len(recording) - 1)
    if "table_angle" in recording.channels:
        angle = recording.channels["table_angle"].values
        rate = float(np.abs((angle[n:] - angle[:-n]) / (recording.t[n:] - recording.t[:-n])).max())
    elif "table_rate" in recording.channels:
        rate = float(np.abs(recording.channels["table_rate"].values).max())
    else:
        return np.inf
    return 2 * np.pi / rate if rate > 0 else np.inf


def _divisible(rows_per_bin: int, total_rows: int) -> int:
    """As many rows to a bin, or a few less where their cells would be whole bins: 13 rows have no other divisor.

    Within a long cell the table changes its rate, and what is not linear in the rate is wrong there.
    """
    most = 2 * max(1.0, total_rows / MOST_CELLS)
    tried = range(rows_per_bin, int(0.8 * rows_per_bin), -1)
    return next((n for n in tried if rows_per_cell(n, total_rows) <= most), rows_per_bin)


def rows_per_cell(rows_per_bin: int, total_rows: int) -> int:
    """The smallest divisor of a bin that keeps the number of cells in bounds."""
    least = max(1.0, total_rows / MOST_CELLS)
    return min(d for d in range(1, rows_per_bin + 1) if rows_per_bin % d == 0 and (d >= least or d == rows_per_bin))
