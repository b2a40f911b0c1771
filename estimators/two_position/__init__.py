"""Two-position calibration of a vehicle's sight and inertial system: estimators and policies."""
