"""Bodies and instruments at rest: static alignment, bias and its stability."""
