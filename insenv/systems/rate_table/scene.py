"""The rate table in the browser: its rate, and the switch of the gyro."""

from insenv.play.scene import TABLE, Control, Scene, Signal

SCENE = Scene(
    controls=(Control(0, "table rate", "rad/s"),),
    signals=(
        Signal(1, -1.0, "switch the gyro off and on", "o"),
        Signal(1, 1.0, "end the run here", "e", ends=True),
    ),
    body=TABLE,
    zero="zero mark",
)
