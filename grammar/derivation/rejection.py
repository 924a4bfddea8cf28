"""Rejection of a derivation."""


class RejectedError(Exception):
    """The derivation breaks the constraint that the text names; another one is drawn in its place."""


class BelowSlopesError(RejectedError):
    """A derivation is rejected for a sloped ceiling: none that was drawn for it has room for its doors, windows and furniture."""
