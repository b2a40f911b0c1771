"""The command: ``insenv`` and ``python -m insenv``."""

import sys

from insenv.core.version import VERSION


def main() -> None:
    """Entry point of the command; the version, which scripts ask for often, waits for no import."""
    if sys.argv[1:] in (["--version"], ["-V"]):
        print(f"insenv, version {VERSION}")
        return
    from insenv.cli import main as command

    command()


if __name__ == "__main__":
    main()
