"""Rates of a bench of a thesis on reactive moments, in whole seconds of arc a second: as read, and behind a filter.

Numbers have commas; the two readings stand beside each other in a file, each with its own count of seconds. Of the
owner's two names that of the mirror comes first.
"""

from pathlib import Path

import numpy as np

HEAD = "time_s,read_arcsec_s,filtered_arcsec_s"

for name, log in zip(("mirror", "stand"), sorted(Path("raw/matlab/11_10_23").glob("*.txt")), strict=True):
    lines = [line.split("\t") for line in log.read_text(encoding="latin-1").replace(",", ".").splitlines()[1:]]
    rows = np.array([[float(x) for x in line[:4]] for line in lines if len(line) >= 4])
    np.savetxt(f"{name}.csv", rows[:, [0, 1, 3]], delimiter=",", header=HEAD, comments="", fmt="%.9g")
