"""Monte Carlo over many runs: the same function on one process, on several, or on a cluster.

    table = job(seeds),     row i of the sweep is the run with seed ``first + i``

A job is a picklable function of seeds; what it gives of a run depends on that run's seed alone. So neither the back end
nor how the runs are cut into chunks can change a bit of the result. It is kept chunk by chunk in a store, from which a
sweep that was killed goes on (`insenv.sweep.store`).
"""

from __future__ import annotations

from insenv.sweep.backends import Backend, Cluster, LostError, Processes, Serial, backend
from insenv.sweep.drive import sweep
from insenv.sweep.store import Folder, Identity, Job, Memory, Store, Table, stacked

__all__ = [
    "Backend",
    "Cluster",
    "Folder",
    "Identity",
    "Job",
    "LostError",
    "Memory",
    "Processes",
    "Serial",
    "Store",
    "Table",
    "backend",
    "stacked",
    "sweep",
]
