"""``python -m insenv``: the command."""

from insenv.cli import main

if __name__ == "__main__":
    main()
