"""The axes of a table that carries a unit: ``[mounting.gimbals]`` of a manifest, and in ``[axes]`` of a scenario.

``order`` has the letters of the axes from the outer to the inner. ``mounting`` of the unit, ``tilt`` and
``heading_error`` of the base, ``non_orthogonality`` of the axes and ``eccentricity`` of the encoders are standard
deviations about zero: what is left out is taken to be without error. ``mounted`` is the angle by which the unit was put
on the innermost axis turned about its z.
"""

from __future__ import annotations

import numpy as np

from insenv.core.errors import InputError
from insenv.core.unit.gimbals import Gimbals
from insenv.core.units import DEG, quantity
from insenv.data.manifest.schema import GimbalsTable

#: Largest error of a table [rad]: small turns about three axes still add to a thousandth of themselves.
MOST_ERROR = 1.0 * DEG


def gimbals(table: GimbalsTable, where: str) -> Gimbals:
    """The axes that ``table`` at the place ``where`` names.

    Raises
    ------
    InputError
        If the order is none of a table, or an entry no such angle.
    """
    order = table.order
    apart = all(a != b for a, b in zip(order[:-1], order[1:], strict=True))
    if len(order) not in (2, 3) or set(order) - set("xyz") or not apart:
        raise InputError(
            f"{where}.order = {order!r}; wanted two or three of the letters x, y and z, outer axis first, such as 'xz'"
        )
    k = len(order)
    noise = _not_negative(table, "encoder_noise", where)
    sd = (
        *3 * (_error(table, "mounting", where),),
        *2 * (_error(table, "tilt", where),),
        _error(table, "heading_error", where),
        *(k - 1) * (_error(table, "non_orthogonality", where),),
        *2 * k * (_error(table, "eccentricity", where),),
    )
    heading, mounted = (
        0.0 if text is None else quantity(text, "angle", f"{where}.{name}")
        for name, text in (("heading", table.heading), ("mounted", table.mounted))
    )
    return Gimbals(order, heading, sd, (2 * np.pi,) * k, noise, mounted=mounted)


def gimbals_table(axes: Gimbals) -> dict[str, object]:
    """The table that gives ``axes`` back, but for its limits; zeros are left out."""
    k = len(axes.axes)
    values = {
        "heading": axes.heading,
        "mounted": axes.mounted,
        "mounting": axes.sd[0],
        "tilt": axes.sd[3],
        "heading_error": axes.sd[5],
        "non_orthogonality": axes.sd[6],
        "eccentricity": axes.sd[5 + k],
        "encoder_noise": axes.noise,
    }
    return {"order": axes.axes, **{name: f"{float(value)!r} rad" for name, value in values.items() if value}}


def _not_negative(table: GimbalsTable, name: str, where: str) -> float:
    text = getattr(table, name)
    value = 0.0 if text is None else quantity(text, "angle", f"{where}.{name}")
    if not value >= 0:
        raise InputError(f"{where}.{name} = {text!r}; wanted zero or more")
    return value


def _error(table: GimbalsTable, name: str, where: str) -> float:
    sd = _not_negative(table, name, where)
    if sd > MOST_ERROR:
        raise InputError(f"{where}.{name} = {getattr(table, name)!r}; wanted a small angle, 1 deg at most")
    return sd
