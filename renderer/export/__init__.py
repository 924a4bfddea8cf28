"""Scenes as files for other programs: GLB and SDF."""
