"""Recordings of several units judged together: what is common to them, what is a unit's own, who is an outlier."""
