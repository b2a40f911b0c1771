"""A rate test as text, JSON and page."""
