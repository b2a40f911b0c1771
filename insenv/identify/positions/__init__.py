"""A triad that is held still in many attitudes: rests, models, search and findings."""
