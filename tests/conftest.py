"""What all tests need: a session whose modules and tests the garbage collector does not search again and again.

Some 300,000 objects are made before the first test and stand until the last: a tenth of the CPU time of the tests went
into looking for garbage among them. What tests make themselves is looked through every 20,000 objects, not every 700.
"""

from __future__ import annotations

import gc


def pytest_sessionstart() -> None:
    """Nothing that is collected is garbage."""
    gc.disable()


def pytest_collection_finish() -> None:
    """What stands from here on is left alone."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
    gc.enable()
