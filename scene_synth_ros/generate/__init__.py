"""The grammar node."""
