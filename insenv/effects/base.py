"""An instrument error, written once.

An effect adds to what the instrument measures:

    y = u + sum_i e_i(u, motion; theta_i)

with ``u`` the true input on each interval (rad/s, or m/s^2 on an accelerometer), ``motion`` the exposure and
``theta`` the effect's parameters. Every effect sees the same true input, so the order of a chain does not
matter and the sum that simulates is the sum that is fitted.

Five kinds, each of which leaves one thing to write:

============  =========================================  ================================================
kind          the author writes                          derived here
============  =========================================  ================================================
LinearEffect  ``basis(u, motion) -> (..., n, k)``        addition = basis @ theta, jacobian = basis
CurveEffect   ``curve(u, motion, theta) -> (..., n)``    jacobian by central differences in steps of
              and ``grid(motion) -> (g, s)``             ``Param.sd``; profiles for variable projection
MemoryEffect  as CurveEffect, with state in and out      as CurveEffect, on whole runs
DrivenEffect  ``apply`` from unit normals, with state    expected addition: none
NoiseEffect   ``drive``, ``psd``, ``allan``,             addition = drive; fitted in the spectral domain;
              ``spectrum``, ``integral``                 covariance of means over any intervals
============  =========================================  ================================================
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from insenv.core.compiled import of_one_type
from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats

#: Stands for the unit of what is measured in `Param.unit`: "rad/s" on a gyro, "m/s^2" on an accelerometer.
OUTPUT = "{y}"

Instrument = Literal["gyro", "accelerometer"]
#: Which part of y = o + u + (k, m) (u, v) it is, with v the input of the other axes of a triad: `Effect.part`.
Part = Literal["", "level", "gain", "others"]
#: Whose error it is: `Effect.belongs`.
Belongs = Literal["instrument", "reference", "place", "input"]


@dataclass(frozen=True)
class Param:
    """One parameter of an effect.

    Attributes
    ----------
    name : str
    unit : str
        SI unit; ``{y}`` stands for the unit of the measured quantity.
    sd : float
        Prior standard deviation: drawing unit, step of differences, prior of a fit.
    bound : float
        Largest credible magnitude; a fit beyond it is not this effect.
    per_rate : bool
        Whether ``bound`` is a share of the largest input rate instead of an absolute value.
    per_run : bool
        Whether ``bound`` is what it may come to in the longest run, instead of in a second.
    low : float
        Least credible value: ``-bound`` unless the parameter cannot be negative.
    least : float
        Least credible magnitude where the effect is there at all: a share of which less than half is something else.
    rows : float
        Sampling periods that are credible whatever ``bound`` says: what is read once a second may be seconds late.
    """

    name: str
    unit: str
    sd: float
    bound: float = np.inf
    per_rate: bool = False
    per_run: bool = False
    low: float = -np.inf
    least: float = 0.0
    rows: float = 0.0

    def unit_on(self, measured: str) -> str:
        """Unit where ``measured`` is that of what is measured."""
        return self.unit.replace(OUTPUT, measured)


@dataclass(frozen=True)
class Effect(ABC):
    """What every effect declares.

    Attributes
    ----------
    id : str
        The contract's name.
    title : str
        Its name in running text.
    meaning : str
        What it is physically, in one line.
    accelerometer_title : str
        Its name on an accelerometer, where that is another.
    shapes : tuple of Param
        Parameters that bend the curve: time constants, centres, frequencies.
    needs : tuple of str
        Fields of `Motion` that the effect depends on ("force.x" for one axis).
    sharpened_by : tuple of str
        Fields that make it more exact where they are there: within an interval.
    source : str
        Paper or standard that describes it.
    instruments : tuple of str
        Instruments that can have it.
    of_rate : bool
        Whether it follows the input rate: where that never changes nothing tells it from a bias.
    of_time : bool
        Whether it follows the time from the start of the run: on another run's clock it is another curve.
    bend : bool
        Whether it stands for the bend of a characteristic: beside one that was added no other is sought.
    local : bool
        Whether it is a fault near one rate, which the line through all rates leaves to the residual.
    sudden : bool
        Whether one single event looks like it: a jump of the noise, or something that settles.
    belongs : str
        Whose error it is: that of the "instrument"; that of the "reference", whose readings it tells how to correct;
        that of the "place" where the recording was made; or no error but a true "input".
    becomes : tuple of str
        Effects that it becomes in the limit of its shapes.
    generic : bool
        Whether it describes without naming a cause.
    of_run : bool
        Whether it is another one in every run: clocks are started anew.
    carries : tuple of str
        Noises that it brings along from the channels that it is made of: a rate that is integrated has a walk.
    unusual : bool
        Whether it is rarer by far than others that look like it: it is named first only where it is far likelier.
    told_by : str
        What would tell it from an effect whose twin it is.
    line : bool
        Whether it is a line at one frequency: it has a search of its own.
    exact : bool
        Whether its shape is no matter of degree, so that no curve departs from it a little.
    of_earth : bool
        Whether it is the Earth's own rate, which latitude and attitude tell.
    of_response : bool
        Whether the response of a reference, its gain and phase at each frequency, looks like it.
    of_base : bool
        Whether it is one physical cause on several targets of a unit.
    of_one : bool
        Whether it is asked where one target alone is judged: of several axes what they have together comes first.
    of_way : bool
        Whether it goes by how rate or temperature came to be what they are: points of which nothing is known between
        tell nothing of it.
    of_force : bool
        Whether an accelerometer has it too where gravity turns through it: a law of the input, whatever that is.
    hides : str
        Family of effects that hide each other where a recording tells too little; empty for none.
    part : str
        Part of the linear model of a triad that it is: the "level" o, the "gain" k on the input of the axis itself, or
        what of the "others" it sees; empty for none.
    on_axes : tuple of str
        Instruments of a unit, on a table of several axes that are read, on which it is sought.
    """

    id: ClassVar[str] = ""
    title: ClassVar[str] = ""
    meaning: ClassVar[str] = ""
    accelerometer_title: ClassVar[str] = ""
    shapes: ClassVar[tuple[Param, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    sharpened_by: ClassVar[tuple[str, ...]] = ()
    source: ClassVar[str] = ""
    instruments: ClassVar[tuple[Instrument, ...]] = ("gyro", "accelerometer")
    of_rate: ClassVar[bool] = False
    of_time: ClassVar[bool] = False
    bend: ClassVar[bool] = False
    of_force: ClassVar[bool] = False
    local: ClassVar[bool] = False
    sudden: ClassVar[bool] = False
    belongs: ClassVar[Belongs] = "instrument"
    becomes: ClassVar[tuple[str, ...]] = ()
    generic: ClassVar[bool] = False
    of_run: ClassVar[bool] = False
    carries: ClassVar[tuple[str, ...]] = ()
    unusual: ClassVar[bool] = False
    told_by: ClassVar[str] = ""
    line: ClassVar[bool] = False
    exact: ClassVar[bool] = False
    of_earth: ClassVar[bool] = False
    of_response: ClassVar[bool] = False
    of_base: ClassVar[bool] = False
    of_one: ClassVar[bool] = False
    of_way: ClassVar[bool] = False
    hides: ClassVar[str] = ""
    part: ClassVar[Part] = ""
    on_axes: ClassVar[tuple[Instrument, ...]] = ()

    @property
    @abstractmethod
    def linear(self) -> tuple[Param, ...]:
        """Parameters in which the effect is linear, or becomes so as they vanish.

        A class attribute, or a property where their number depends on the order.
        """

    @property
    def params(self) -> tuple[Param, ...]:
        """All parameters, in the order of ``theta``: the linear ones first."""
        return self.linear + self.shapes

    @property
    def key(self) -> str:
        """Identifier with its order where it has one: "encoder_harmonic:1"."""
        order = getattr(self, "order", None)
        return self.id if order is None else f"{self.id}:{order}"

    def missing(self, motion: Motion) -> tuple[str, ...]:
        """Fields of the exposure that the effect needs and ``motion`` lacks."""
        return tuple(need for need in self.needs if not motion.has(need))

    def blind(self, motion: Motion) -> str:
        """Why a recording with this exposure shows nothing of the effect's own; empty where it may."""
        del motion
        return ""

    def unseen(self, motion: Motion, shape: tuple[float, ...]) -> str:
        """Why a recording with this exposure does not show the effect at a ``shape``; empty where it does."""
        del motion, shape
        return ""

    def steady(self, motion: Motion) -> bool:
        """Whether what it adds at a rate that holds is a function of that rate, known on ``motion``."""
        fitted = isinstance(self, LinearEffect | CurveEffect) and not isinstance(self, MemoryEffect)
        return self.of_rate and not self.of_time and fitted and not self.missing(motion)

    def over(self, motion: Motion) -> Self:
        """The effect with its own range set to what ``motion`` covers, where it has one."""
        del motion
        return self

    def variants(self, motion: Motion) -> tuple[Self, ...]:
        """The effect in the forms that a search tries beside each other on what ``motion`` covers."""
        return (self.over(motion),)

    def others(self) -> tuple[Self, ...]:
        """Forms that it may have instead, with the same parameters: what they would change is in a fit's deviations."""
        return ()

    def twins(self, motion: Motion) -> tuple[Effect, ...]:
        """Effects that no search tries, whose curve on one recording with this exposure is the effect's own."""
        del motion
        return ()

    def near(self, theta: Floats) -> Self:
        """The effect exact at the parameters ``theta``, where it is linear only for small ones."""
        del theta
        return self

    def begin(self, motion: Motion, theta: Floats) -> Any:
        """State before the first interval; None where the effect has no memory."""
        del motion, theta

    @abstractmethod
    def apply(
        self, u: Floats, motion: Motion, theta: Floats, state: Any = None, z: Floats | None = None
    ) -> tuple[Floats, Any]:
        """What the effect adds to the true input ``u``, and its state afterwards.

        Parameters
        ----------
        u : ndarray, shape (..., n)
            True input, mean over each interval.
        motion : Motion
        theta : ndarray, shape (..., p)
        state : object
            As returned by `begin` or by the chunk before.
        z : ndarray, shape (..., draws, n), optional
            Unit normals, for a `DrivenEffect`.

        Returns
        -------
        addition : ndarray, shape (..., n)
        state : object
        """

    @abstractmethod
    def jacobian(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Derivative of the expected addition to each parameter, shape (..., n, p)."""


class LinearEffect(Effect):
    """An effect that is linear in all its parameters."""

    @abstractmethod
    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Regressors, shape (..., n, k): what one unit of each parameter adds."""

    def apply(
        self, u: Floats, motion: Motion, theta: Floats, state: Any = None, z: Floats | None = None
    ) -> tuple[Floats, Any]:
        """Sum of the regressors times the parameters."""
        return combine(self.basis(u, motion), theta), state

    def jacobian(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Derivative of the addition to the parameters, shape (..., n, k): the basis itself."""
        del theta
        return self.basis(u, motion)


class CurveEffect(Effect):
    """An effect with a non-linear shape: a time constant, a centre rate, a frequency, a threshold."""

    def contradiction(self, theta: Floats) -> str:
        """Why parameters, shape (p,), are no such effect though each by itself may be; empty if they are."""
        del theta
        return ""

    def consistent(self, theta: Floats) -> tuple[float, ...]:
        """The nearest shapes with which parameters that contradict each other would not; empty if there are none."""
        del theta
        return ()

    @abstractmethod
    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """The addition, shape (..., n), for parameters of shape (..., p)."""

    @abstractmethod
    def grid(self, motion: Motion) -> Floats:
        """Shapes that a scan tries on this exposure, shape (g, s); no row where none can be told."""

    def apply(
        self, u: Floats, motion: Motion, theta: Floats, state: Any = None, z: Floats | None = None
    ) -> tuple[Floats, Any]:
        """The curve."""
        return self.curve(u, motion, theta), state

    def jacobian(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Derivative of the addition to the parameters, shape (..., n, p), by central differences."""
        return central_differences(lambda th: self.apply(u, motion, th, self.begin(motion, th))[0], theta, self.params)

    def profile(self, u: Floats, motion: Motion, shape: Floats) -> Floats:
        """What one unit of each linear parameter adds, at given shapes, near zero; shape (..., n, k).

        Exact where the curve is linear in them, as for every effect but those with a threshold.
        """
        columns = []
        for j, param in enumerate(self.linear):
            theta = np.concatenate([np.zeros(len(self.linear)), np.asarray(shape, float)])
            theta[j] = step = 1e-3 * param.sd
            columns.append(self.apply(u, motion, theta, self.begin(motion, theta))[0] / step)
        return np.stack(columns, axis=-1)


class MemoryEffect(CurveEffect):
    """A curve that depends on the past: the author writes `begin` and `carry`."""

    @abstractmethod
    def begin(self, motion: Motion, theta: Floats) -> Any:
        """State before the first interval of a run."""

    @abstractmethod
    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Any]:
        """The addition, shape (..., n), and the state after the last interval."""

    def apply(
        self, u: Floats, motion: Motion, theta: Floats, state: Any = None, z: Floats | None = None
    ) -> tuple[Floats, Any]:
        """The curve, going on from ``state`` (from the start of a run where it is None)."""
        return self.carry(u, motion, theta, self.begin(motion, theta) if state is None else state)

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """The addition over a whole run."""
        return self.carry(u, motion, theta, self.begin(motion, theta))[0]


class DrivenEffect(Effect):
    """An effect that is driven by unit normals.

    Its first state may be random too: `start` makes it from ``draws_at_start`` unit normals; a run that is
    driven without it begins at zero.
    """

    #: Unit normals per sample.
    draws: ClassVar[int] = 1

    @property
    def every(self) -> int:
        """Samples for which one unit normal does: those between need not be others."""
        return int(getattr(self, "hold", 1))

    @property
    def draws_at_start(self) -> int:
        """Unit normals that `start` takes."""
        return 0

    def start(self, z: Floats) -> Any:
        """State before the first interval, for normals of shape (..., draws_at_start)."""
        del z

    def jacobian(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Zero, shape (..., n, p): nothing is expected of chance, unless the effect says otherwise."""
        del motion
        return np.zeros((*np.broadcast_shapes(u.shape, (*np.shape(theta)[:-1], 1)), len(self.params)))

    def normals(self, z: Floats | None) -> Floats:
        """The unit normals that `apply` was given.

        Raises
        ------
        ValueError
            If there are none.
        """
        if z is None:
            raise ValueError(f"{self.id}: needs unit normals z of shape (..., {self.draws}, n)")
        return z


class NoiseEffect(DrivenEffect):
    """A stationary random error, or a walk; one parameter, its IEEE coefficient.

    Spectral densities are two-sided in the convention of IEEE 952: white noise of coefficient N has the
    density N^2 and the Allan variance N^2 / tau.
    """

    @abstractmethod
    def drive(self, theta: Floats, dt: float, state: Any, z: Floats) -> tuple[Floats, Any]:
        """Noise on each interval, shape (..., n), and the state after it.

        ``z`` are unit normals, shape (..., draws, n); ``state`` is that of `start` or of the chunk before.
        """

    @abstractmethod
    def psd(self, theta: Floats, f: Floats) -> Floats:
        """Two-sided spectral density of the rate at frequency ``f`` [Hz], in {y}^2 / Hz."""

    @abstractmethod
    def allan(self, theta: Floats, tau: Floats) -> Floats:
        """Allan deviation at averaging time ``tau`` [s], in the unit of the output."""

    @abstractmethod
    def spectrum(self, lam: Floats, dt: float) -> Floats:
        """Variance of the orthonormal DCT-II coefficient of means over ``dt``, for unit coefficient.

        ``lam = 4 sin^2(pi k / 2 n)`` is the eigenvalue of the second difference for coefficient k.
        """

    def integral(self, edges: NDArray[np.int64], dt: float) -> Floats:
        """Covariance of the integral of the noise from the start of the run to each edge, shape (m, m).

        For unit coefficient. ``edges``, shape (m,), count intervals of ``dt``, each with a mean as `drive` gives it.
        Elementwise operations alone, so that it is the same to the last bit in every process.

        Raises
        ------
        InputError
            Where the effect does not tell it.
        """
        del edges, dt
        raise InputError(f"effect {self.key!r} has no law of its integral; wanted it simulated sample by sample")

    def covariance(self, edges: NDArray[np.int64], dt: float) -> Floats:
        """Covariance of the means between successive edges, shape (m - 1, m - 1), for unit coefficient.

        Of dwells with gaps, the gaps stand among the intervals.

        Raises
        ------
        InputError
            As `integral`.
        """
        length = np.diff(edges) * dt
        change: Floats = np.diff(np.diff(self.integral(edges, dt), axis=0), axis=1)
        return change / (length[:, None] * length)

    def apply(
        self, u: Floats, motion: Motion, theta: Floats, state: Any = None, z: Floats | None = None
    ) -> tuple[Floats, Any]:
        """Noise of the intervals of ``motion``."""
        return self.drive(theta, motion.dt, state, self.normals(z))


def combine(basis: Floats, theta: Floats) -> Floats:
    """Sum of regressors times parameters; (..., n, k) and (..., k) give (..., n).

    Columns are added one after the other, so that a row of a batch is the same run alone, bit for bit
    (a batched matrix product may round by shape).
    """
    theta = np.asarray(theta, float)
    if basis.ndim == 3 and basis.shape[0] > 1 and theta.shape == (basis.shape[0], basis.shape[2]):
        from insenv.core.rows import kernel

        out = np.empty(basis.shape[:-1])
        kernel.combined(basis, of_one_type(theta), out)
        return out
    total: Floats = basis[..., 0] * theta[..., 0, None]
    for j in range(1, basis.shape[-1]):
        total += basis[..., j] * theta[..., j, None]
    return total


def central_differences(value: Callable[[Floats], Floats], theta: Floats, params: Sequence[Param]) -> Floats:
    """Derivative of ``value(theta)``, shape (..., n, p), in steps of a thousandth of each ``Param.sd``.

    Of what cannot be zero, as a time constant, a step is no more than a thousandth of the value itself: a
    short one would change its sign.
    """
    theta = np.asarray(theta, float)
    columns = []
    for j, param in enumerate(params):
        step = np.zeros_like(theta)
        size = np.minimum(param.sd, np.abs(theta[..., j])) if param.low > 0 else param.sd
        step[..., j] = 1e-3 * size
        columns.append((value(theta + step) - value(theta - step)) / (2 * step[..., j, None]))
    return np.stack(columns, axis=-1)
