"""What can go wrong while rendering."""

from scene_description import SceneSynthError


class RenderError(SceneSynthError):
    """A scene, camera or library that cannot be rendered with; the text is one line."""


class RenderCancelled(Exception):
    """A render that its caller asked to stop; nothing of the view is kept."""


class FlattenError(SceneSynthError):
    """A scene description that cannot become a mesh; one line with the object or the surface."""


class MeshFileError(SceneSynthError):
    """A mesh file that cannot be used; the text is one line with the file, what was expected and what was found."""
