"""Pitch and pitch speed of a two-rotor rig in one table."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

folder = Path("raw/Chapter 4 - Control of Dual-Rotor Plant/Pitch Coefficients/data")
pitch = loadmat(folder / "pitch.mat")["pitch"]
speed = loadmat(folder / "pitch_speed.mat")["pitch_speed"]
table = np.column_stack([pitch[0], pitch[1], speed[1]])
np.savetxt("pitch.csv", table, delimiter=",", header="time_s,pitch,pitch_speed", comments="", fmt="%.9g")
