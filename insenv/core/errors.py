"""The one error that a user's input can end in, and the hint that its sentence may end with."""

from collections.abc import Iterable
from difflib import get_close_matches


class InputError(ValueError):
    """Input that cannot be used.

    The text is one sentence: what was given, where, and what was wanted. The command prints it on standard
    error and ends with exit status 2.
    """


def nearest(wrong: str, known: Iterable[str]) -> str:
    """Hint that follows the name of something unknown: the nearest known name, or the first 20 of them."""
    known = list(known)
    if close := get_close_matches(wrong, known, n=1):
        return f"did you mean {close[0]!r}?"
    names = [name if name.isprintable() and name else repr(name) for name in known[:20]]
    return f"there are {', '.join(names) or 'none'}{', ...' if len(known) > 20 else ''}"
