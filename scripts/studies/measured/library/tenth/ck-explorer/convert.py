"""The owner's rows with the number of the attitude beside them: 100 rows in each, as its readings jump."""

import numpy as np

rows = np.genfromtxt("raw/Data Examples/acc_log.csv", delimiter=",", skip_header=1)
number = np.arange(len(rows)) // 100
np.savetxt(
    "attitudes.csv", np.column_stack((rows, number)), fmt="%.7g", delimiter=",", header="ax,ay,az,attitude", comments=""
)
