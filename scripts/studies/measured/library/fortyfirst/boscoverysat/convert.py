"""An MPU-6050 in counts that is cooled with a spray, and one that is turned; clocks in milliseconds of 16 bits.

Of the first stand the rows until it is touched again, after 29 s.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/datos/Datos en plano")
head = "time_s,acc_x,acc_y,acc_z,temp,gyro_x,gyro_y,gyro_z"
for name, log, last in (("cold", "temperatura1", 79), ("turned", "giro90EjeY1", None)):
    table = np.genfromtxt(RAW / f"{log}.csv", delimiter=";", skip_header=1)[:last]
    table[:, 0] = (table[:, 0] - table[0, 0]) / 1000
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
