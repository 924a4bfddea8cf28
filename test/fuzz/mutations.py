"""Ways to spoil a valid sample, by table: of bytes, of text, and of the tree that a JSON or YAML text stands for.

All take their choices from the generator that they get, so that a case is made again from its seed.
"""

from __future__ import annotations

import copy
import json
import random
import re
from collections.abc import Callable
from typing import Any

MAX_BYTES = 2_000_000
NUMBERS = (0, 1, -1, 2, 127, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**53 + 1, 2**63 - 1, 2**63, 2**64 - 1, -(2**31), -(2**63))
TOKENS = (
    "0", "1", "-1", "2147483648", "9223372036854775808", "18446744073709551616", "1e308", "-1e308", "1e999", "5e-324", "0.1", "-0.0", "nan",
    "inf", "-inf", ".nan", ".inf", "0x7fffffff", "1_0", "1:30", "true", "null", "~", "''", '""', "[]", "{}", "[[]]", "{a: {}}",
    "*a", "&a", "<<", "!!python/none", "!whole", "2024-01-01", "../../../../etc/passwd", "/dev/zero", "\x00", "\ufeff", "\u2028", "ß", "%",
    "9" * 400, "9" * 5000, "²", "x" * 5000,
)  # fmt: skip
JUNK: tuple[Any, ...] = (
    *NUMBERS, 1e308, -1e308, 5e-324, 0.5, float("nan"), float("inf"), 10**400, True, False, None, "", "0", "x" * 300, "\ud800", "\x00\n",
    "*", "../../../etc/passwd", "/dev/zero", "nan", [], {}, [[]], [0] * 20, [None], {"a": {}}, {"": 0}, [[0, 0], [1, 1], [2, 2]],
)  # fmt: skip
DEPTHS = (2, 20, 90, 400, 3000, 100_000)
TIMES = (2, 3, 20, 300, 3000)
_PLACE = "nest~here"


def _span(data: bytes, rng: random.Random, longest: int = 64) -> tuple[int, int]:
    first = rng.randrange(len(data) + 1)
    return first, min(first + rng.randint(1, longest), len(data))


def _times(piece: int, rng: random.Random) -> int:
    """Return how often to repeat a piece of so many bytes, within the bound of all."""
    return min(rng.choice(TIMES), MAX_BYTES // max(piece, 1) + 1)


def truncate(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def flip(data: bytes, rng: random.Random) -> bytes:
    spoiled = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8))):
        if spoiled:
            spoiled[rng.randrange(len(spoiled))] ^= 1 << rng.randrange(8)
    return bytes(spoiled)


def set_field(data: bytes, rng: random.Random) -> bytes:
    """Write a telling number over 1, 2, 4 or 8 bytes, most often at a multiple of that from the start."""
    width = rng.choice((1, 2, 4, 4, 8, 8))
    if len(data) < width:
        return data
    first = rng.randrange(len(data) - width + 1)
    first -= first % width if rng.random() < 0.7 else 0
    number = rng.choice(NUMBERS) % 2 ** (8 * width)
    return data[:first] + number.to_bytes(width, rng.choice(("little", "big"))) + data[first + width :]


def delete(data: bytes, rng: random.Random) -> bytes:
    first, last = _span(data, rng)
    return data[:first] + data[last:]


def repeat(data: bytes, rng: random.Random) -> bytes:
    first, last = _span(data, rng, rng.choice((4, 64, 4096)))
    return data[:first] + data[first:last] * _times(last - first, rng) + data[last:]


def insert(data: bytes, rng: random.Random) -> bytes:
    first = rng.randrange(len(data) + 1)
    return data[:first] + rng.randbytes(rng.randint(1, 16)) + data[first:]


def zero(data: bytes, rng: random.Random) -> bytes:
    first, last = _span(data, rng)
    return data[:first] + bytes(last - first) + data[last:]


def swap(data: bytes, rng: random.Random) -> bytes:
    (a, b), (c, d) = sorted((_span(data, rng), _span(data, rng)))
    return data if b > c else data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def set_token(data: bytes, rng: random.Random) -> bytes:
    """Put another word or number in the place of one."""
    words = list(re.finditer(rb"[A-Za-z0-9_.+-]+", data))
    if not words:
        return data
    word = rng.choice(words)
    return data[: word.start()] + rng.choice(TOKENS).encode() + data[word.end() :]


def set_number(data: bytes, rng: random.Random) -> bytes:
    numbers = list(re.finditer(rb"[-+]?\d+(\.\d*)?", data))
    if not numbers:
        return data
    number = rng.choice(numbers)
    return data[: number.start()] + str(rng.choice(NUMBERS)).encode() + data[number.end() :]


def repeat_line(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    place = rng.randrange(len(lines))
    return b"".join([*lines[:place], lines[place] * _times(len(lines[place]), rng), *lines[place + 1 :]])


def nest_text(data: bytes, rng: random.Random) -> bytes:
    """Put brackets around a word, more than a parser may follow."""
    words = list(re.finditer(rb"[A-Za-z0-9_.+-]+", data))
    word = rng.choice(words) if words else None
    first, last = (word.start(), word.end()) if word else (0, len(data))
    depth, (left, right) = rng.choice(DEPTHS), rng.choice(((b"[", b"]"), (b'{"a":', b"}"), (b"- ", b""), (b"{", b"}")))
    return data[:first] + left * depth + data[first:last] + right * depth + data[last:]


def alias(data: bytes, rng: random.Random) -> bytes:
    """Name a YAML value, and put it in the place of others; or aliases of aliases before all."""
    if rng.random() < 0.3:
        levels = "\n".join(f"l{k}: &l{k} [{', '.join([f'*l{k - 1}'] * 9)}]" for k in range(1, rng.choice((3, 9, 30))))
        return f"l0: &l0 [1, 2]\n{levels}\n".encode() + data
    words = list(re.finditer(rb"(?<=: )[^\s#,\]}][^\n,\]}]*", data))
    if len(words) < 2:
        return data
    first, *others = sorted(rng.sample(words, rng.randint(2, min(8, len(words)))), key=lambda word: word.start())
    spoiled, end = data[: first.start()] + b"&a ", first.start()
    for word in others:
        spoiled, end = spoiled + data[end : word.start()] + b"*a", max(word.end(), end)
    return spoiled + data[end:]


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Return (container, key) of every value of a tree."""
    found, left = [], [tree]
    while left:
        item = left.pop()
        keys = list(item) if isinstance(item, dict) else range(len(item)) if isinstance(item, list) else ()
        found += [(item, key) for key in keys]
        left += [item[key] for key in keys]
    return found


def _at_a_place(change: Callable[[Any, Any, random.Random], None]) -> Callable[[Any, random.Random], Any]:
    def changed(tree: Any, rng: random.Random) -> Any:
        places = _places(tree)
        if not places:
            return rng.choice(JUNK)
        change(*rng.choice(places), rng)
        return tree

    return changed


def _set_value(container: Any, key: Any, rng: random.Random) -> None:
    container[key] = copy.deepcopy(rng.choice(JUNK))


def _set_numbers(container: Any, key: Any, rng: random.Random) -> None:
    """Set a value, or all numbers below it, to a telling number."""
    number = rng.choice((*NUMBERS, 0.5, 1e308, 1e-308))
    numbers = [(item, inner) for item, inner in _places(container[key]) if isinstance(item[inner], (int, float))]
    for item, inner in numbers or [(container, key)]:
        item[inner] = number


def _remove(container: Any, key: Any, rng: random.Random) -> None:
    del container[key]


def _repeat_item(container: Any, key: Any, rng: random.Random) -> None:
    times = _times(len(tree_text(container[key])), rng)
    if isinstance(container, list):
        container[key:key] = [container[key]] * times
    else:
        container.update({f"{key}{i}": container[key] for i in range(times)})


def _nest(container: Any, key: Any, rng: random.Random) -> None:
    container[key] = [container[key]] if rng.random() < 0.3 else f"{_PLACE}{rng.choice(DEPTHS)}"


def _rename(container: Any, key: Any, rng: random.Random) -> None:
    if isinstance(container, dict):
        container[str(rng.choice(("", "x", key, f"{key} ", "*", "a/b", "\n", "é" * 40, "9" * 5000, "²")))] = container.pop(key)
    else:
        container.reverse()


def _lengthen(container: Any, key: Any, rng: random.Random) -> None:
    value = container[key]
    times = _times(len(tree_text(value)), rng)
    container[key] = (value if isinstance(value, str | list) else [value]) * times


def _exchange(tree: Any, rng: random.Random) -> Any:
    places = _places(tree)
    if len(places) >= 2:
        (a, key_a), (b, key_b) = rng.sample(places, 2)
        a[key_a], b[key_b] = copy.deepcopy(b[key_b]), copy.deepcopy(a[key_a])
    return tree


OF_BYTES = (truncate, flip, set_field, delete, repeat, insert, zero, swap)
OF_TEXT = (set_token, set_number, repeat_line, nest_text)
OF_YAML = (alias,)
OF_TREES = {
    "set value": _at_a_place(_set_value), "set numbers": _at_a_place(_set_numbers), "remove": _at_a_place(_remove),
    "repeat item": _at_a_place(_repeat_item), "nest": _at_a_place(_nest), "rename": _at_a_place(_rename),
    "lengthen": _at_a_place(_lengthen), "exchange": _exchange,
}  # fmt: skip


def tree_text(tree: Any) -> bytes:
    """Return a tree as JSON, which YAML readers take too; places that are to nest do."""
    text = json.dumps(tree)
    return re.sub(rf'"{_PLACE}(\d+)"', lambda match: "[" * int(match[1]) + "]" * int(match[1]), text).encode()


def spoil_tree(tree: Any, rng: random.Random) -> tuple[bytes, list[str]]:
    """Return the text of a tree after some of the table's changes, cut to ``MAX_BYTES``, and their names."""
    spoiled, names, text = copy.deepcopy(tree), [], b""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        names.append(rng.choice(list(OF_TREES)))
        spoiled = OF_TREES[names[-1]](spoiled, rng)
        text = tree_text(spoiled)
        if len(text) > MAX_BYTES // 20:
            break
    return text[:MAX_BYTES], names


def spoil(data: bytes, table: tuple[Callable[[bytes, random.Random], bytes], ...], rng: random.Random) -> tuple[bytes, list[str]]:
    """Return bytes after some of the table's changes, cut to ``MAX_BYTES``, and their names."""
    names = []
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        mutation = rng.choice(table)
        names.append(mutation.__name__)
        data = mutation(data, rng)[:MAX_BYTES]
    return data, names
