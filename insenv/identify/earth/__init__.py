"""The Earth rate's magnitude as a check: what hides in it, and what it adds to the findings."""
