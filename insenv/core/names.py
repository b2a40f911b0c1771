"""Names that the command knows before it imports anything: the standard output's, and variables of the environment."""

from __future__ import annotations

import os

#: Names of the standard output; what is written there is text, and the summary goes to standard error.
STANDARD_OUTPUT = ("-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")
#: Environment variable that allows code named in files to a command and the processes that it starts: "1".
CODE_ALLOWED = "INSENV_ALLOW_CODE"
#: Kinds that `insenv list` lists.
KINDS = ("effects", "scenarios", "instruments", "estimators", "policies", "environments", "recordings")


def is_standard_output(path: str | os.PathLike[str] | None) -> bool:
    """Whether ``path`` is a name of the standard output."""
    return path is not None and os.fspath(path) in STANDARD_OUTPUT
