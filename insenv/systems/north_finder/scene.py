"""The north finder in the browser: the rate of its table, and north on the dial.

The zero mark of the table is at the top. With the azimuth az of the zero mark, clockwise from north, north itself lies
az further counter-clockwise.
"""

from insenv.play.scene import TABLE, Control, DialPointer, Scene, Signal

SCENE = Scene(
    controls=(Control(0, "table rate", "rad/s"),),
    signals=(Signal(1, 1.0, "end the run here", "e", ends=True),),
    pointers=(DialPointer("azimuth", "north"),),
    body=TABLE,
    zero="zero mark",
)
