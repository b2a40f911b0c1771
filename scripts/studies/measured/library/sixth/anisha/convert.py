"""Counts of a hand-held IMU beside the angles about its axes by motion capture, at the IMU's times."""

from motion_capture import save

for run in (1, 2, 3):
    save(run)
