"""Instruments: an input axis and a chain of effects."""
