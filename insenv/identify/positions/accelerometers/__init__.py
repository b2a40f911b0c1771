"""Accelerometers of a triad at rest: the magnitude of gravity, in attitudes that are unknown or stated."""
