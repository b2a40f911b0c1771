"""The turn rate of an odometry beside the course of a reference's positions, on the odometry's rows.

The course between two positions is that of the middle between them, drawn straight from one to the next. Rows slower
than a limit have no course and are left out.
"""

import numpy as np

DATA = "raw/datasets"


def lines(file: str, word: str) -> np.ndarray:
    """Numbers of the lines that begin with a word."""
    with open(f"{DATA}/{file}", encoding="utf-8") as rows:
        return np.array([[float(x) for x in row.split()[1:]] for row in rows if row.startswith(word + " ")])


def save(name: str, time: np.ndarray, rate: np.ndarray, at: np.ndarray, place: np.ndarray, slow: float) -> None:
    """Write the rows that are faster than `slow` [m/s]; `place` is east and north [m]."""
    step = np.diff(place, axis=0)
    middle, speed = (at[1:] + at[:-1]) / 2, np.hypot(step[:, 0], step[:, 1]) / np.diff(at)
    moving = speed > slow
    course = np.unwrap(np.arctan2(step[moving, 1], step[moving, 0]))
    fast = np.interp(time, middle, speed, left=0.0, right=0.0) > slow
    np.savez(name, t=time[fast], wz=rate[fast], course=np.interp(time[fast], middle[moving], course))


hall, hall_truth = lines("SLAM/Lecture_Hall_Input.txt", "odom2"), lines("SLAM/Lecture_Hall_GT.txt", "point2")
save("hall.npz", hall[:, 0], hall[:, 3], hall_truth[:, 0], hall_truth[:, 1:3], 0.3)

car = lines("smartLoc/Berlin_Potsdamer_Platz_Input.txt", "odom3")
truth = lines("smartLoc/Berlin_Potsdamer_Platz_GT.txt", "point3")
first = truth[0, 1:4]
lon, lat = np.arctan2(first[1], first[0]), np.arctan2(first[2], np.hypot(first[0], first[1]))
east = np.array([-np.sin(lon), np.cos(lon), 0.0])
north = np.array([-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)])
away = truth[:, 1:4] - first
save("car.npz", car[:, 0], car[:, 6], truth[:, 0], np.column_stack((away @ east, away @ north)), 1.0)
