r"""What data do not tell, in words: combinations of parameters that stay as unsure as they were.

    M v = mu v,     mu < 1:     along v the data tell less than was known before

with the information M in units of the prior deviations. The vectors of all such mu span what is not told. Of the bases
of that space the one is named that has the fewest parameters in each vector: so many parameters as the space has
dimensions are taken as pivots, the most independent first, and each vector has one of them.
Source: the rank-revealing factorisation with pivots, Golub and Van Loan, Matrix Computations, section 5.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from insenv.core.recording import Floats
from insenv.core.unit.gimbals import Gimbals
from insenv.effects.catalogue import by_key

#: Eigenvalue below which the data tell less than was known, and share of the largest component that counts.
_UNTOLD, _COUNTS = 1.0, 0.15
#: Most parameters that a sentence names.
_NAMED = 6


@dataclass(frozen=True)
class Direction:
    """A combination of parameters that is not told.

    Attributes
    ----------
    names : tuple of str
        Of the parameters, the largest component first.
    components : tuple of float
        In units of the prior deviations; the largest is one.
    """

    names: tuple[str, ...]
    components: tuple[float, ...]


def weak_directions(matrix: Floats, names: Sequence[str]) -> tuple[Direction, ...]:
    """Directions in which information of shape (p, p), in units of the prior deviations, is less than the prior's."""
    values, vectors = np.linalg.eigh(matrix)
    space = vectors[:, values < _UNTOLD]
    if not space.shape[1]:
        return ()
    pivots = qr(space.T, mode="r", pivoting=True)[1][: space.shape[1]]
    basis = space @ np.linalg.inv(space[pivots])
    found = []
    for column in basis.T:
        size = np.abs(column)
        order = [int(i) for i in np.argsort(-size) if size[i] > _COUNTS * size.max()]
        found.append(Direction(tuple(names[i] for i in order), tuple(column[order] / column[order[0]])))
    return tuple(found)


def sentence(direction: Direction, gimbals: Gimbals) -> str:
    """In words: "second-order term of accelerometer z and tilt of the base about y cannot be told apart"."""
    words = [parameter_words(name, gimbals) for name in direction.names[:_NAMED]]
    if len(words) == 1:
        return f"{words[0]} is not told"
    more = len(direction.names) - len(words)
    last = f"{words[-1]} (and {more} more)" if more else words[-1]
    return f"{', '.join(words[:-1])} and {last} cannot be told apart"


def parameter_words(name: str, gimbals: Gimbals) -> str:
    """A parameter of the unit or an error of the table in words."""
    target, _, rest = name.partition(".")
    if target.startswith(("gyro_", "accel_")):
        channel = f"{'gyro' if target.startswith('gyro') else 'accelerometer'} {target[-1]}"
        effect, _, param = rest.partition(".")
        title = by_key(effect).title.removeprefix("accelerometer ").removesuffix(" of an accelerometer")
        along = f" ({param[-1]})" if param.startswith("c_") else ""
        return f"{title}{along} of {channel}"
    return _of_the_table(target, rest, gimbals)


def _of_the_table(what: str, which: str, gimbals: Gimbals) -> str:
    if what == "mounting":
        return f"mounting of the unit about {which}"
    if what == "base":
        return {"heading": "heading of the base"}.get(which, f"tilt of the base about {which[-1]}")
    if what.startswith("axes_"):
        return f"angle between the table's axes {what[-2]} and {what[-1]}"
    places = ("outer", "inner") if len(gimbals.axes) == 2 else ("outer", "middle", "inner")
    return f"eccentricity ({'cosine' if which == 'c' else 'sine'}) of the table's {places[int(what[-1]) - 1]} axis"
