"""What is asked of a whole unit: whether it moves, is shaken, was switched on anew, or drifts on all its axes."""
