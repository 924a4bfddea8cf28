"""Rejection of a derivation."""


class RejectedError(Exception):
    """The derivation breaks the constraint that the text names; another one is drawn in its place."""
