"""What the checks of estimators and policies have in common: faults as sentences, and what "the same" means."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

from insenv.core.attitude import wrapped
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats
from insenv.core.units import dimension_of, scale_to_si

#: Difference of two ways to the same estimate, in its deviations: rounding, with room for long sums.
CLOSE = 1e-4
#: Rounding of a covariance that was computed, as a share of the deviations.
_ROUNDING = 1e-8

Say = Callable[[str, float], None]


class FaultError(Exception):
    """A fault that makes what follows meaningless."""


class DeclinedError(Exception):
    """A plug-in says that it is not for such recordings."""


@dataclass(frozen=True)
class Calls:
    """Calls a plug-in, says so first, and turns what it raises into a sentence."""

    say: Say

    def __call__(self, method: str, call: Callable[..., Any], *given: Any) -> Any:
        """What it answers.

        Raises
        ------
        DeclinedError
            If it says in one sentence that it lacks something.
        FaultError
            If it fails.
        """
        self.say(f"{method}()", 0.0)
        try:
            with np.errstate(all="ignore"):
                return call(*given)
        except (InputError, KeyError) as error:
            raise DeclinedError(f"{method}() says: {_text(error)}") from None
        except NotImplementedError:
            raise FaultError(f"{method}() is not implemented; wanted it, see insenv.core.estimate") from None
        except Exception as error:  # whatever another author's code raises
            raise FaultError(
                f"{method}() ends with {type(error).__name__}: {_text(error)}; wanted an answer, or an InputError that "
                f"says what it lacks"
            ) from None

    def unchanged(self, method: str, call: Callable[..., Any], *given: Any) -> Any:
        """The same; what was given must be afterwards what it was before."""
        before = deepcopy(given)
        answer = self(method, call, *given)
        for what, old, new in zip(("state", "block", "estimate"), before, given, strict=False):
            if not same(old, new):
                raise FaultError(
                    f"{method}() changes the {what} that it is given; wanted a new one (copy an array before writing)"
                )
        return answer


def made(asked: Calls, plugin: Callable[..., Any], datasheet: Datasheet, methods: tuple[str, ...]) -> Any:
    """The plug-in, made of a datasheet alone."""
    one = asked("__init__", plugin, datasheet)
    for method in methods:
        if not callable(getattr(one, method, None)):
            raise FaultError(f"it has no method {method}(); wanted {', '.join(f'{m}()' for m in methods)}")
    return one


def sound(estimate: Any, batch: int | None, prior: bool) -> Estimate:
    """An estimate with the shapes of a batch, finite, and with a covariance that is one.

    Raises
    ------
    FaultError
        If it is none.
    """
    when = "before any data estimate()" if prior else "estimate()"
    if not isinstance(estimate, Estimate):
        raise FaultError(f"{when} returns a {type(estimate).__name__}; wanted an insenv.core.estimate.Estimate")
    k = len(estimate.names)
    if not k or len(set(estimate.names)) < k or len(estimate.units) != k:
        raise FaultError(
            f"{when} has the names {estimate.names} and units {estimate.units}; wanted each name once with its unit"
        )
    front = () if batch is None else (batch,)
    shapes = np.shape(estimate.mean), np.shape(estimate.cov)
    if shapes != ((*front, k), (*front, k, k)):
        of = "one run" if batch is None else f"a batch of {batch}"
        raise FaultError(
            f"{when} of {of} has a mean of shape {shapes[0]} and a covariance of shape {shapes[1]}; wanted "
            f"{(*front, k)} and {(*front, k, k)}"
        )
    if not np.isfinite(estimate.mean).all():
        j = int(np.argwhere(~np.isfinite(estimate.mean))[0][-1])
        raise FaultError(f"{when} has a mean of {estimate.names[j]!r} that is not finite; wanted a number")
    for name, unit in zip(estimate.names, estimate.units, strict=True):
        _coherent(when, name, unit)
    _covariance(when, estimate, prior)
    return estimate


@cache
def _coherent(when: str, name: str, unit: str) -> None:
    """An SI unit, with radians."""
    try:
        factor, _ = scale_to_si(unit, dimension_of(unit), name)
    except InputError:
        raise FaultError(f"{when} tells {name!r} in {unit!r}, which is no unit; wanted an SI unit or 'rad'") from None
    if abs(factor - 1.0) > _ROUNDING:
        raise FaultError(f"{when} tells {name!r} in {unit!r}, {factor:.6g} of the SI unit; wanted SI units and radians")


def _covariance(when: str, estimate: Estimate, prior: bool) -> None:
    """Symmetric and positive semidefinite; an infinite variance is that of a quantity of which nothing is known."""
    cov = np.asarray(estimate.cov, float).reshape(-1, len(estimate.names), len(estimate.names))
    for one in cov:
        variance = np.diag(one)
        bad = np.isnan(variance) | (variance < 0)
        if bad.any():
            j = int(np.flatnonzero(bad)[0])
            raise FaultError(
                f"{when} has a variance of {variance[j]:g} of {estimate.names[j]!r}; wanted zero or more (infinite: "
                f"nothing is known)"
            )
        known = np.isfinite(variance)
        part = one[np.ix_(known, known)]
        if not np.isfinite(part).all():
            raise FaultError(f"{when} has a covariance that is not finite; wanted numbers")
        size = np.sqrt(np.diag(part))
        part = part / np.outer(np.where(size > 0, size, 1.0), np.where(size > 0, size, 1.0))
        if np.abs(part - part.T).max(initial=0.0) > _ROUNDING:
            raise FaultError(f"{when} has a covariance that is not symmetric; wanted (P + P.T) / 2")
        if part.size and np.linalg.eigvalsh(part).min() < -_ROUNDING * len(part):
            raise FaultError(
                f"{when} has a covariance that is not positive semidefinite; wanted no correlation beyond 1 and no "
                f"difference of covariances that lost its digits"
            )


def alike(a: Estimate, b: Estimate, share: float = CLOSE) -> bool:
    """Whether two estimates are the same but for rounding: means in deviations, covariances in their products."""
    if a.names != b.names or np.shape(a.mean) != np.shape(b.mean):
        return False
    sd = np.sqrt(np.diagonal(b.cov, axis1=-2, axis2=-1))
    off = np.asarray(a.mean) - b.mean
    circle = np.array([unit == "rad" for unit in b.units])
    off = np.where(circle, wrapped(off), off)
    if not np.all(np.abs(off) <= share * np.where(np.isfinite(sd), sd, 0.0) + 1e-9 * np.abs(b.mean) + 1e-300):
        return False
    scale = sd[..., :, None] * sd[..., None, :]
    known = np.isfinite(scale)
    if not np.array_equal(np.isfinite(a.cov), np.isfinite(b.cov)):
        return False
    return bool(np.all(np.abs(np.where(known, a.cov - b.cov, 0.0)) <= share * np.where(known, scale, 0.0) + 1e-300))


def rows_of(estimate: Estimate, index: list[int]) -> Estimate:
    """Some rows of a batch."""
    return Estimate(estimate.names, estimate.units, estimate.mean[index], estimate.cov[index])


def row(estimate: Estimate, i: int) -> Estimate:
    """One run of a batch."""
    mean: Floats = estimate.mean[i]
    return Estimate(estimate.names, estimate.units, mean, estimate.cov[i])


def same(a: Any, b: Any) -> bool:
    """Whether two states hold the same, bit for bit."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if type(a) is not type(b):
        return False
    if isinstance(a, bool | int | float | str | None):
        return bool(a == b) or (a != a and b != b)
    x, y = _parts(a), _parts(b)
    return x.keys() == y.keys() and all(same(x[key], y[key]) for key in x)


def _parts(value: Any) -> Mapping[Any, Any]:
    """What a container or an object holds."""
    if isinstance(value, Mapping):
        return value
    if isinstance(value, tuple | list):
        return dict(enumerate(value))
    if is_dataclass(value):
        return {f.name: getattr(value, f.name) for f in fields(value)}
    return getattr(value, "__dict__", {})


def _text(error: Exception) -> str:
    return " ".join(str(error).split()) or "no message"
