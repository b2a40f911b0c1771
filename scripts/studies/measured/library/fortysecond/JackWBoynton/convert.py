"""The first of three accelerometers of a monitor of vibrations, at 1 kHz: still, and with fast pulses.

Each reading stands in a line of its own, axes in turn, three readings to a time; the rows' times are those of the rate.
"""

from pathlib import Path

import numpy as np

for name, log in (("shaky", "shaky"), ("faster", "faster_pulse")):
    words = [line.split(",") for line in (Path("raw/data") / f"{log}.csv").read_text().splitlines()]
    at = {key: words[0].index(key) for key in ("field", "channel", "reading")}
    axes = {
        axis: [float(r[at["reading"]]) for r in words[1:] if r[at["field"]] == "A" and r[at["channel"]] == axis]
        for axis in "XYZ"
    }
    rows = min(len(each) for each in axes.values())
    table = np.column_stack([np.arange(rows) / 1000, *(axes[axis][:rows] for axis in "XYZ")])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
