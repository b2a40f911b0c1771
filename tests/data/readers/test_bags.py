"""ROS bags of both versions, written here byte by byte as their formats say."""

from __future__ import annotations

import bz2
import sqlite3
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from insenv.close import close
from insenv.core.errors import InputError
from insenv.data.init import init
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest

IMU = (
    "Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance # row major\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
)
PARTS = (
    f"\n{80 * '='}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    f"{80 * '='}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
    f"{80 * '='}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
)
#: A message of somebody's own, with an Imu in it behind a text, a list and a constant.
OWN = (
    f"uint8 KIND=3\nint16 count\nstring raw\nfloat32[] list\nsensor_msgs/Imu imu{PARTS}"
    f"{80 * '='}\nMSG: sensor_msgs/Imu\n{IMU}"
)
T0 = 1700000000
ROWS = 400


def samples() -> tuple[np.ndarray, np.ndarray]:
    """Times since T0 [s], and rates and forces, shape (rows, 6)."""
    rng = np.random.default_rng(3)
    means = [0.01, -0.02, 0.005, 0.1, -0.2, 9.8]
    return 0.02 * np.arange(ROWS), means + rng.normal(0, [1e-3] * 3 + [1e-2] * 3, (ROWS, 6))


def record(fields: dict[str, bytes], body: bytes) -> bytes:
    head = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in fields.items())
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(body)) + body


def imu_body(seq: int, t: float, row: np.ndarray, stamped: bool = True) -> bytes:
    stamp = struct.pack("<II", T0 + int(t), round(1e9 * (t % 1))) if stamped else bytes(8)
    head = struct.pack("<I", seq) + stamp + struct.pack("<I", 3) + b"imu"
    return head + struct.pack("<4d9d3d9d3d9d", *[0.0] * 13, *row[:3], *[0.0] * 9, *row[3:], *[0.0] * 9)


def version_1(path: Path, pressed: str = "none", own: bool = False, stamped: bool = True, lost: int = 0) -> Path:
    kind, text = ("me/Own", OWN) if own else ("sensor_msgs/Imu", IMU + PARTS)
    about = {"topic": b"/imu/data", "type": kind.encode(), "md5sum": b"0", "message_definition": text.encode()}
    connection = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in about.items())
    chunk = record({"op": b"\x07", "conn": bytes(4), "topic": b"/imu/data"}, connection)
    for seq, (t, row) in enumerate(zip(*samples(), strict=True)):
        body = imu_body(seq, t, row, stamped)
        if own:
            body = struct.pack("<hI", 7, 5) + b"$VNYM" + struct.pack("<I2f", 2, 1.0, 2.0) + body
        at = struct.pack("<II", T0 + int(t), round(1e9 * (t % 1)))
        chunk += record({"op": b"\x02", "conn": bytes(4), "time": at}, body)
    data = bz2.compress(chunk) if pressed == "bz2" else chunk
    size = struct.pack("<I", len(chunk))
    whole = b"#ROSBAG V2.0\n" + record({"op": b"\x03", "index_pos": bytes(8)}, b" " * 100)
    whole += (
        record({"op": b"\x05", "compression": pressed.encode(), "size": size}, data) if pressed != "open" else chunk
    )
    path.write_bytes(whole[: len(whole) - lost])
    return path


def version_2(path: Path, kind: str = "sensor_msgs/msg/Imu") -> Path:
    bag = sqlite3.connect(path)
    bag.execute("CREATE TABLE topics (id INTEGER, name TEXT, type TEXT, serialization_format TEXT)")
    bag.execute("CREATE TABLE messages (id INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    bag.execute("INSERT INTO topics VALUES (1, '/imu', ?, 'cdr')", (kind,))
    for k, (t, row) in enumerate(zip(*samples(), strict=True)):
        body = struct.pack("<iII", T0 + int(t), round(1e9 * (t % 1)), 9) + b"imu_link\0"
        body += bytes(-len(body) % 8) + struct.pack(
            "<4d9d3d9d3d9d", *[0.0] * 13, *row[:3], *[0.0] * 9, *row[3:], *[0.0] * 9
        )
        bag.execute("INSERT INTO messages VALUES (?, 1, ?, ?)", (k, T0 * 10**9 + round(1e9 * t), b"\0\1\0\0" + body))
    bag.commit()
    bag.close()
    return path


def read(path: Path) -> np.ndarray:
    """Times since the first row, rates and forces, as `insenv init` has the bag read."""
    manifest = path.with_suffix(".toml")
    init([path], manifest)
    (run,) = read_recordings(load_manifest(manifest))
    names = [f"{kind}_{axis}" for kind in ("gyro", "accel") for axis in "xyz"]
    return np.column_stack([run.t, *(run.channels[name].values for name in names)])


@pytest.mark.parametrize("how", [{}, {"pressed": "bz2"}, {"pressed": "open"}, {"own": True}, {"stamped": False}])
def test_a_bag_of_version_1_is_read(tmp_path: Path, how: dict[str, Any]) -> None:
    t, rows = samples()
    np.testing.assert_allclose(read(version_1(tmp_path / "a.bag", **how)), np.column_stack([t, rows]), atol=1e-6)


def test_a_bag_of_ros_2_is_read(tmp_path: Path) -> None:
    t, rows = samples()
    np.testing.assert_allclose(read(version_2(tmp_path / "a.db3")), np.column_stack([t, rows]), atol=1e-6)


def test_a_bag_that_was_cut_off_is_read_to_its_last_message(tmp_path: Path) -> None:
    _, rows = samples()
    found = read(version_1(tmp_path / "a.bag", pressed="open", lost=100))
    np.testing.assert_allclose(found[:, 1:], rows[:-1], atol=1e-6)


def test_the_loop_closes_on_a_bag(tmp_path: Path) -> None:
    path = version_1(tmp_path / "a.bag")
    init([path], tmp_path / "a.toml")
    biases = [target.estimates_after[0].value for target in close(tmp_path / "a.toml").targets]
    np.testing.assert_allclose(biases, [0.01, -0.02, 0.005, 0.1, -0.2, 9.8], atol=3e-3)


def test_what_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="compressed by lz4; wanted it without"):
        read(version_1(tmp_path / "a.bag", pressed="lz4"))
    with pytest.raises(
        InputError, match=r"does not define its messages, such as those of /imu; wanted sensor_msgs/Imu"
    ):
        read(version_2(tmp_path / "b.db3", "me/msg/Own"))
    (tmp_path / "c.bag").write_bytes(b"#ROSBAG V1.2\n" + bytes(100))
    with pytest.raises(InputError, match="no ROS bag of version 2.0"):
        read(tmp_path / "c.bag")
    (tmp_path / "d.db3").write_bytes(b"SQLite format 3\0" + bytes(100))
    with pytest.raises(InputError, match="cannot be read as a ROS bag"):
        read(tmp_path / "d.db3")
