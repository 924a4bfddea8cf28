"""How errors are told to the user."""

import errno
import tracemalloc
from pathlib import Path

import pytest

from scene_description import SceneSynthError, error_line, read_at_most


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (FileNotFoundError(errno.ENOENT, "No such file or directory", "room.json"), "room.json: no such file or directory; check the path"),
        (PermissionError(errno.EACCES, "Permission denied", b"/a/b"), "/a/b: permission denied; check the permissions"),
        (OSError(errno.EXDEV, "Invalid cross-device link", "/a", None, "/b"), "/a -> /b: invalid cross-device link"),
        (OSError(errno.ENOSPC, "No space left on device"), "no space left on device; free some space or choose another disk"),
        (OSError(errno.EBADF, "Bad file descriptor", 7), "bad file descriptor"),
        (OSError("libembree4.so: cannot open\nshared object"), "libembree4.so: cannot open shared object"),
        (SceneSynthError("rooms: expected 3,\n  got 4"), "rooms: expected 3, got 4"),
        (SceneSynthError("bed\x1b[2J\ud800: 'a\r\nb'\u2028"), "bed\\x1b[2J\\ud800: 'a b'"),
        (FileNotFoundError(errno.ENOENT, "No such file or directory", "a\nb"), "a b: no such file or directory; check the path"),
        (OSError(), "OSError"),
    ],
)
def test_an_error_is_one_line_without_numbers_of_the_operating_system(error: BaseException, line: str) -> None:
    assert error_line(error) == line


def test_an_error_tells_itself_in_one_line() -> None:
    assert str(SceneSynthError("a\nb\x00")) == "a b\\x00"
    assert str(SceneSynthError("two  blanks, é")) == "two  blanks, é"
    assert str(SceneSynthError("x" * 10**6 + "y")) == "x" * 2500 + " ... " + "x" * 2494 + "y"


def test_no_more_is_read_of_a_file_than_it_may_have(tmp_path: Path) -> None:
    (tmp_path / "ten").write_bytes(b"0123456789")
    assert read_at_most(tmp_path / "ten", 10, SceneSynthError) == b"0123456789"
    tracemalloc.start()
    assert read_at_most(tmp_path / "ten", 2**30, SceneSynthError) == b"0123456789"
    for path, most in ((tmp_path / "ten", 9), (Path("/dev/zero"), 3 * 2**20)):
        with pytest.raises(SceneSynthError, match=f"^{path}: expected at most {most} bytes, got more$"):
            read_at_most(path, most, SceneSynthError)
    assert tracemalloc.get_traced_memory()[1] < 10 * 2**20
    tracemalloc.stop()
