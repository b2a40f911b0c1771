"""A value that is made when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Lazy(Generic[T]):
    """``make()`` when it is called, once; what is pickled is what it gives."""

    make: Callable[[], T]

    @cached_property
    def value(self) -> T:
        """What it gives."""
        return self.make()

    def __call__(self) -> T:
        """What it gives."""
        return self.value

    def __reduce__(self) -> tuple[Callable[[T], Lazy[T]], tuple[T]]:
        return _constant, (self.value,)


def _constant(value: T) -> Lazy[T]:
    return Lazy(lambda: value)
