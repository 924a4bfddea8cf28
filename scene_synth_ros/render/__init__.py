"""The renderer node."""
