"""What may be done next of points at one rate, angle or temperature each: the same again, in another order or sense.

A law of the time and one of what was set part where the order is another. What a further list would show is that of the
rows as they were, read in another order; nothing is known of the way between them, and nothing is simulated.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from insenv.core.recording import Recording
from insenv.data.exposure import expose
from insenv.identify.fit.bins import gather
from insenv.identify.fit.problem import Problem
from insenv.identify.next.procedures import Procedure
from insenv.identify.next.simulated import FurtherRun


def in_other_orders(recorded: Problem, recording: Recording, with_earth: bool) -> tuple[tuple[Procedure, Problem], ...]:
    """The same points backwards, in an order that is drawn, and as they were, as problems without data.

    Of rates of one sign also those of the other.
    """
    n = len(recording)
    orders = (
        ("the same points once more, backwards", np.arange(n)[::-1], False),
        ("the same points once more, in an order that is drawn", np.random.default_rng(0).permutation(n), False),
        ("the same points once more, as they were", np.arange(n), True),
    )
    made = [(words, _in_order(recording, order), control) for words, order, control in orders]
    if _one_way(recording):
        made.insert(0, ("the same rates the other way about", _the_other_way(recording), False))
    return tuple(
        (Procedure(words, FurtherRun(()), control=control), _of(recorded, again, with_earth))
        for words, again, control in made
    )


def _one_way(recording: Recording) -> bool:
    """Whether a table was set to rates of one sign alone."""
    rate = recording.channels.get("table_rate")
    return rate is not None and (bool(np.all(rate.values >= 0)) or bool(np.all(rate.values <= 0)))


def _the_other_way(recording: Recording) -> Recording:
    rate = recording.channels["table_rate"]
    return replace(recording, channels={**recording.channels, "table_rate": replace(rate, values=-rate.values)})


def _in_order(recording: Recording, order: np.ndarray) -> Recording:
    """The recording with its rows in another order, at the times as they were."""
    channels = {name: replace(channel, values=channel.values[order]) for name, channel in recording.channels.items()}
    left_out = {name: rows[order] for name, rows in recording.left_out.items()}
    return replace(recording, channels=channels, left_out=left_out)


def _of(recorded: Problem, recording: Recording, with_earth: bool) -> Problem:
    reference = recorded.exposures[0].motion.reference_temperature
    exposure = expose(recording, recorded.target, 1, reference, with_earth)
    used = np.ones(len(recording), bool)
    gathered = gather((exposure,), (used,), (~used,), 1, 1)
    return Problem(recorded.target, recorded.unit, (exposure,), gathered, np.zeros(gathered.n))
