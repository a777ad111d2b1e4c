"""What ends a command."""


class CommandError(RuntimeError):
    """What was asked cannot be done; the message goes to stderr, the exit code is 1."""
