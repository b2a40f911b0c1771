"""The search as one statistic: the evidence of every shape of every effect at once, for many residuals."""
