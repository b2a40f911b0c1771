r"""What a unit says of its own motion: outputs less what is declared of them, and what each parameter adds.

    u = y - sum_i e_i(u, motion(u); theta)

The motion that the effects need is taken of the outputs themselves, as a navigation does it: rates against the Earth
are the gyros' while the unit turns and zero at rest. Two passes solve the equation to the square of an error. No
reading of a table is used.

The regressor of a scale factor is the input itself, with the noise n of the sample in it, and n is in what is left of
that sample too: their product does not average out (errors in variables). Each sample at rest would add the same to an
estimate, however small the noise is: by the deviation sd of a scale factor as it is declared, sd n n / n^2 in units of
sd, a hundredth of it for 1 % and as much as it for a hundred samples. So a filter of samples takes the regressors of
one at rest of the mean of its neighbours, which have other noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Floats, Recording
from insenv.core.unit.motion import GYROS, UNIT
from insenv.effects.noise import AngleRandomWalk, BiasInstability, RateRandomWalk
from insenv.information.means import stated_noises
from insenv.information.unit.calibration import Parameter, declared_sensors, sought
from insenv.sensors.chain import Sensor

#: Passes of the equation for the true inputs.
_PASSES = 2
#: Size of the inputs at which it is found what an error of the outputs makes of them [rad/s], [m/s^2].
_PROBE = (1.0, 1.0, 1.0, 10.0, 10.0, 10.0)
#: A process that is slower than so many times the recording is a constant of it.
_SLOW = 10.0
#: One whose density at zero stays below this share of the white noise's is added to that.
_HIDDEN = 0.05
#: Rows beside the six outputs: whether the table turns, and the temperature at the end of the sample.
TURNING, WARMTH, ROWS = 6, 7, 8


@dataclass(frozen=True)
class Slow:
    """A slow noise of a channel as a process of first order.

    Attributes
    ----------
    channel : int
    time : float
        Of correlation [s]; infinite: it stands, or walks.
    sd : float
        At the start [SI].
    walk : float
        Growth of its variance by the second, in units of ``sd`` squared [1/s].
    """

    channel: int
    time: float
    sd: float
    walk: float = 0.0


def noises_of_first_order(sheet: Datasheet) -> tuple[Floats, tuple[Slow, ...]]:
    """White densities of the six channels, shape (6,) [SI^2 s], and processes of first order for the rest.

    Flicker is simulated as a sum of such processes (`BiasInstability.processes`). Those that the white noise hides are
    white here, and those that outlast the recording stand.

    Raises
    ------
    InputError
        If another noise is told of.
    """
    white, slow = np.zeros(len(UNIT)), []
    for c, target in enumerate(UNIT):
        noises = stated_noises(sheet, target)
        if not noises:
            raise InputError(f"the datasheet tells of no noise of {target}; wanted it, for it weighs the data")
        white[c] = sum(n.coefficient**2 for n in noises if isinstance(n.effect, AngleRandomWalk))
        for noise in noises:
            if isinstance(noise.effect, AngleRandomWalk):
                continue
            if isinstance(noise.effect, BiasInstability):
                found, hidden = _flicker(c, noise.coefficient, noise.effect, sheet, float(white[c]))
                slow += found
                white[c] += hidden
            elif isinstance(noise.effect, RateRandomWalk):
                # From zero: the scale is that of the walk over the whole time.
                scale = noise.coefficient * np.sqrt(sheet.duration)
                slow.append(Slow(c, np.inf, float(scale), 1 / sheet.duration))
            else:
                raise InputError(
                    f"the datasheet tells of {noise.effect.id} of {target}; wanted white noise, flicker and walks"
                )
    return white, tuple(slow)


def _flicker(
    channel: int, coefficient: float, effect: BiasInstability, sheet: Datasheet, white: float
) -> tuple[list[Slow], float]:
    """Those of its processes that show, and the density of the others."""
    variances, times = effect.processes(sheet.dt)
    variances = variances * coefficient**2
    still = times > _SLOW * sheet.duration
    hidden = ~still & (2 * variances * times < _HIDDEN * white)
    found = [
        Slow(channel, float(time), float(np.sqrt(variance)))
        for time, variance in zip(times[~still & ~hidden], variances[~still & ~hidden], strict=True)
    ]
    if still.any():
        found.append(Slow(channel, np.inf, float(np.sqrt(variances[still].sum()))))
    return found, float(np.sum(2 * (variances * times)[hidden]))


@dataclass(frozen=True)
class UnitInputs:
    """The declared model of a unit, without a table.

    Attributes
    ----------
    sheet : Datasheet
    """

    sheet: Datasheet

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those sought."""
        return sought(self.sheet)

    @cached_property
    def sensors(self) -> tuple[tuple[Sensor, Floats, NDArray[np.bool_]], ...]:
        """Of each channel: its declared effects, their means, and which of them are sought."""
        return declared_sensors(self.sheet)

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Parameters sought of each channel."""
        return tuple(int(free.sum()) for _, _, free in self.sensors)

    def solved(self, rows: Floats, first: int, theta: Floats, block: int = 1) -> tuple[Floats, list[Floats]]:
        """True inputs and regressors of all samples but the first and the last, whose neighbours are not there.

        Parameters
        ----------
        rows : ndarray, shape (R, ROWS, n + 2)
            Outputs, whether the table turns, temperature at the end of the sample.
        first : int
            Samples before the second of these.
        theta : ndarray, shape (R, q)
            Values of the parameters sought.
        block : int
            Samples of a block, a divisor of n: regressors of one at rest are of the mean of the others of its rest in
            the block.

        Returns
        -------
        inputs : ndarray, shape (R, 6, n)
        regressors : list of ndarray, shape (R, n, q_c)
            Of each channel's own parameters, per SI unit.
        """
        inputs, values = rows[:, : len(UNIT)], self._values(theta)
        for _ in range(_PASSES):
            felt = self._motions(inputs, rows, first)
            added = [
                sensor.measure(felt[c], values[c])[0] - inputs[:, c] for c, (sensor, _, _) in enumerate(self.sensors)
            ]
            inputs = rows[:, : len(UNIT)] - np.stack(added, axis=1)
        felt = self._motions(_of_neighbours(inputs, rows[:, TURNING] == 0.0, block), rows, first)
        columns = [
            np.broadcast_to(
                sensor.regressors(felt[c], values[c])[..., 1:-1, free],
                (len(rows), rows.shape[-1] - 2, int(free.sum())),
            )
            for c, (sensor, _, free) in enumerate(self.sensors)
        ]
        return inputs[..., 1:-1], columns

    def coupling(self, theta: Floats) -> Floats:
        """Derivative of the true inputs to the outputs, shape (R, 6, 6), of what is odd in one input.

        Regressors are derivatives of the outputs. A misalignment of 1 % turns what they make of the inputs by as much.
        """
        runs, k = len(theta), len(UNIT)
        signs = np.concatenate([np.diag(_PROBE), -np.diag(_PROBE)])
        inputs = np.tile(np.repeat(signs[..., None], 3, axis=-1), (runs, 1, 1))
        rows = np.ones((len(inputs), ROWS, 3))
        rows[:, WARMTH] = self.sheet.reference_temperature
        values = self._values(np.repeat(theta, 2 * k, axis=0))
        felt = self._motions(inputs, rows, 1)
        out = [s.measure(felt[c], values[c])[0][:, 1] for c, (s, _, _) in enumerate(self.sensors)]
        both = np.stack(out, axis=-1).reshape(runs, 2, k, k)
        odd = (both[:, 0] - both[:, 1]) / (2 * np.array(_PROBE)[:, None])
        found: Floats = np.linalg.inv(np.swapaxes(odd, -1, -2))
        return found

    def _values(self, theta: Floats) -> list[Floats]:
        """All parameters of each channel, the declared means where they are not sought, shape (R, all)."""
        found, at = [], 0
        for _, mean, free in self.sensors:
            own = np.tile(mean, (len(theta), 1))
            own[:, free] = theta[:, at : at + int(free.sum())]
            found.append(own)
            at += int(free.sum())
        return found

    def _motions(self, inputs: Floats, rows: Floats, first: int) -> list[Motion]:
        dt, n = self.sheet.dt, inputs.shape[-1]
        turning = (rows[:, TURNING] > 0)[:, None]
        spin = inputs[:, :3] * turning
        # A turn begins and ends at rest: its rate is zero there, which a mean of two samples would not be.
        between = 0.5 * (spin[..., 1:] + spin[..., :-1]) * (turning[..., 1:] & turning[..., :-1])
        edges = np.concatenate([spin[..., :1], between, spin[..., -1:]], axis=-1)
        warmth = np.concatenate([rows[:, WARMTH, :1], rows[:, WARMTH]], axis=-1)
        shared: dict[str, Any] = {
            "t": (first - 1 + np.arange(n + 1)) * dt,
            "force": {x: inputs[:, 3 + i] for i, x in enumerate("xyz")},
            "body_rate": {x: edges[:, i] for i, x in enumerate("xyz")},
            "temperature": warmth,
            "reference_temperature": self.sheet.reference_temperature,
            "step": dt,
        }
        still, found = np.zeros_like(inputs[:, 0]), []
        for c in range(len(UNIT)):
            i, base = c % 3, 3 * (c // 3)
            others = {x: inputs[:, base + j] for j, x in enumerate("xyz") if j != i}
            if c < len(GYROS):
                moves = Motion(rate=inputs[:, i], rate_edges=edges[:, i], cross_rate=others, axis="xyz"[i], **shared)
            else:
                moves = Motion(rate=still, cross_rate=others, axis="xyz"[i], **shared)
            found.append(moves)
        return found


def _of_neighbours(inputs: Floats, resting: NDArray[np.bool_], block: int) -> Floats:
    """Inputs, shape (R, 6, n + 2), those at rest as the mean of the others of the same rest in a block of samples."""
    if block < 2:
        return inputs
    runs, k, n = len(inputs), inputs.shape[1], inputs.shape[2] - 2
    own = np.swapaxes(inputs[..., 1:-1], 0, 1).reshape(k, runs * n).copy()
    still = resting[:, 1:-1].ravel()
    begins = np.arange(runs * n) % block == 0
    begins[1:] |= still[1:] != still[:-1]
    at = np.flatnonzero(begins)
    stretch = np.cumsum(begins) - 1
    counts = np.diff(np.append(at, runs * n))[stretch]
    used = still & (counts > 1)
    sums = np.add.reduceat(own, at, axis=-1)[:, stretch[used]]
    own[:, used] = (sums - own[:, used]) / (counts[used] - 1)
    found = inputs.copy()
    found[..., 1:-1] = np.swapaxes(own.reshape(k, runs, n), 0, 1)
    return found


def rows_of(chunk: Recording, reference_temperature: float) -> Floats:
    """Rows of a recording of R runs, shape (R, ROWS, n)."""
    batch = np.shape(chunk.values("gyro_x", "rad/s"))[:-1]
    rows = np.empty((batch[0] if batch else 1, ROWS, len(chunk)))
    for c, name in enumerate(UNIT):
        rows[:, c] = chunk.values(name, "rad/s" if name in GYROS else "m/s^2")
    rows[:, TURNING] = chunk.values("turning", "1")
    warm = "temperature" in chunk.channels
    rows[:, WARMTH] = chunk.values("temperature", "K") if warm else reference_temperature
    return rows
