"""Two gyros of a cube at rest: counts as they were read."""

import numpy as np
from scipy.io import loadmat

held = loadmat(
    "raw/2_1D_Modell/2_4_Experimente/V2___Sensoren_Winkelgeschwindigkeit_Auswertung/Messwerte/Sensoren_phi_d.mat"
)
rows = np.column_stack([held[key].ravel().astype(float) for key in ("t", "phi1__d", "phi2__d")])
np.savetxt("rest.csv", rows, delimiter=",", header="time_s,gyro_1,gyro_2", comments="", fmt="%.8g")
