"""Systems: one folder each, from its environment to how it is drawn."""
