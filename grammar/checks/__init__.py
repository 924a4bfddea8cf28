"""Whether a room is valid, exactly, and figures about it."""
