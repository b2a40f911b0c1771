"""Time, angle and rate of the arm from one session of the archive."""

from io import TextIOWrapper
from zipfile import ZipFile

import numpy as np

SESSION = "experiments/pinned_sessions_thesis_20260209/session_20260209_095908/balance_log.csv"

with ZipFile("raw/experiments/pinned_sessions_thesis_20260209.zip") as archive, archive.open(SESSION) as file:
    rows = np.genfromtxt(TextIOWrapper(file, "utf-8"), delimiter=",", skip_header=1, usecols=(0, 3, 4))
rows = rows[np.isfinite(rows).all(axis=1)]
rows[:, 0] = (rows[:, 0] - rows[0, 0]) / 1e3
np.savetxt("balance.csv", rows, delimiter=",", header="time_s,angle_deg,rate_deg_s", comments="", fmt="%.9g")
