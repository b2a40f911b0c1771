"""The one error that a user's input can end in."""


class InputError(ValueError):
    """Input that cannot be used.

    The text is one sentence: what was given, where, and what was wanted. The command prints it on standard
    error and ends with exit status 2.
    """
