"""ROS bags: of version 1 (``.bag``) and of ROS 2 in SQLite (``.db3``), without ROS.

A column is a number of the messages of one topic, as ``/imu/data.angular_velocity.x``; ``/imu/data.time`` is their
header's stamp, or the time at which they were recorded where the stamps stand still or run backwards. A message is
decoded by the definition of its type that the bag holds, or by those of `STANDARD`: fields one after another, of ROS 2
each at a multiple of its size. Numbers behind a list of messages, which is of any length, are not looked for.

Source: the ROS wiki, Bags/Format/2.0 and msg; OMG DDS-XTypes 1.3, 7.4 (XCDR1).
"""

from __future__ import annotations

import bz2
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.data.readers.arrays import table_of
from insenv.data.readers.table import Column, Table, check_size, decoding

#: Codes of `struct` for the fields of a message.
_PRIMITIVES: Mapping[str, str] = {
    "bool": "?", "char": "B", "byte": "b", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
#: Definitions of messages that ROS 2 bags do not hold themselves.
STANDARD: Mapping[str, str] = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Pose": "Point position\nQuaternion orientation",
    "geometry_msgs/PoseStamped": "std_msgs/Header header\nPose pose",
    "geometry_msgs/PoseWithCovariance": "Pose pose\nfloat64[36] covariance",
    "geometry_msgs/Transform": "Vector3 translation\nQuaternion rotation",
    "geometry_msgs/TransformStamped": "std_msgs/Header header\nstring child_frame_id\nTransform transform",
    "geometry_msgs/Twist": "Vector3 linear\nVector3 angular",
    "geometry_msgs/TwistStamped": "std_msgs/Header header\nTwist twist",
    "geometry_msgs/TwistWithCovariance": "Twist twist\nfloat64[36] covariance",
    "geometry_msgs/Vector3Stamped": "std_msgs/Header header\nVector3 vector",
    "nav_msgs/Odometry": "std_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist",
    "sensor_msgs/Imu": "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
    "float64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance",
    "sensor_msgs/MagneticField": "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field",
    "sensor_msgs/Temperature": "std_msgs/Header header\nfloat64 temperature\nfloat64 variance",
}
#: Units of fields of these names, whatever message they are of (REP 103).
_UNITS: Mapping[str, str] = {
    "time": "s",
    "angular_velocity": "rad/s",
    "linear_acceleration": "m/s^2",
    "twist.angular": "rad/s",
}
_SEPARATED = re.compile(r"^=+\s*$\n^(?:MSG|IDL): *(\S+)\s*$", re.M)
_FIELD = re.compile(r"([\w/]+)(\[[<=\d]*\])? +(\w+)")
_STAMP = re.compile(r"stamp\.(secs|sec)$")
#: Fields that no channel reads: other stamps, and covariances.
_NEVER = re.compile(r"stamp\.n?(nano)?secs?$|covariance\.\d+$|header\.seq$", re.I)
#: Fewest messages of a topic that is listed, and most numbers of one list in a message.
_FEWEST, _MOST = 2, 512
#: Share of the stamps of headers that run forwards where they are times at all.
_FORWARDS = 0.9
_CHUNK, _CONNECTION, _MESSAGE = b"\x05", b"\x07", b"\x02"


def read_bag(path: Path, columns: Sequence[Column]) -> Table:
    """Wanted columns of the messages of a bag, of one topic.

    Raises
    ------
    InputError
        If the bag is damaged, compressed by what the standard library has not, or lacks a column.
    """
    topics = {str(column.key).partition(".")[0] for column in columns}
    return table_of(path, columns, bag_arrays(path, topics))


def unit_of(key: str) -> str | None:
    """Unit of a column of that name, where messages have one."""
    name = key.partition(".")[2].removesuffix(key[-2:] if key[-2:] in (".x", ".y", ".z") else "")
    return next((unit for end, unit in _UNITS.items() if name == end or name.endswith(f".{end}")), None)


def bag_arrays(path: Path, topics: set[str] | None = None) -> dict[str, Floats]:
    """Numbers of all messages, or of those of some ``topics``, by the names of their columns.

    Raises
    ------
    InputError
        As `read_bag`.
    """
    with decoding(path, "a ROS bag"):
        ros2 = path.suffix.lower() == ".db3"
        found: dict[str, _Topic] = {}
        for name, kind, definition, stamp, body in _of_sqlite(path) if ros2 else messages_of_bag(path):
            if topics is None or name in topics:
                topic = found.get(name)
                if topic is None:
                    topic = found[name] = _Topic(_plan(kind, definition, ros2), ros2)
                topic.take(stamp, body)
    if topics is None and found and not any(topic.plan for topic in found.values()):
        first = next(iter(found))
        raise InputError(f"{path}: does not define its messages, such as those of {first}; wanted sensor_msgs/Imu")
    return {f"{name}.{key}": values for name, topic in found.items() for key, values in topic.columns().items()}


# ------------------------------------------------------------------------------------------------- messages


@dataclass(frozen=True)
class _Step:
    """Numbers of one kind that follow each other, ``names`` of them; "string" or "list" are passed over."""

    code: str
    names: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        return struct.calcsize(f"<{self.code}")


@dataclass
class _Topic:
    """The messages of a topic, as they come."""

    plan: tuple[_Step, ...]
    aligned: bool
    stamps: list[float] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def take(self, stamp: float, body: bytes) -> None:
        self.stamps.append(stamp)
        self.rows.append(tuple(_numbers(self.plan, body[4:] if self.aligned else body, self.aligned)))

    def columns(self) -> dict[str, Floats]:
        """Numbers by the names of their fields, and the time [s]."""
        names = [name for step in self.plan for name in step.names]
        if len(self.rows) < _FEWEST or not names:
            return {}
        values = np.array(self.rows, dtype=np.float64)
        found = {name: values[:, i] for i, name in enumerate(names)}
        recorded = np.array(self.stamps)
        for whole in [name for name in names if _STAMP.search(name)]:
            fraction = f"{whole[:-4]}nsecs" if whole.endswith("s") else f"{whole[:-3]}nanosec"
            stamped = found.pop(whole) + 1e-9 * found.pop(fraction, np.zeros(len(self.rows)))
            if stamped[0] > 0 and float(np.mean(np.diff(stamped) > 0)) > _FORWARDS:
                recorded = stamped
                break
        others = {name: one for name, one in found.items() if not _NEVER.search(name)}
        return {"time": recorded, **others}


def _numbers(plan: Sequence[_Step], body: bytes, aligned: bool) -> Iterator[float]:
    """Numbers of one message."""
    at = 0
    for step in plan:
        size = 4 if step.code == "string" else step.size
        if step.code == "string" or not step.names:
            at += -at % 4 if aligned else 0
            (count,) = struct.unpack_from("<I", body, at)
            at += 4
            if step.code != "string" and aligned and count:
                at += -at % size
            at += count * (1 if step.code == "string" else size)
            continue
        at += -at % size if aligned else 0
        yield from struct.unpack_from(f"<{len(step.names)}{step.code}", body, at)
        at += size * len(step.names)


def _plan(kind: str, definition: str, ros2: bool) -> tuple[_Step, ...]:
    """What a message holds, as far as it is of numbers, texts and lists of numbers."""
    known = {**(STANDARD if ros2 else {"std_msgs/Header": "uint32 seq\ntime stamp\nstring frame_id"})}
    parts = _SEPARATED.split(definition)
    own = {_bare(name): text for name, text in zip(parts[1::2], parts[2::2], strict=True)}
    known |= own | ({_bare(kind): parts[0]} if parts[0].strip() else {})
    steps: list[_Step] = []
    for code, name in _fields(_bare(kind), "", known):
        if code == "end":
            break
        if steps and name and steps[-1].names and steps[-1].code == code:
            steps[-1] = _Step(code, (*steps[-1].names, name))
        else:
            steps.append(_Step(code, (name,) if name else ()))
    return tuple(steps)


def _bare(kind: str) -> str:
    """``package/Name`` of a type, which ROS 2 writes ``package/msg/Name``."""
    return kind.replace("/msg/", "/")


def _fields(kind: str, prefix: str, known: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Codes and names of the fields of a type; "" names what is passed over, "end" is where nobody can go on."""
    if kind not in known:
        yield "end", ""
        return
    for line in known[kind].splitlines():
        text = line.partition("#")[0].strip()
        match = _FIELD.match(text)
        if match is None or "=" in text.replace("<=", ""):
            continue
        inner, many, name = match.groups()
        inner, name = _bare(inner), prefix + name
        count = int(many[1:-1]) if many and many[1:-1].isdigit() else None
        code = "string" if inner in ("string", "wstring") else _PRIMITIVES.get(inner)
        if many and count is None:
            yield (code, "") if code not in (None, "string") else ("end", "")
        elif count is not None and code not in (None, "string") and count <= _MOST:
            yield from ((str(code), f"{name}.{i}") for i in range(count))
        elif many:
            yield "end", ""
        elif inner in ("time", "duration"):
            yield from (("I", f"{name}.secs"), ("I", f"{name}.nsecs"))
        elif code is not None:
            yield code, "" if code == "string" else name
        else:
            full = (
                inner
                if "/" in inner
                else "std_msgs/Header"
                if inner == "Header"
                else f"{kind.rpartition('/')[0]}/{inner}"
            )
            yield from _fields(full, f"{name}.", known)


# --------------------------------------------------------------------------------------------- files of bags


class Message(NamedTuple):
    """A message with its topic, the name and the definition of its type, and the time of its recording [s]."""

    topic: str
    kind: str
    definition: str
    recorded: float
    body: bytes


def messages_of_bag(path: Path) -> Iterator[Message]:
    """Messages of a bag of version 1, in the file's order.

    Raises
    ------
    InputError
        If it is none, or compressed by what the standard library has not.
    """
    content = path.read_bytes()
    if not content.startswith(b"#ROSBAG V2.0\n"):
        raise InputError(f"{path}: is no ROS bag of version 2.0; wanted one, or format = 'text' where it holds a table")
    topics: dict[bytes, tuple[str, str, str]] = {}
    for fields, body in _records(path, content[13:]):
        if fields.get(b"op") == _CONNECTION:
            about = dict(_pairs(body))
            definition = about.get(b"message_definition", b"").decode("utf-8", "replace")
            kind = about.get(b"type", b"").decode("utf-8", "replace")
            topics[fields[b"conn"]] = fields[b"topic"].decode("utf-8", "replace"), kind, definition
        elif fields.get(b"op") == _MESSAGE:
            seconds, nanoseconds = struct.unpack("<II", fields[b"time"])
            yield Message(*topics[fields[b"conn"]], seconds + 1e-9 * nanoseconds, body)


def _records(path: Path, data: bytes) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    """Fields of the header, and the data, of each record; chunks are opened. A last one that is cut off ends them."""
    at = 0
    while at + 4 <= len(data):
        head, at = _counted(data, at)
        body, at = _counted(data, at)
        if at > len(data):
            return
        fields = dict(_pairs(head))
        if fields.get(b"op") != _CHUNK:
            yield fields, body
            continue
        pressed = fields.get(b"compression", b"none")
        if pressed == b"bz2":
            check_size(path, struct.unpack("<I", fields[b"size"])[0], len(body))
            body = bz2.decompress(body)
        elif pressed != b"none":
            raise InputError(f"{path}: compressed by {pressed.decode()}; wanted it without (rosbag decompress)")
        yield from _records(path, body)


def _pairs(head: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 0
    while at < len(head):
        pair, at = _counted(head, at)
        key, _, value = pair.partition(b"=")
        yield key, value


def _counted(data: bytes, at: int) -> tuple[bytes, int]:
    """What stands behind its length, and the place after it."""
    (size,) = struct.unpack_from("<I", data, at) if at + 4 <= len(data) else (len(data),)
    return data[at + 4 : at + 4 + size], at + 4 + size


def _of_sqlite(path: Path) -> Iterator[Message]:
    """Messages of a bag of ROS 2, in the order of their recording."""
    import sqlite3  # slow to import

    source: Any = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)
    try:
        own: dict[str, str] = {}
        if source.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'").fetchone():
            rows = source.execute("SELECT topic_type, encoded_message_definition FROM message_definitions")
            own = {str(kind): str(text) for kind, text in rows}
        topics = {i: (n, k) for i, n, k in source.execute("SELECT id, name, type FROM topics")}
        for topic, stamp, body in source.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp"):
            name, kind = topics[topic]
            yield Message(str(name), str(kind), own.get(kind, ""), 1e-9 * stamp, bytes(body))
    finally:
        source.close()
