"""What can be wrong with a bag."""


class BagError(RuntimeError):
    """The bag cannot be written or read; the message says why and what to do."""
