"""Counts of a hand-held IMU beside the angles about its axes by motion capture, at the IMU's times."""

from motion_capture import save

for run in (4, 5, 7, 8, 9):
    save(run)
