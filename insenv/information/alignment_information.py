r"""What rests and turns on the spot tell of attitude and biases, as a Fisher information without a prior.

Increments of velocity are z_k = Z_k theta + H w_k + v_k with theta = (phi at the start, biases) and w the walk of the
attitude. A Kalman filter of w alone whitens them; run beside each other through it, the columns of Z give

    M = sum_k E_k' S_k^-1 E_k,     E_k the innovations of the columns, S_k their covariance.

So what one position cannot tell apart is named (`insenv.information.fisher.Bound`), and priors come after.
Source: S. M. Kay, Fundamentals of Statistical Signal Processing 1 (1993), section 3.9; Gelb (1974), section 4.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from insenv.core.earth import earth_rate_enu, gravity
from insenv.core.errors import InputError
from insenv.information.alignment import AlignedUnit, Stretch, parts, step_model
from insenv.information.fisher import Information

#: Names of the parameters: phi at the start [rad], biases of gyros [rad/s] and accelerometers [m/s^2].
NAMES = ("phi_east", "phi_north", "phi_up", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y")


def alignment_information(
    instrument: AlignedUnit, stretches: Sequence[Stretch], heading: float = 0.0, turning_data: bool = True
) -> Information:
    """Information of a procedure on `NAMES`; parameters as of `insenv.information.alignment.bound`.

    The prior deviations of the instrument are not in it: `prior` has them for `Information.given`.

    Raises
    ------
    InputError
        If a duration is negative.
    """
    if not all(stretch.duration >= 0 for stretch in stretches):
        raise InputError("a stretch of negative duration given; wanted zero or more")
    rate = earth_rate_enu(instrument.latitude)
    g = float(gravity(instrument.latitude, instrument.altitude))
    now = np.eye(8)  # phi now and the biases, by the parameters
    walk, columns, total = np.zeros((3, 3)), np.zeros((3, 8)), np.zeros((8, 8))
    for stretch in stretches:
        for dt, share in parts(stretch):
            F, H, Q, R, cross = step_model(instrument, heading - 0.5 * share, dt, rate, g)
            F8, H3, F3 = F[:8, :8], H[:, :3], F[:3, :3]
            spread = F3 @ walk @ F3.T + Q[:3, :3]
            onward = F3 @ columns
            if turning_data or not stretch.turn:
                S = H3 @ walk @ H3.T + R
                lean = F3 @ walk @ H3.T + cross[:3]
                innovation = H[:, :8] @ now - H3 @ columns
                total += innovation.T @ np.linalg.solve(S, innovation)
                onward = onward + lean @ np.linalg.solve(S, innovation)
                spread = spread - lean @ np.linalg.solve(S, lean.T)
            walk, columns, now = 0.5 * (spread + spread.T), onward, F8 @ now
            heading -= share
    return Information(NAMES, 0.5 * (total + total.T))


def prior(instrument: AlignedUnit) -> dict[str, float]:
    """Prior deviations of an instrument by `NAMES`."""
    return dict(zip(NAMES, np.sqrt(np.diag(instrument.prior)).tolist(), strict=True))
