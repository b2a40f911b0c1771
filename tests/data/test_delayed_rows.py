"""A reading that is late covers an earlier time: what the table did then, and nothing before its first reading."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Channel, Recording
from insenv.data.exposure import expose

DT, ROWS = 0.02, 2000
OMEGA = 2 * np.pi * 0.43


def angle(t: np.ndarray) -> np.ndarray:
    return np.asarray(1.0 - np.cos(OMEGA * (t + 0.3)))


def mean_rate(start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    return np.asarray((angle(stop) - angle(start)) / (stop - start))


@pytest.mark.parametrize("own", [0.0, 0.02, 0.03, 0.05])
def test_an_interval_that_ends_earlier_is_exposed_to_what_was_there_then(own: float) -> None:
    """Nothing is exposed to what a table did before its angle was first read."""
    t = DT * np.arange(1.0, ROWS + 1)
    gyro = Channel(mean_rate(t - own - DT, t - own), "rad/s", "interval", delay=own)
    recording = Recording(t, {"gyro": gyro, "table_angle": Channel(angle(t), "rad")})
    exposure = expose(recording, "gyro")
    rows = np.flatnonzero(exposure.cell_of_row >= 0)
    assert np.all(t[rows] - own - DT > t[0] - 1e-9)
    assert len(rows) >= ROWS - 2 - round(own / DT + 0.5)
    # A straight line between two angles cuts (w h)^2 / 8 of the swing where edges lie between the rows.
    whole = abs(own / DT - round(own / DT)) < 1e-9
    line = 1e-9 if whole else (OMEGA * DT) ** 2 / 8 * OMEGA
    assert exposure.u[exposure.cell_of_row[rows]] == pytest.approx(gyro.values[rows], abs=1.1 * line)


@pytest.mark.parametrize("late", [0.0, 0.02, 0.03, 0.035])
def test_a_rate_that_is_late_by_parts_of_a_row_is_as_exact_as_by_whole_rows(late: float) -> None:
    t = DT * np.arange(1.0, ROWS + 1)
    gyro = Channel(mean_rate(t - DT, t), "rad/s", "interval")
    rate = Channel(OMEGA * np.sin(OMEGA * (t - late + 0.3)), "rad/s", delay=late)
    exposure = expose(Recording(t, {"gyro": gyro, "table_rate": rate}), "gyro")
    rows = np.flatnonzero(exposure.cell_of_row >= 0)[5:-5]
    # The trapezoid's twelfth of a second difference; by straight lines between the rows it was three halves more.
    trapezoid = (OMEGA * DT) ** 2 / 12 * OMEGA
    assert exposure.u[exposure.cell_of_row[rows]] == pytest.approx(gyro.values[rows], abs=1.2 * trapezoid)
