"""The two halves of a satellite in a can after they have landed: accelerometers in counts and a thermometer.

Rows of one count of the clock, taken as a second.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/Docs/Donnee finales CANSAT")
for name, log, first, column in (("top", "TOP_02", 312, 14), ("bottom", "BOT_02", 200, 15)):
    held = np.genfromtxt(RAW / f"{log}.CSV", delimiter=",", invalid_raise=False)[first:598]
    table = np.column_stack([held[:, -1] - held[0, -1], held[:, 10:13], held[:, column]])
    table = table[np.r_[True, np.diff(table[:, 0]) > 0]]
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z,temp", comments="", fmt="%.9g")
