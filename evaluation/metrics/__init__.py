"""One task a file: what is measured of a frame, and the formulas of its metrics."""
