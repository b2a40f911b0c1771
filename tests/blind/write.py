"""The files of a recording: one or one for each run, with the manifest that says what they hold."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from blind.files import Column, channel_lines, manifest_text, write_table
from blind.noise import DEG_H, ROOT_H
from blind.plan import Plan
from blind.record import Recorded, kept, true_noise


def written(folder: Path, chosen: Plan, declared: tuple[str, ...], recorded: Recorded) -> Path:
    """Data files and manifest of a recording; path of the manifest."""
    folder.mkdir(parents=True, exist_ok=True)
    w, layout, rng = chosen.world, chosen.layout, np.random.default_rng(chosen.words)
    columns = list(recorded.columns)
    channels = []
    run = np.repeat(np.arange(float(w.runs)), w.each)
    if chosen.clock:
        began = float(rng.choice([0.0, 0.0, 12.5, 36000.0]))
        apart = w.duration + 600.0 if chosen.one_file else 0.0
        clock = began + apart * run + w.rows
        columns.insert(0, Column("time", str(rng.choice(["t", "time", "seconds"])), clock, 4, "s"))
    else:
        channels.append(f'time = {{ rate = "{1 / w.dt:g} Hz" }}')
    if chosen.one_file:
        columns.append(Column("power", "cycle", run + 1.0, 0, ""))
    stem, there = str(rng.choice(["run", "log", "test_7", "gyro data"])), kept(chosen)
    groups = [there] if chosen.one_file or w.runs == 1 else [there & (run == r) for r in range(w.runs)]
    names = [f"{stem}{f'_{r + 1}' if r else ''}{layout.suffix}" for r in range(len(groups))]
    for name, group in zip(names, groups, strict=True):
        write_table(folder / name, [replace(c, values=c.values[group]) for c in columns], layout)
    tables: dict[str, dict[str, str]] = {"site": {}, "mounting": {}}
    if chosen.site:
        tables["site"] = {"latitude": f'"{np.rad2deg(w.latitude):.6f} deg"'}
    if w.turning:
        tables["mounting"] = {"tilt": f'"{np.rad2deg(w.tilt):g} deg"'}
    if chosen.target != "gyro":
        tables["mounting"] = {"axes": '"RFU"', "table_axis": '"U"'}
    tables["model"] = {"target": f'"{chosen.target}"', "declared": json.dumps(list(declared))}
    if w.reference != 25.0:
        tables["model"]["reference_temperature"] = f'"{w.reference:g} degC"'
    if chosen.declares_noise:
        tables["noise"] = _declared(chosen, rng)
    if rng.uniform() < 0.2:  # the same share of the time as where nothing is said
        tables["held_out"] = {"start": f'"{0.6 * (w.duration - w.dt):.6f} s"'}
    path = folder / "manifest.toml"
    path.write_text(manifest_text(names, channels + channel_lines(columns, layout), tables), encoding="utf-8")
    return path


def _declared(chosen: Plan, rng: np.random.Generator) -> dict[str, str]:
    """A maker's figures: the truth, or up to a tenth more."""
    noise = true_noise(replace(chosen, scattered=0.0))  # a maker knows nothing of what a logger drops
    more = 1 + 0.1 * rng.uniform(size=4)
    said = {
        "angle_random_walk": f'"{noise.n / ROOT_H * more[0]:.3g} deg/sqrt(h)"',
        "bias_instability": f'"{noise.b / DEG_H * more[1]:.3g} deg/h"',
        "rate_random_walk": f'"{noise.k / DEG_H * 60 * more[2]:.3g} deg/h/sqrt(h)"',
    }
    if noise.angle:
        said["quantization"] = f'"{np.rad2deg(noise.angle) * 3600 * more[3]:.3g} arcsec"'
    return said
