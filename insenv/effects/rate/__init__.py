"""Errors that follow the input rate: its scale, the response to it, and what it left behind."""
