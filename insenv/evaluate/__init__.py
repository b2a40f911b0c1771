"""Estimators and policies judged over many runs."""
