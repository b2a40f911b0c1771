"""Find the scale factor of a fibre-optic gyro on a rate table: a few rates, each both ways.

python scripts/measure_scale_factor.py [picture.png]
"""

import sys

import gymnasium
import numpy as np

import insenv  # noqa: F401 -- registers the environments

picture = sys.argv[1] if len(sys.argv) > 1 else None
env = gymnasium.make(
    "insenv/RateTable-v0",
    scenario="rate_table/kvh13",
    estimator="rate_line",
    changes={"duration": "320 s"},
    render_mode="rgb_array" if picture else None,
)
observation, info = env.reset(seed=2)

for rate in (10, -10, 20, -20, 30, -30, 35, -35):  # [deg/s]
    for _ in range(40):  # steps of a second
        observation, reward, terminated, truncated, info = env.step(np.array([np.radians(rate), 0.0]))

if picture:
    import matplotlib.image

    matplotlib.image.imsave(picture, np.asarray(env.render()))
value, sd = 1e6 * observation["belief"]
true = 1e6 * info["truth"]["scale_factor"]
print(f"scale factor {value:+.0f} ppm from nominal, sd {sd:.0f} ppm; true {true:+.0f} ppm")
