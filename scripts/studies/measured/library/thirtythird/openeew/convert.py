"""Three stations of an earthquake early warning network in tables.

A line holds the readings of a second and the time of the last; readings come 31.25 times a second.
"""

import json
from pathlib import Path

import numpy as np

for name, files in {
    "quiet": ["2020_1_24/029/45"],
    "tremor": ["2020_3_30/011/05"],
    "large": ["2018_2_16/000/35", "2018_2_16/000/40"],
}.items():
    lines = []
    for file in files:
        text = (Path("raw/data") / f"{file}.jsonl").read_text(encoding="utf-8")
        lines += [json.loads(line) for line in text.splitlines() if line.strip()]
    lines.sort(key=lambda line: line["device_t"])
    rows = []
    for line in lines:
        count = len(line["x"])
        times = line["device_t"] - (count - 1 - np.arange(count)) / line.get("sr", 31.25)
        rows.append(np.column_stack([times, line["x"], line["y"], line["z"]]))
    table = np.concatenate(rows)
    table[:, 0] -= table[0, 0]
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,x,y,z", comments="", fmt="%.9g")
