"""A small aircraft in flight: the rates of its body as its inertial navigation with GPS has them, at the gyros' rows.

The attitude's change from the row before to the row after (40 ms; of the second aircraft 16 ms) over that time.
The first is airborne until 560 s, its navigation has settled at 60 s; of the second 200 s in the air are taken.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

RAW = Path("raw/flight_data")


def rates(time, w, x, y, z):
    """Rates about the body's axes between the rows before and after; ends are of one side."""
    q = np.column_stack([w, x, y, z])
    q /= np.linalg.norm(q, axis=1)[:, None]
    a, b = q[:-2], q[2:]
    turned = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    turned *= np.sign((a * b).sum(1))[:, None]
    size = np.linalg.norm(turned, axis=1)
    angle = 2 * np.arcsin(np.minimum(size, 1.0))
    return turned * (angle / np.maximum(size, 1e-15) / (time[2:] - time[:-2]))[:, None]


FLIGHT = RAW / "thor_flight75_WaypointTracker_150squareWaypointNew_2012_10_10.mat"
flight = loadmat(FLIGHT, squeeze_me=True)["flight_data"]
of = {name: np.asarray(flight[name].item(), float) for name in ("time", "p", "q", "r", "phi", "theta", "psi")}
rows = (of["time"] > 60.0) & (of["time"] < 560.0)
of = {name: values[rows] for name, values in of.items()}
(cr, cp, cy), (sr, sp, sy) = (
    [f(of[name] / 2) for name in ("phi", "theta", "psi")] for f in (np.cos, np.sin)
)  # fmt: skip
body = rates(
    of["time"],
    cr * cp * cy + sr * sp * sy,
    sr * cp * cy - cr * sp * sy,
    cr * sp * cy + sr * cp * sy,
    cr * cp * sy - sr * sp * cy,
)
table = np.column_stack([of["time"][1:-1], *(of[name][1:-1] for name in "pqr"), body])
head = "time_s,p,q,r,nav_p,nav_q,nav_r"
np.savetxt("thor.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")

log = np.genfromtxt(RAW / "Proto/Proto_FLT09_vehicle_attitude_0.csv", delimiter=",", skip_header=1)
time = (log[:, 0] - log[0, 0]) / 1e6
log, time = (each[(time > 300.0) & (time < 500.0)] for each in (log, time))
body = rates(time, *log[:, 4:8].T)
table = np.column_stack([time[1:-1], log[1:-1, 1:4], body])
np.savetxt("proto.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
