"""Every third, and every twentieth position of the bench, each written four times as a rest of its own.

A line of the owner's file is the mean of 21 readings in one position; a rest has several rows.
"""

import numpy as np

ROWS = 4

means = np.loadtxt("raw/meassure_data/razor_9dof/meanListAccel.csv", delimiter=",")
for name, first, step in (("bench432", 0, 3), ("bench65", 10, 20)):
    positions = means[first::step]
    labels = np.repeat(np.arange(len(positions)), ROWS)
    np.savetxt(
        f"{name}.csv",
        np.column_stack((np.arange(len(labels)), labels, positions[labels])),
        fmt=["%d", "%d", "%.6f", "%.6f", "%.6f"],
        delimiter=",",
        header="t,position,ax,ay,az",
        comments="",
    )
