"""Loops that Numba compiles, kept on disk where there is a place for it.

To compile a loop takes seconds, once for each machine. `patient` loops spare them who only looks: they run as the plain
Python that they are until they have taken `PATIENCE` numbers, and are compiled then. Both give the same bits, for no
sum is reordered and sine and cosine are those of the C library either way.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Numbers in arrays that a patient loop takes in plain Python, over all its calls: some tenths of a second.
PATIENCE = 50_000


class Loop:
    """A function that is compiled when it is called for the first time, or when its patience is at an end.

    Compiled loops may call it, as if it were a function of Numba's own.
    """

    #: Whether there is any patience in this process.
    waits = True

    def __init__(self, function: Callable[..., Any], options: dict[str, Any], patience: int = 0) -> None:
        self.function = function
        self.options = options
        self.patience = patience
        self._taken = 0

    def __call__(self, *args: Any) -> Any:
        """What the function gives."""
        if self._taken < self.patience and Loop.waits:
            self._taken += _numbers(args)
            if self._taken <= self.patience:
                with np.errstate(all="ignore"):  # compiled loops do not warn
                    return self.plain(*args)
        return self.machine(*args)

    @cached_property
    def plain(self) -> Callable[..., Any]:
        """The function in plain Python, with all the loops that it calls."""
        function = self.function
        if not isinstance(function, FunctionType):
            raise TypeError(f"{function!r} is no function of Python")
        within = {name: function.__globals__.get(name) for name in function.__code__.co_names}
        loops = {name: loop.plain for name, loop in within.items() if isinstance(loop, Loop)}
        return FunctionType(function.__code__, {**function.__globals__, **loops}, function.__name__)

    @cached_property
    def machine(self) -> Any:
        """The function compiled. Numba is imported here, for it costs more to import than most of what uses it."""
        import numba

        # Nobody calls a loop from C: the door for that would be compiled with it, a second copy of many.
        options = {"no_cfunc_wrapper": True, **self.options}
        try:
            return numba.njit(cache=True, **options)(self.function)
        except RuntimeError:  # nowhere to write the cache
            return numba.njit(**options)(self.function)

    @property
    def _numba_type_(self) -> Any:
        """What it is to the compiled loops that call it: Numba asks every value of a module for that."""
        return self.machine._numba_type_


def of_one_type(values: NDArray[Any], shape: tuple[int, ...] | None = None) -> NDArray[np.float64]:
    """Contiguous numbers that may be written, broadcast to a shape: for any others a loop is compiled once more."""
    return np.require(values if shape is None else np.broadcast_to(values, shape), np.float64, ["C", "W"])


def hurry() -> None:
    """From now on this process compiles every loop when it is first called: it has much to do, or is timed."""
    Loop.waits = False


def _numbers(args: tuple[Any, ...]) -> int:
    """How many stand in the arrays of arguments, and of tuples among them."""
    arrays = sum(arg.size for arg in args if isinstance(arg, np.ndarray))
    return arrays + sum(_numbers(arg) for arg in args if isinstance(arg, tuple))


def jit(function: Callable[..., Any], **options: Any) -> Any:
    """The function compiled when it is first called, with options of ``numba.njit``."""
    return Loop(function, options)


def patient(function: Callable[..., Any], **options: Any) -> Any:
    """The function compiled when it has worked enough for that.

    Only for a loop whose work goes with the size of its arrays, and whose bits no option changes.
    """
    return Loop(function, options, PATIENCE)
