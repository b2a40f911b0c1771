"""Telephones on a table, as phyphox writes them, and one that rides a lift."""

from pathlib import Path

import numpy as np

LOGS = {"table": "acelerometro", "longer": "acelerometro_Mack4_PauloSimoes", "lift": "elevador_residencial_02"}
for name, log in LOGS.items():
    table = np.genfromtxt(Path(f"raw/{log}.csv"), delimiter=",", skip_header=1)[:, :4]
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
