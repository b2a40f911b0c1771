"""Headings whose unit is known without being stated: those of calibration tools and flight logs.

    Kalibr     timestamp [ns], omega_x..z [rad/s], alpha_x..z [m/s^2]
    PX4 ULog   timestamp [us], gyro_rad[0..2], accelerometer_m_s2[0..2], delta_angle[0..2], delta_velocity[0..2]
    ROS        angular_velocity.x..z [rad/s], linear_acceleration.x..z [m/s^2] of sensor_msgs/Imu, as tables of messages
               have them: beside an orientation or a header, whatever stands before the names

A number in square brackets is an index and no unit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from insenv.data.readers.table import split_unit

_INDEXED = re.compile(r"(?P<name>.*)\[\d+\]")
#: Unit of headings, without index or axis.
_KNOWN: Mapping[str, str] = {
    "gyro_rad": "rad/s",
    "accelerometer_m_s2": "m/s^2",
    "delta_angle": "rad",
    "delta_velocity": "m/s",
    "omega_x": "rad/s",
    "omega_y": "rad/s",
    "omega_z": "rad/s",
    "alpha_x": "m/s^2",
    "alpha_y": "m/s^2",
    "alpha_z": "m/s^2",
}
_STAMPS = ("timestamp", "timestamp_sample")
_OF_ROS = re.compile(r"(?:.*\.)?(?P<field>angular_velocity|linear_acceleration)\.[xyz]")
_UNITS_OF_ROS: Mapping[str, str] = {"angular_velocity": "rad/s", "linear_acceleration": "m/s^2"}
_BESIDE = re.compile(r"(?:.*\.)?(header\.(seq|stamp|frame_id|stamp\.\w+)|orientation\.[xyzw])")


def unit_of(names: Sequence[str], column: int) -> str | None:
    """Unit that the heading of a column states, or is known by among the other headings; else None."""
    name = names[column].strip()
    if (field := ros_field(names, column)) is not None:
        return _UNITS_OF_ROS[field]
    indexed = _INDEXED.fullmatch(name)
    bare = [match["name"] if (match := _INDEXED.fullmatch(one.strip())) else one.strip() for one in names]
    if name in _STAMPS:
        if {"omega_x", "omega_y", "omega_z"} & set(bare):
            return "ns"
        if {"gyro_rad", "accelerometer_m_s2", "delta_angle"} & set(bare):
            return "us"
    if len({*bare} & {*_KNOWN, *_STAMPS}) > 1 and bare[column] in _KNOWN:
        return _KNOWN[bare[column]]
    return None if indexed else split_unit(name)[1]


def ros_field(names: Sequence[str], column: int) -> str | None:
    """The field of sensor_msgs/Imu that a heading among the others of a message is; None of other columns."""
    found = _OF_ROS.fullmatch(names[column].strip())
    return found["field"] if found and any(_BESIDE.fullmatch(one.strip()) for one in names) else None
