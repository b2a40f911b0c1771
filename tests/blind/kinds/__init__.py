"""Kinds of cases that are put to the loop, a file each."""
