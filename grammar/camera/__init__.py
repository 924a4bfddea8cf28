"""The path of the camera through a room."""
