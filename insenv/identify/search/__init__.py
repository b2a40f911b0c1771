"""The search: candidates, scan, one round, what was added, its rivals, and when it ends."""
