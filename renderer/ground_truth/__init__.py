"""Layers that follow from the hit record of a view: one function each, computed when they are asked for."""
