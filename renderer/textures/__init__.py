"""Surfaces with a pattern: texture coordinates, generators, tiles with their smaller versions, and the look-up at a hit."""
