"""Bags as folders that rosbag2 opens: writing, reading, checking, repairing."""
