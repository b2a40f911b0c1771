"""Find the angle between a sight and an inertial unit: rest, turn by half a turn, rest until it is known well enough.

python scripts/calibrate_sight.py [picture.png]
"""

import sys

import gymnasium
import numpy as np

import insenv  # noqa: F401 -- registers the environments

picture = sys.argv[1] if len(sys.argv) > 1 else None
env = gymnasium.make(
    "insenv/TwoPosition-v0",
    scenario="two_position/published_a2",
    estimator="two_position_tied",
    render_mode="rgb_array" if picture else None,
)
observation, info = env.reset(seed=3)
whole, wanted = observation["time_left"][0], np.radians(0.6 / 60)

over = False
while not over:
    passed, sd = whole - observation["time_left"][0], observation["belief"][1]
    turn = 1.0 if passed == 120 else 0.0  # in half turns
    stop = 1.0 if sd < wanted else 0.0
    observation, reward, terminated, truncated, info = env.step(np.array([turn, stop]))
    over = terminated or truncated

if picture:
    import matplotlib.image

    matplotlib.image.imsave(picture, np.asarray(env.render()))
angle, sd = np.degrees(observation["belief"]) * 60
true = np.degrees(info["truth"]["installation_angle"]) * 60
print(f"installation angle {angle:.2f} arcmin after {passed:.0f} s, sd {sd:.2f} arcmin; true {true:.2f} arcmin")
