"""Strapdown mechanisation: its loops, and what error-free instruments sense on a known path."""
