"""All texture generators by name."""

from renderer.textures import cloths, masonry, ornaments, pictures, woods
from renderer.textures.pattern import Generator

GENERATORS: dict[str, Generator] = {
    **woods.GENERATORS,
    **masonry.GENERATORS,
    **cloths.GENERATORS,
    **ornaments.GENERATORS,
    **pictures.GENERATORS,
}
