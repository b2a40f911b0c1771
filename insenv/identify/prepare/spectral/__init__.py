"""Lines of samples and means: found, told from those of motion and counters, and taken out."""
