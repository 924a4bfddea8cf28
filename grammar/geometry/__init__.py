"""Boxes, walls, zones and free floor."""
