"""Rows of a target on even cells, and what the table did on them."""
