"""Where the fields of a flat array lie, by name."""


class Layout:
    """Gives fields their places in a flat array, one after another; ``stride`` numbers belong to one field.

    Places are plain integers, so that kernels take them as constants: ``array[NAME + k]`` is number k of field ``NAME``.  (Flat with
    constant offsets, because LLVM then knows that fields never overlap.)
    """

    def __init__(self, stride: int = 1) -> None:
        """Begin an empty layout."""
        self.stride, self.size = stride, 0
        """``size``: how many numbers all fields so far take."""

    def field(self, count: int = 1) -> int:
        """Return the place of the next field, or of the first of ``count`` that follow one another."""
        place = self.size
        self.size += count * self.stride
        return place

    def vector(self) -> tuple[int, int, int]:
        """Return the places of three fields that follow one another, as x, y, z or r, g, b."""
        return self.field(), self.field(), self.field()
