"""A scene description as one mesh and small tables: the room's shell, objects, sun, sky, environment."""
