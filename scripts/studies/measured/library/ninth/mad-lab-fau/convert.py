"""Gyros of the sensor on each shoe beside the angles that three optical markers of the shoe turned about its axes.

The markers' rotation since the first half second is that of a rigid body (Kabsch); its rates are turned into the
sensor's axes by the one rotation that fits all of the recording (Wahba), which has no scale. The angles about the
three axes are summed up, and drawn straight between the cameras' rows; both begin at one instant.
"""

import csv

import numpy as np
from scipy.interpolate import interp1d
from scipy.spatial.transform import Rotation
from turned import body_angles

SENSOR, CAMERAS, WINDOW = 204.8, 100.0, 0.1


def columns(file):
    """Columns of a table with two lines of headings, by both."""
    with open(f"raw/example_data/{file}", newline="") as lines:
        first, second, *rows = csv.reader(lines)
    return dict(zip(zip(first, second, strict=True), np.array(rows, float).T, strict=True))


def angles(markers):
    """What the markers (rows, markers, axes) turned about axes that lie forwards, left and up at first."""
    rest = markers[:50].mean(axis=0)
    ahead = (rest[0] - rest[1]) * [1, 1, 0]
    ahead /= np.linalg.norm(ahead)
    body = (rest - rest.mean(axis=0)) @ np.stack((ahead, np.cross([0, 0, 1], ahead), [0, 0, 1]), axis=1)
    u, _, v = np.linalg.svd(np.einsum("ki,nkj->nij", body, markers - markers.mean(axis=1, keepdims=True)))
    proper = np.stack((np.ones(len(u)), np.ones(len(u)), np.linalg.det(u @ v)), axis=1)
    turned = Rotation.from_matrix(np.einsum("nji,nj,nkj->nik", v, proper, u))
    return body_angles(turned)


unit, seen = columns("imu_sample.csv"), columns("mocap_sample.csv")
for side, foot in (("left", "L"), ("right", "R")):
    markers = np.stack([[seen[f"{foot}_{m}", axis] for axis in "xyz"] for m in ("TOE", "FCC", "FM5")]).transpose(
        2, 0, 1
    )
    gyro = np.radians(np.stack([unit[f"{side}_sensor", f"gyr_{axis}"] for axis in "xyz"], axis=1))
    time, turned = np.arange(len(gyro)) / SENSOR, angles(markers)
    frames = np.arange(len(turned)) / CAMERAS
    cells = np.arange(1.0, frames[-1] - 1.0, WINDOW)
    summed = np.concatenate((np.zeros((1, 3)), np.cumsum((gyro[1:] + gyro[:-1]) / 2 / SENSOR, axis=0)))
    of_gyro, of_shoe = (np.diff(interp1d(t, a, axis=0)(cells), axis=0) for t, a in ((time, summed), (frames, turned)))
    mount, _ = Rotation.align_vectors(of_gyro - of_gyro.mean(axis=0), of_shoe - of_shoe.mean(axis=0))
    both = time <= frames[-1]
    table = interp1d(frames, mount.apply(turned), axis=0)(time[both])
    names = [f"{what}{axis}" for what in ("g", "angle_") for axis in "xyz"]
    np.savez(f"{side}.npz", **dict(zip(names, [*gyro[both].T, *table.T], strict=True)))
