r"""What a person sees of a system and sets of it.

    action[axis] = value / scale,      ring angle of a pointer = sense * mean (+ angle of what turns)

Everything is in SI units; angles are counter-clockwise seen from above, with zero at the top of the dial. A system
that brings no scene of its own gets `plain`: a control for each number of its action, a table where one is recorded,
and a pointer for each angle on the circle that is sought.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Recording
from insenv.envs.group import Group
from insenv.envs.task import Task

#: Bound of a control whose space has none.
UNBOUNDED = 10.0
#: A round table with the box of an instrument, from above; its zero mark is at the top.
TABLE = (
    '<circle r="72" class="plate"/><rect x="-14" y="-24" width="28" height="48" rx="2" class="instrument"/>'
    '<line y1="-24" y2="-66" class="axis"/><path d="M-5 -62L0 -71L5 -62Z" class="tip"/>'
)


@dataclass(frozen=True)
class Control:
    """A number of an action that a person sets.

    Attributes
    ----------
    axis : int
        Its place in the action.
    name : str
    unit : str
        SI unit.
    scale : float
        What an action of 1 is in that unit.
    held : bool
        Whether it holds until another is set (a rate); else it is given once (an angle to turn by).
    verb : str
        What the button says that gives it.
    follows : bool
        Whether it is an angle at which what turns is to stand: the dial's body follows the hand.
    """

    axis: int
    name: str
    unit: str = ""
    scale: float = 1.0
    held: bool = True
    verb: str = "give"
    follows: bool = False


@dataclass(frozen=True)
class Signal:
    """A value of a number of an action that is given once: stop, switch off and on.

    Attributes
    ----------
    axis : int
    value : float
        Of the action.
    name : str
        What it does.
    key : str
        Of the keyboard.
    ends : bool
        Whether it ends the run.
    """

    axis: int
    value: float
    name: str
    key: str
    ends: bool = False


@dataclass(frozen=True)
class DialPointer:
    """A quantity that is an angle, as a direction on the dial.

    Attributes
    ----------
    quantity : str
    name : str
        Of the direction: "north".
    sense : int
        1 where a larger value is further counter-clockwise, else -1.
    carried : bool
        Whether it turns with the body.
    """

    quantity: str
    name: str
    sense: int = 1
    carried: bool = False


#: Angle of the body after a step [rad], of the state and of what was recorded; None where nobody knows.
Turned = Callable[[Group, Recording], float | None]


def table_angle(group: Group, chunk: Recording) -> float | None:
    """Angle of a table as it was read last, where it is recorded."""
    del group
    if "table_angle" not in chunk.channels:
        return None
    return float(np.ravel(chunk.channels["table_angle"].values)[-1])


@dataclass(frozen=True)
class Scene:
    """A system, for a person.

    Attributes
    ----------
    controls : tuple of Control
        The first is that of the arrow keys and of the dial.
    signals : tuple of Signal
    pointers : tuple of DialPointer
    body : str
        What turns, as SVG in a circle of radius 72 about zero; it is shown once its angle is known.
    zero : str
        What stands at the top of the dial.
    turned : callable
    """

    controls: tuple[Control, ...]
    signals: tuple[Signal, ...] = ()
    pointers: tuple[DialPointer, ...] = ()
    body: str = ""
    zero: str = ""
    turned: Turned = table_angle


def plain(task: Task) -> Scene:
    """The scene of a system of which nothing but its task is known."""
    return Scene(
        controls=tuple(Control(k, f"action {k + 1}") for k in range(task.action_space.shape[0])),
        pointers=tuple(DialPointer(q.name, q.name) for q in task.quantities if q.circular),
        body=TABLE,
    )


def scene_of(task: Task, named: Scene | Callable[[Task], Scene] | None) -> Scene:
    """The scene that a system names, one that it makes of the task, or the plain one."""
    if named is None:
        return plain(task)
    return named if isinstance(named, Scene) else named(task)


def bounds(task: Task, control: Control) -> tuple[float, float]:
    """Least and largest value of a control, finite [SI]."""
    low, high = (float(edge[control.axis]) for edge in (task.action_space.low, task.action_space.high))
    low, high = max(low, -UNBOUNDED), min(high, UNBOUNDED)
    return low * control.scale, high * control.scale
