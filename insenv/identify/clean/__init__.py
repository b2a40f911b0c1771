"""Before any search: what of the declarations and of the samples cannot be taken as it stands.

Of the samples: motion of what is declared at rest (`motion`), rails at which a sensor clips (`rails`), bursts and
settling (`bursts`, `settling`), lines whose phase does not hold (`wandering`), the step to which values were rounded
(`rounding`), and what is lost systematically by all that (`systematic`). Each is named, with its rows or its frequency,
and kept from what is fitted.
"""
