"""Numbers of things in the lines that commands print."""


def counted(number: int, what: str) -> str:
    """Return a number and what it counts: ``1 room``, ``2 rooms``."""
    return f"{number} {what}{'' if number == 1 else 's'}"
