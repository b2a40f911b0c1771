"""What the heading of a column says: which channel, which axis, which unit.

    "Gyroscope X (deg/s)"  ->  gyro, x, deg/s            "gyr_x"     ->  gyro, x, no unit
    "time_us"              ->  time, us                  "dvz [m/s]" ->  accel, z, m/s, an increment

Words are those that data files use (ROS, PX4, pyins, gnss-ins-sim, NaveGo, phones, loggers); a heading that has none of
them says nothing, and a word of another quantity (magnetometer, attitude, covariance) makes the column none of ours.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

from insenv.core.errors import InputError
from insenv.core.units import scale_to_si
from insenv.data.readers.table import split_unit

#: Dimension of a channel's unit; of its increment.
DIMENSION: Mapping[str, str] = {
    "time": "time",
    "gyro": "rate",
    "accel": "acceleration",
    "table_rate": "rate",
    "table_angle": "angle",
    "temperature": "temperature",
}
INCREMENT: Mapping[str, str] = {"gyro": "angle", "accel": "velocity", "table_rate": "angle"}

_TEMPERATURE = {"temp", "temperatur", "temperatura", "temperature", "temperatures", "tmp", "thermistor"}
_GYRO = {"gyro", "gyros", "gyr", "gyroscope", "gyroscopes", "omega", "angvel", "wb", "wib"} | {
    "fog",
    "rlg",
    "gyroadc",
    "gyroskop",
    "giroscopio",
    "giro",
    "winkelgeschwindigkeit",
    "drehrate",
}
_ACCEL = {"acc", "accel", "accels", "accelerometer", "accelerometers", "acceleration", "accelerations", "fb", "fib"} | {
    "highg",
    "lowg",
    "accl",
    "accadc",
    "acel",
    "acelerometro",
    "aceleracion",
    "aceleracao",
    "accelerometre",
    "beschleunigung",
}
_GYRO_STEP = {"dtheta", "dth", "dang", "deltaangle", "wm"}
_ACCEL_STEP = {"dv", "dvel", "deltavelocity", "vm"}
_TABLE = {"table", "turntable", "command", "commanded", "cmd", "setpoint", "reference", "ref", "input", "encoder"} | {
    "enc",
    "stage",
    "spindle",
    "motor",
}
#: With a word for a rate they are the table's, if no gyro is spoken of.
_DONE = {"actual", "act", "desired", "ist", "soll"}
#: Directions of a vehicle in words: axes, behind which a rate or an acceleration is meant.
_TURNS = {"roll": "x", "pitch": "y", "yaw": "z"}
_WAYS = {
    **dict.fromkeys(("long", "longitudinal"), "x"),
    **dict.fromkeys(("lat", "lateral"), "y"),
    **dict.fromkeys(("vert", "vertical"), "z"),
}
_RATE = {"rate", "rates", "speed", "velocity", "vel", "omega", "rpm", "dps", "w"}
_ANGLE = {"angle", "angles", "position", "pos", "azimuth", "az", "theta", "phi"}
_TIME = {
    "time",
    "times",
    "timestamp",
    "timestamps",
    "stamp",
    "t",
    "ts",
    "epoch",
    "unixtime",
    "elapsed",
    "sow",
    "tow",
    "gpst",
    "gpstime",
} | {
    "zeit",
    "tiempo",
    "tempo",
    "temps",
    "ustime",
    "mstime",
    "timeus",
    "seconds",
    "millis",
    "micros",
}
_ROW = {"row", "rows", "index", "idx", "n", "sample", "samples", "count", "counter", "frame", "packet", "seq", "no"} | {
    "id",
    "number",
    "unnamed",
}
_SEGMENT = {"segment", "segments", "part", "section", "label", "phase"}
_OTHER = (
    {"mag", "magn", "magnetometer", "magnetic", "field", "quat", "quaternion", "qw", "qx", "qy", "qz", "roll", "pitch"}
    | {"yaw", "heading", "euler", "orientation", "attitude", "lat", "latitude", "lon", "longitude", "alt", "altitude"}
    | {"baro", "pressure", "status", "flag", "valid", "gps", "gnss", "covariance", "humidity", "voltage", "battery"}
    | {"bias", "std", "sd", "var", "variance", "error", "err", "rms", "utm", "zone", "gravity", "user", "checksum"}
    | {
        "accuracy",
        "precision",
        "quality",
        "norm",
        "magnitude",
        "mag2",
        "abs",
        "total",
        "mean",
        "avg",
        "average",
        "date",
        "true",
        "truth",
        "expected",
        "ideal",
    }
)
#: One letter before the axis, in one word: gx, wy, az, fz.
_LETTER = {"g": "gyro", "w": "gyro", "a": "accel", "f": "accel", "m": "other", "b": "other", "h": "other", "v": "other"}

#: Ends of names that are units: of which dimension, and how the unit is written.
_SUFFIXES: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys(("dps", "deg_s", "degs", "deg_sec", "deg_per_s", "deg_per_sec", "degps"), ("rate", "deg/s")),
    **dict.fromkeys(("mdps",), ("rate", "mdps")),
    **dict.fromkeys(("rad_s", "rads", "rad_sec", "radps", "rad_per_s", "rad_per_sec"), ("rate", "rad/s")),
    **dict.fromkeys(("mrad_s",), ("rate", "mrad/s")),
    **dict.fromkeys(("deg_h", "degh", "dph", "deg_hr", "deg_per_h", "deg_per_hour", "deg_hour"), ("rate", "deg/h")),
    **dict.fromkeys(("rpm",), ("rate", "rpm")),
    **dict.fromkeys(("m_s2", "ms2", "mps2", "m_s_2", "mss", "m_s_s", "m_per_s2"), ("acceleration", "m/s^2")),
    **{unit: ("acceleration", unit) for unit in ("g", "mg", "ug")},
    **dict.fromkeys(("deg", "degs", "degree", "degrees"), ("angle", "deg")),
    **dict.fromkeys(("rad", "radian", "radians"), ("angle", "rad")),
    **{unit: ("angle", unit) for unit in ("arcsec", "arcmin", "mrad", "urad")},
    **dict.fromkeys(("m_s", "mps"), ("velocity", "m/s")),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), ("time", "s")),
    **dict.fromkeys(("ms", "msec", "millis", "milliseconds", "mstime"), ("time", "ms")),
    **dict.fromkeys(("us", "usec", "micros", "microseconds", "ustime", "timeus"), ("time", "us")),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanoseconds"), ("time", "ns")),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), ("time", "min")),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours"), ("time", "h")),
    **dict.fromkeys(("d", "day", "days"), ("time", "day")),
    **dict.fromkeys(("c", "degc", "deg_c", "celsius"), ("temperature", "degC")),
    **dict.fromkeys(("k", "kelvin"), ("temperature", "K")),
    **dict.fromkeys(("f", "degf", "deg_f", "fahrenheit"), ("temperature", "degF")),
}
#: Spellings in brackets that are no units to `insenv.core.units`, without blanks and in small letters.
_SPELLINGS: Mapping[str, str] = {
    **dict.fromkeys(("rads/s", "rads/sec", "radians/s", "radians/sec", "radian/s", "rad/sec"), "rad/s"),
    **dict.fromkeys(("degs/s", "degrees/s", "degrees/sec", "degree/s", "deg/sec", "°/sec", "degs/sec"), "deg/s"),
    **dict.fromkeys(("deg/hr", "degrees/h", "degrees/hr", "degrees/hour", "°/hr"), "deg/h"),
    **dict.fromkeys(("rpm", "rev/min", "r/min", "u/min", "1/min"), "rpm"),
    **dict.fromkeys(("m/s2", "m/s/s", "m/sec^2", "m/sec2", "mps2", "ms^-2", "ms-2", "m/s**2", "m/(s^2)"), "m/s^2"),
    **dict.fromkeys(("g", "gs", "g's"), "g"),
    **dict.fromkeys(("c", "°c", "℃", "degc", "celsius"), "degC"),
    **dict.fromkeys(("f", "°f", "℉", "degf", "fahrenheit"), "degF"),
    **dict.fromkeys(("k", "kelvin"), "K"),
    **dict.fromkeys(("sec", "secs", "seconds"), "s"),
    **dict.fromkeys(("msec", "millis"), "ms"),
    **dict.fromkeys(("usec", "micros", "μs", "µs"), "us"),
}
#: Names that are a unit of time and nothing else; one letter may be an axis or a force.
_TIME_UNITS = {name for name, (dimension, _) in _SUFFIXES.items() if dimension == "time" and len(name) > 1}
#: Words that are not taken apart.
_WHOLE_WORDS = {*_OTHER, *_TIME, *_SUFFIXES}
#: Pairs of words that are a rate of turn.
_TURN = {"angularvelocity", "angularrate", "bodyrate", "rotationrate", "turnrate", "angvel"} | {
    "vitesseangulaire",
    "velocidadangular",
}
#: The axis before a word, as MAVLink has it (xgyro, yacc), or in a register's name: GYRO_XOUT.
_BEFORE = re.compile(r"([xyz])(gyroscope|gyro|gyr|accelerometer|accel|acc|mag|out)")
#: Words of other scripts.
_SCRIPTS = {"角速度": "gyro", "陀螺": "gyro", "加速度": "accel", "时间": "time", "時間": "time", "温度": "temperature"}
#: Ends of words run together: SENSgyro, MATLABtime.
_RUN_TOGETHER = re.compile(r"[a-z]+(gyro|gyroscope|accel|accelerometer|acc|time)")
_PLAIN = re.compile(r"(gyroscope|gyro|gyr|omega|angvel|accelerometer|accel|acc|mag|dtheta|dvel|dv)([xyz])")
#: The same with the number of a unit, as files of several have it: acc1_x, GyroX2, acc68Y.
_NUMBERED = re.compile(r"(gyroscope|gyro|gyr|accelerometer|accel|acc)(?:\d+([xyz]?)|([xyz])\d+)")


@dataclass(frozen=True)
class Heading:
    """What a heading says.

    Attributes
    ----------
    kind : str
        "time", "row", "gyro", "accel", "table_rate", "table_angle", "table" (one of the two), "rate" (a gyro's or a
        table's), "temperature", "power", "segment", "other" (none of ours), or "" where it says nothing.
    axis : str
        "x", "y", "z" or "".
    unit : str or None
        As a manifest writes it.
    written : str or None
        What stands in the brackets, where it is no unit of the channel: "V", "LSB".
    increment : bool
        Whether the channel holds increments.
    """

    kind: str
    axis: str = ""
    unit: str | None = None
    written: str | None = None
    increment: bool = False


def read_heading(text: str, row_unit: str | None = None) -> Heading:
    """What a heading says; ``row_unit`` is what a row of units below it says."""
    name, bracket = split_unit(text)
    if name.strip().lower() == "temps" and is_unit(bracket or row_unit or "", "temperature"):
        name = "temperature"  # of several; else it is the French word
    if bracket is not None and bracket.isdigit():
        name, bracket = f"{name}_{'xyz'[int(bracket)]}" if int(bracket) < 3 else name, None
    if bracket is not None and bracket.strip().lower() in ("x", "y", "z"):  # "Rotation Rate (X)"
        name, bracket = f"{name} {bracket}", None
    if name.lower() == "x_value":  # LabVIEW's time
        return Heading("time")
    tokens, axis = _axis(_in_a_vehicle(_tokens(name)))
    kind = _kind(tokens, axis)
    if bracket is not None and kind in ("time", "temperature"):  # "T [K]"; "Temps (s)"
        kind = next((one for one in (kind, "temperature", "time") if unit_in(bracket, one)), kind)
    kind, increment = (kind[:-5], True) if kind.endswith("_step") else (kind, False)
    bracket = bracket or row_unit
    unit = unit_in(bracket, kind) if bracket else _suffix(tokens, kind, increment)
    if kind == "table" and unit is not None:
        kind = "table_rate" if is_unit(unit, "rate") else "table_angle"
    if kind in ("", "rate") and axis and bracket:  # "X (rad/s)", as phones write it
        kind, unit = _by_unit(kind, bracket)
    if unit is not None and not increment and kind in INCREMENT and is_unit(unit, INCREMENT[kind]):
        bracket, unit = unit, None  # people write rad for rad/s: whether it is an increment is asked
    return Heading(kind, axis, unit, bracket if unit is None else None, increment)


def _in_a_vehicle(tokens: list[str]) -> list[str]:
    """Words with axes for directions: "yaw rate" is a gyro's z, "lateral acc" an accelerometer's y."""
    for names, beside, word in ((_TURNS, {"rate", "rates"}, "gyro"), (_WAYS, _ACCEL, "acc")):
        found = [token for token in tokens if token in names]
        if len(found) == 1 and beside & set(tokens):
            return [word, names[found[0]], *(t for t in tokens if t not in names and t not in beside)]
    return tokens


def _by_unit(kind: str, text: str) -> tuple[str, str | None]:
    """The instrument that reads in a unit, and the unit; the ``kind`` that it was where there is none."""
    for one in ("gyro", "accel"):
        if is_unit(unit := unit_in(text, one) or "", DIMENSION[one]):
            return one, unit
    return kind, unit_in(text, kind)


def kind_of(name: str) -> str:
    """The channel that a name speaks of, as "gyro" of "Gyroscope.csv"; "" for none."""
    tokens, axis = _axis(_tokens(name))
    return _kind(tokens, axis)


def _tokens(name: str) -> list[str]:
    """Words of a name in small letters: parted at signs, blanks and capitals within a word."""
    for script, word in _SCRIPTS.items():
        name = name.replace(script, f" {word} ")
    name = name.replace("µ", "u").replace("μ", "u")
    name = "".join(letter for letter in unicodedata.normalize("NFD", name) if not unicodedata.combining(letter))
    name = re.sub(r"([a-z])([XYZ])(?=[A-Z][a-z])", r"\1_\2_", name)  # accelXData
    name = re.sub(r"\b([XYZ])(?=(?:[Gg]yro|[Aa]cc))", r"\1_", name)  # XGyro
    name = re.sub(r"([a-z0-9])([A-Z])(?=[a-z]|\b|_|$)", r"\1_\2", name)
    words = [word.lower() for word in re.split(r"[^A-Za-z0-9]+", name.removeprefix("field.")) if word]
    words = [bare if (bare := word.rstrip("0123456789")) == "covariance" else word for word in words]
    found: list[str] = []
    for word in words:
        if match := _PLAIN.fullmatch(word):
            found += [match[1], match[2]]
        elif match := _BEFORE.fullmatch(word):
            found += [match[1]] if match[2] == "out" else [match[2], match[1]]
        elif match := _NUMBERED.fullmatch(word):
            found += [part for part in match.groups() if part]
        else:
            found.append(end[1] if (end := _RUN_TOGETHER.fullmatch(word)) and word not in _WHOLE_WORDS else word)
    return found


def _axis(tokens: list[str]) -> tuple[list[str], str]:
    """The words without that of the axis, and the axis; a unit may stand behind it."""
    for i, token in reversed(list(enumerate(tokens))):
        if token in ("x", "y", "z"):
            before = [f"{word}?" if word in _LETTER and k == i - 1 else word for k, word in enumerate(tokens[:i])]
            return before + tokens[i + 1 :], token
        if len(token) == 2 and token[1] in "xyz" and token[0] in _LETTER:
            return [*tokens[:i], f"{token[0]}?", *tokens[i + 1 :]], token[1]
        if len(token) == 3 and token[:2] == "dv" and token[2] in "xyz":
            return [*tokens[:i], "dv", *tokens[i + 1 :]], token[2]
    return tokens, ""


def _kind(tokens: Iterable[str], axis: str) -> str:  # noqa: C901, PLR0911, PLR0912 -- one word after another
    """The channel that words speak of; "_step" is added for an increment."""
    words = set(tokens)
    pairs = {f"{a}{b}" for a, b in zip(list(tokens), list(tokens)[1:], strict=False)}
    if words & _TEMPERATURE:
        return "temperature"
    if words & _OTHER or (words & _TIME and words & (_GYRO | _ACCEL)):
        return "other"
    if words & _TABLE:
        if words & _RATE or pairs & {"angularvelocity", "angularrate"}:
            return "table_rate"
        return "table_angle" if words & _ANGLE else "table"
    if words & _DONE and words & _RATE and not words & (_GYRO | _ACCEL):
        return "table_rate"
    if words & _GYRO_STEP or pairs & {"deltaangle", "deltatheta"}:
        return "gyro_step"
    if words & _ACCEL_STEP or pairs & {"deltavelocity", "deltav"}:
        return "accel_step"
    if words & _GYRO or pairs & _TURN:
        return "gyro"
    if words & _ACCEL or pairs & {"specificforce", "highg?", "lowg?"}:
        return "accel"
    letters = {_LETTER[word[0]] for word in words if word.endswith("?")}
    if letters:
        return letters.pop()
    if words & _TIME or (words and words <= _TIME_UNITS):
        return "time"
    if words & _SEGMENT:
        return "segment"
    if words & {"power", "powerup", "boot"} and not words & {"w", "watt", "watts", "mw"}:
        return "power"
    if words & _ROW:
        return "row"
    if words & {"rate", "rates", "rpm", "dps"}:
        return "gyro" if axis else "rate"
    return "table_angle" if words & {"angle", "azimuth"} and not axis else ""


def _suffix(tokens: list[str], kind: str, increment: bool) -> str | None:
    """The unit that the last words of a name are, for a channel that may have it.

    "gyro_x_rad" may be rad/s written short: an angle counts where the name speaks of increments.
    """
    dimensions = (DIMENSION.get(kind), INCREMENT.get(kind) if increment else None)
    if kind in ("rate", "table"):
        dimensions = ("rate", "angle" if kind == "table" else None)
    for count in range(min(4, len(tokens)), 0, -1):
        found = _SUFFIXES.get("_".join(tokens[-count:]))
        # "s" of "samples_s" is a unit; the word that names the channel is none, but for those that are both.
        if found and found[0] in dimensions and (count < len(tokens) or kind == "time" or tokens[-1] in {"rpm", "dps"}):
            return found[1]
    return None


def unit_in(text: str, kind: str) -> str | None:
    """What stands in brackets, as a unit of the channel or of its increment; None where it is none."""
    bare = text.strip().strip("'\"")
    for dimension in _dimensions(kind):
        if kind == "accel" and bare in ("G", "g's", "gs"):
            return "g"
        spelled = _SPELLINGS.get(re.sub(r"\s+", "", bare).lower(), bare)
        for unit in (bare, spelled):
            if unit not in ("c", "C") and is_unit(unit, dimension):
                return unit
    return None


def _dimensions(kind: str) -> list[str]:
    if kind in ("table", "rate"):
        return ["rate", "angle"] if kind == "table" else ["rate"]
    return [d for d in (DIMENSION.get(kind), INCREMENT.get(kind)) if d]


@cache
def is_unit(text: str, dimension: str) -> bool:
    """Whether a text is a unit of a dimension of `insenv.core.units`."""
    try:
        scale_to_si(text, dimension, "unit")
    except InputError:
        return False
    return True
