"""Splits of datasets by room, filters on frames, and views that are nearly equal; no ROS."""
