"""The two-position calibration in the browser: an angle to turn the vehicle by, and its sight on the dial.

The heading at the start is at the top. The sight points to heading + installation angle, clockwise: so it lies the
installation angle further clockwise than the vehicle's nose.
"""

from __future__ import annotations

from insenv.core.recording import Recording
from insenv.envs.group import Group
from insenv.play.scene import Control, DialPointer, Scene, Signal
from insenv.systems.two_position.env import HALF_TURN
from insenv.systems.two_position.pose import Pose

#: Six wheels, a hull with its windscreen, and the turret of the sight; the nose is at the top.
_WHEELS = "".join(
    f'<rect x="{x}" y="{y}" width="9" height="18" rx="2" class="wheel"/>' for x in (-28, 19) for y in (-38, -10, 18)
)
_VEHICLE = (
    f'<circle r="72" class="plate"/>{_WHEELS}<rect x="-19" y="-44" width="38" height="88" rx="7" class="hull"/>'
    '<path d="M-11 -42H11L15 -32H-15Z" class="glass"/><circle r="11" class="instrument"/>'
    '<path d="M-6 -58L0 -70L6 -58Z" class="tip"/>'
)


def turned(group: Group, chunk: Recording) -> float:
    """Angle that the vehicle has turned by [rad]."""
    del chunk
    assert isinstance(group.memory, Pose)
    return float(group.memory.turned[0])


SCENE = Scene(
    controls=(Control(0, "turn by", "rad", scale=HALF_TURN, held=False, verb="turn"),),
    signals=(Signal(1, 1.0, "end the run here", "e", ends=True),),
    pointers=(DialPointer("installation_angle", "sight", sense=-1, carried=True),),
    body=_VEHICLE,
    zero="heading at the start",
    turned=turned,
)
