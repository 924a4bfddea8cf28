"""A small network for surface normals, trained on generated rooms and tested on rooms of types that it never saw: docs/training.md."""
