"""Blind test bench: recordings of laboratories that never saw the library.

The physics here is written from the definitions of the field alone and shares no line with `insenv`: what the library
makes of these recordings is then no echo of its own formulas. `cases.draw` makes one case: a folder with data file and
manifest, and apart from it what is true.
"""
