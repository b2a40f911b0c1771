"""Files of a case: tables of numbers and a manifest."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from causes import Cause
from procedures import Test
from units import ACCELS, GYROS, Unit
from world import DEG, EARTH, Floats, Rng, Run, noise

#: Of all sites [rad].
LATITUDE = 47.0 * DEG


def written(folder: Path, test: Test, causes: Sequence[tuple[Cause, float]], rng: Rng) -> None:
    """Files of a test with its causes."""
    north = float(rng.uniform(0, 6))
    scale = 3e-4 * rng.standard_normal() if "scale_factor" in test.declared else 0.0
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"run{index + 1}.csv" for index in range(len(test.runs))]
    for name, run in zip(names, test.runs, strict=True):
        _csv(folder / name, _columns(test, run, causes, (scale, north), rng))
    text = [f"data = {json.dumps(names)}", "", "[channels]", *_channels(test), ""]
    if "earth_rate" in test.declared:
        text += ["[site]", f'latitude = "{LATITUDE / DEG:g} deg"', ""]
    if test.turning:
        text += ["[mounting]", f'tilt = "{test.tilt / DEG:g} deg"', ""]
    text += ["[model]", 'target = "gyro"', f"declared = {json.dumps(list(test.declared))}", ""]
    (folder / "manifest.toml").write_text("\n".join(text), encoding="utf-8")


def _columns(
    test: Test, run: Run, causes: Sequence[tuple[Cause, float]], truth: tuple[float, float], rng: Rng
) -> dict[str, Floats]:
    """What is logged of a run; ``truth`` is the error of the scale factor and where north is."""
    scale, north = truth
    gyro = run.rate * np.sin(test.tilt) * (1 + scale)
    gyro = gyro + noise(test.grade, run.n, run.dt, rng) + 200 * test.grade.b * rng.standard_normal()
    read = run.angle[1:].copy()
    for cause, size in causes:
        added, wrong = cause.curve(run, size)
        gyro, read = gyro + added, read + wrong
    if "earth_rate" in test.declared:
        middle = 0.5 * (run.angle[1:] + run.angle[:-1])
        level = np.cos(LATITUDE) * np.cos(test.tilt) * np.cos(middle - north)
        gyro = gyro + EARTH * (np.sin(LATITUDE) * np.sin(test.tilt) + level)
    columns = {"t_s": run.t, "gyro_deg_s": gyro / DEG}
    if test.angle:
        step = test.grade.encoder
        jitter = step * rng.standard_normal(run.n)
        columns["angle_deg"] = np.round((read + jitter) / step) * step / DEG
    if test.command:
        columns["command_deg_s"] = run.told[4::4] / DEG
    if test.thermometer:
        columns["temp_degC"] = np.round(run.temperature + 0.005 * rng.standard_normal(run.n), 3)
    return columns


def _channels(test: Test) -> list[str]:
    """Lines of the manifest."""
    channels = ['time = { column = "t_s", unit = "s" }']
    channels.append('gyro = { column = "gyro_deg_s", unit = "deg/s", quantity = "rate", covers = "interval" }')
    if test.angle:
        channels.append('table_angle = { column = "angle_deg", unit = "deg" }')
    if test.command:
        channels.append('table_rate = { column = "command_deg_s", unit = "deg/s" }')
    if test.thermometer:
        channels.append('temperature = { column = "temp_degC", unit = "degC" }')
    return channels


def written_unit(folder: Path, unit: Unit, targets: Sequence[str], extra: str, declared: Sequence[str]) -> None:
    """Files of a unit with six axes."""
    folder.mkdir(parents=True, exist_ok=True)
    columns = {"t_s": unit.t}
    channels = ['time = { column = "t_s", unit = "s" }']
    for k in range(3):
        columns[f"w{'xyz'[k]}"] = unit.gyros[:, k]
        channels.append(f'{GYROS[k]} = {{ column = "w{"xyz"[k]}", unit = "rad/s", quantity = "rate" }}')
    for k in range(3):
        columns[f"f{'xyz'[k]}"] = unit.accels[:, k]
        channels.append(f'{ACCELS[k]} = {{ column = "f{"xyz"[k]}", unit = "m/s^2" }}')
    if unit.rate is not None:
        columns["table"] = unit.rate
        channels.append('table_rate = { column = "table", unit = "rad/s" }')
    _csv(folder / "imu.csv", columns)
    text = ['data = "imu.csv"', "", "[channels]", *channels, "", "[mounting]", 'axes = "RFU"']
    text += [extra] if extra else []
    text += ["", "[model]", f"target = {json.dumps(list(targets))}", f"declared = {json.dumps(list(declared))}"]
    if declared and declared[0] == "accel_bias":
        text.append('procedure = "multi-position"')
    (folder / "manifest.toml").write_text("\n".join([*text, ""]), encoding="utf-8")


def _csv(path: Path, columns: dict[str, Floats]) -> None:
    names = list(columns)
    np.savetxt(path, np.column_stack([columns[c] for c in names]), "%.10g", ",", header=",".join(names), comments="")
