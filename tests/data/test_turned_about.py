"""A unit on a table of which nobody said about which axis it turns: the gyro that reads the table's rate tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from insenv.core.recording import Channel, Mounting, Recording
from insenv.data.turned_about import about_its_axis

T = 0.01 * np.arange(6000.0)
RATE = 0.5 * np.sin(2 * np.pi * T / 9)


def unit(gains: tuple[float, float, float], mounting: Mounting) -> Recording:
    """Gyros with these parts of the table's rate, and noise of 1 mrad/s."""
    noise = 1e-3 * np.random.default_rng(0).standard_normal((3, len(T)))
    gyros = {f"gyro_{axis}": Channel(g * RATE + n, "rad/s") for axis, g, n in zip("xyz", gains, noise, strict=True)}
    return Recording(T, {**gyros, "table_rate": Channel(RATE, "rad/s")}, mounting=mounting)


@pytest.mark.parametrize(
    ("gains", "axes", "axis"),
    [
        ((4e-4, -0.02, 0.98), "RFU", "U"),
        ((4e-4, -0.02, -1.02), "RFU", "D"),
        ((4e-4, -0.02, 0.98), "FRD", "D"),
        ((0.99, -0.02, 0.01), "RFU", ""),  # no letter along the vertical
        ((0.3, -0.02, 0.95), "RFU", ""),  # an axis that leans
        ((4e-4, 0.02, 0.5), "RFU", ""),  # another unit, or range
    ],
)
def test_the_gyro_that_reads_the_rate_tells_the_axis(gains: tuple[float, float, float], axes: str, axis: str) -> None:
    (read,), said = about_its_axis((unit(gains, Mounting(axes=axes)),), ["gyro_x"])
    assert read.mounting.table_axis == axis
    assert bool(said) is bool(axis)


def test_what_is_stated_stands_and_a_target_along_the_axis_needs_nothing() -> None:
    run = unit((0.0, 0.0, 1.0), Mounting())
    for mounting in (Mounting(table_axis="D"), Mounting(tilt=0.0)):
        stated = replace(run, mounting=mounting)
        assert about_its_axis((stated,), ["gyro_x"]) == ((stated,), ())
    assert about_its_axis((run,), ["gyro_z"]) == ((run,), ())
    assert about_its_axis((run, replace(run, mounting=Mounting(axes="FRD"))), ["gyro_x"])[1] == ()
