"""A helicopter on a bench turned about one axis: its gyro beside the rate of the encoder, in the owner's windows."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

for name, first, last in (("Pitch", 2000, 4225), ("Elevation", 4000, 6501)):
    rows = loadmat(Path(f"raw/Lab3/{name}Rategyrovsencoderoneaxis.mat"))["ans"].T[first:last, :3]
    head = "time_s,encoder_rad_s,gyro_rad_s"
    np.savetxt(f"{name.lower()}.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
