"""Estimators and policies of a whole inertial unit on a table of two or three axes."""
