"""Exposures for tests: every field filled, smooth, and the same motion at any sampling."""

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats


def edges(n: int, dt: float) -> Floats:
    """Edges of ``n`` intervals of length ``dt``, shape (n + 1,)."""
    t: Floats = np.arange(n + 1) * np.float64(dt)
    return t


def rich_motion(n: int = 600, dt: float = 0.1, batch: tuple[int, ...] = ()) -> Motion:
    """A table that swings through a few turns while all else varies; shape (*batch, n) where it may.

    The functions of time do not depend on ``n`` and ``dt``: a finer sampling shows the same motion.
    """
    t = edges(n, dt)
    row = np.arange(int(np.prod(batch))).reshape(*batch, 1) if batch else np.zeros(())
    phase = 0.7 * row
    projection = 0.5
    angle = 4.0 * np.sin(0.21 * t + phase) + 0.05 * t
    table_rate = 0.84 * np.cos(0.21 * t + phase) + 0.05
    vertical = 5e-5
    temperature = 298.15 + 6 * np.sin(0.05 * t + 2 * phase) + 8 * (1 - np.exp(-t / 20))

    def mean_wave(amplitude: float, frequency: float, shift: float) -> Floats:
        """Exact interval means of a sine."""
        at_edges = -amplitude / frequency * np.cos(frequency * t + shift + phase)
        mean: Floats = np.diff(at_edges, axis=-1) / dt
        return mean

    return Motion(
        t=t,
        rate=projection * np.diff(angle, axis=-1) / dt + vertical,
        angle=angle,
        rate_edges=projection * table_rate + vertical,
        turn_rate=table_rate,
        temperature=temperature,
        base_tilt=mean_wave(1e-3, 0.4, 0.3),
        across=mean_wave(3.0, 0.35, 0.7),
        force={
            "x": mean_wave(2.0, 0.3, 0.1),
            "y": mean_wave(1.0, 0.5, 1.1),
            "z": 9.8 + mean_wave(0.5, 0.2, 2.0),
        },
        vibration={axis: 0.5 + mean_wave(0.3, 0.1 * k + 0.2, 0.3 * k) for k, axis in enumerate("xyz")},
        cross_rate={axis: mean_wave(0.2, 0.1 * k + 0.15, 0.4 * k) for k, axis in enumerate("xyz")},
        body_rate={axis: 0.4 * np.sin((0.12 * k + 0.2) * t + 0.5 * k + phase) + 0.01 for k, axis in enumerate("xyz")},
        axis="y",
        projection=projection,
    )
