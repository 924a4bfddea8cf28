"""A planar laser scanner: where it sits, when its beams leave, what comes back, what it reads."""
