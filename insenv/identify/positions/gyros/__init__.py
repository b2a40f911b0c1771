"""Gyros of a triad in many attitudes: their rotations from rest to rest, and their means at rest."""
