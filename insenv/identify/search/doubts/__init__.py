"""What the search itself says against its being complete."""
