"""How the points of a cloud lie in memory."""

from typing import NamedTuple

_XYZ = 12


class CloudFields(NamedTuple):
    """Places of a point's fields in bytes: x, y and z, float32, come first; -1 for what there is none of.  ``size`` of a point."""

    rgb: int
    label: int
    instance: int
    size: int


def cloud_fields(*, color: bool, label: bool, instance: bool) -> CloudFields:
    """Return the places: rgb is float32 wide, label and instance uint16; a point takes whole words of four bytes."""
    after_rgb = _XYZ + 4 * color
    after_label = after_rgb + 2 * label
    end = after_label + 2 * instance
    return CloudFields(_XYZ if color else -1, after_rgb if label else -1, after_label if instance else -1, end + -end % 4)
