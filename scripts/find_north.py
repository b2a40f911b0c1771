"""Find north with a laser gyro on a turntable: half of the time one way, half the other.

python scripts/find_north.py [picture.png]
"""

import sys

import gymnasium
import numpy as np

import insenv  # noqa: F401 -- registers the environments

picture = sys.argv[1] if len(sys.argv) > 1 else None
env = gymnasium.make(
    "insenv/NorthFinder-v0",
    scenario="north_finder/realistic",
    estimator="north_gls",
    render_mode="rgb_array" if picture else None,
)
observation, info = env.reset(seed=7)
half = observation["time_left"][0] / 2

over = False
while not over:
    rate = np.radians(20.0) if observation["time_left"][0] > half else np.radians(-20.0)
    observation, reward, terminated, truncated, info = env.step(np.array([rate, 0.0]))
    over = terminated or truncated

if picture:
    import matplotlib.image

    matplotlib.image.imsave(picture, np.asarray(env.render()))
azimuth, sd = np.degrees(observation["belief"])
true = np.degrees(info["truth"]["azimuth"])
print(f"azimuth {azimuth:.4f} deg, sd {3600 * sd:.0f} arcsec; true {true:.4f} deg")
