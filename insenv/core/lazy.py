"""Values that are made when they are asked for, and what is pickled of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

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


@dataclass(frozen=True, eq=False)
class Here:
    """``ask(...)`` in the process in which it was made; what is pickled knows nothing, and answers with nothing."""

    ask: Callable[..., tuple[Any, ...]]

    def __call__(self, *args: Any) -> tuple[Any, ...]:
        """What it answers."""
        return self.ask(*args)

    def __reduce__(self) -> tuple[Callable[..., Here], tuple[Callable[..., tuple[Any, ...]]]]:
        return Here, (unanswered,)


def nothing() -> None:
    """What is made of what is not there: the default of a field that is made when it is asked for."""


def unanswered(*args: Any) -> tuple[Any, ...]:
    """The answer of what knows nothing: none."""
    return ()
