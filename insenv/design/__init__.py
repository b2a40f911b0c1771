"""Procedures designed: the best use of an instrument's time, as a scenario that runs, with proof.

A kind of task says what is free, what the plant makes of it, and what that tells (`insenv.design.kind`); the search,
the Pareto front, the file, the Monte Carlo and the report are the same for all.
"""
