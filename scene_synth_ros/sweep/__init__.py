"""Sweeps: rooms of which one attribute at a time, or several by a design, is changed and everything else stays; a bag for each variant."""
