"""Checks that a bag is true, by code that shares none with what made it: numpy, scipy, trimesh, and the messages themselves."""
