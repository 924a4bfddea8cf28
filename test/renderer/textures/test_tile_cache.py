"""Tiles that are kept: as many bytes as allowed, the last used first."""

from typing import NamedTuple

import pytest

from renderer.textures.tile import TileCache


class Item(NamedTuple):
    name: str
    size_bytes: int


@pytest.fixture
def asked() -> list[str]:
    return []


def get(cache: TileCache[Item], asked: list[str], name: str, size: int = 10) -> Item:
    def draw() -> Item:
        asked.append(name)
        return Item(name, size)

    return cache.get(name, draw)


def test_what_was_used_last_stays_within_the_bytes(asked: list[str]) -> None:
    cache: TileCache[Item] = TileCache(30)
    for name in "abcabc":
        assert get(cache, asked, name).name == name
    assert asked == ["a", "b", "c"] and cache.size_bytes == 30
    get(cache, asked, "a")
    get(cache, asked, "d")  # b was used longest ago
    for name in "acd":
        get(cache, asked, name)
    assert asked == ["a", "b", "c", "d"]
    get(cache, asked, "b")
    assert asked == ["a", "b", "c", "d", "b"] and cache.size_bytes == 30


def test_an_item_larger_than_all_is_kept_alone_until_the_next(asked: list[str]) -> None:
    cache: TileCache[Item] = TileCache(30)
    get(cache, asked, "a")
    get(cache, asked, "huge", 1000)
    get(cache, asked, "huge", 1000)
    assert cache.size_bytes == 1000
    get(cache, asked, "b")
    assert asked == ["a", "huge", "b"] and cache.size_bytes == 10


def test_cleared_it_keeps_nothing(asked: list[str]) -> None:
    cache: TileCache[Item] = TileCache(30)
    get(cache, asked, "a")
    cache.clear()
    assert cache.size_bytes == 0
    get(cache, asked, "a")
    assert asked == ["a", "a"]
