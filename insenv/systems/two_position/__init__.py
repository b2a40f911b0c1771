"""Two-position calibration of a vehicle's sight and inertial system: its environment and how it is drawn."""
