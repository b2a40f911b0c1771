"""Cart with four optical markers: its rates beside the heading of the line from the first to the third marker.

The owner's y axis points up. Rows without markers are left out; the wheels' angles are those of the right one less
those of the left one.
"""

import numpy as np

for number in (4, 8, 10):
    rows = np.genfromtxt(f"raw/examples/isencart/data/data_{number}.txt", delimiter=",", skip_header=1)
    rows = rows[(rows[:, 1:17].reshape(-1, 4, 4)[:, :, 1:] != 0.0).all(axis=(1, 2))]
    line = rows[:, 10:13] - rows[:, 2:5]
    heading = -np.unwrap(np.arctan2(line[:, 2], line[:, 0]))
    np.savetxt(
        f"cart{number}.csv",
        np.column_stack((rows[:, 0] - rows[0, 0], rows[:, 21:24], heading, rows[:, 17] - rows[:, 18])),
        fmt="%.7f",
        delimiter=",",
        header="t,wx,wy,wz,heading,wheels",
        comments="",
    )
