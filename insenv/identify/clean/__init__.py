"""Before any search: what of the declarations and of the samples cannot be taken as it stands.

Of the samples: motion of what is declared at rest (`motion`), rails at which a sensor clips (`rails`), bursts and
settling (`bursts`, `settling`), outputs that are held (`holds`), rows off the motion (`outliers`, `lost`), on its ramps
(`ramps`) or at its corners (`corners`), and what is lost systematically by all that (`systematic`). Each is named, with
its rows, and kept from what is fitted.
"""
