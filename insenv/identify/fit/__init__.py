"""Bins, noise and generalised least squares: one target as a linear model, and how sure its parameters are."""
