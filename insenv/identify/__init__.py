"""Closing the loop: residual of the declared model, the effect that it lacks, the error before and after."""
