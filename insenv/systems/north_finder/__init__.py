"""The rate-biased north finder: its environment and how it is drawn."""
