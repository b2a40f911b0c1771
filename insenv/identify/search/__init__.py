"""The search: candidates, scan, lines, one round, what was added, and when it ends."""
