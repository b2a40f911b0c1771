"""From recordings to problems: bins, declared model, lines in samples and bins, and whether what is left is noise."""
