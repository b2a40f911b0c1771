"""A servo motor that a constant torque spins up: time, position and velocity from Matlab's table."""

import numpy as np
from scipy.io import loadmat

held = loadmat("raw/Data/Identification/idf_pos_0.065_1.mat")["data"]
np.savetxt("spin.csv", held[:, [0, 2, 3]], delimiter=",", header="time_s,position,velocity", comments="", fmt="%.10g")
