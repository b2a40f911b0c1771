"""Recordings as they come: what a stranger's data file holds, before there is a manifest for it."""
