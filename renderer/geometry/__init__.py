"""Triangle meshes: basic shapes and texture coordinates."""
