"""Rooms as unit tests of somebody's SLAM: a pytest plugin."""
